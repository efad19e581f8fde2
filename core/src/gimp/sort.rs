//! Sorts the points by the node nearest to them, so that neighbours in space are neighbours in memory, finds the nodes in
//! use, and cuts the work into parts.

use super::advance::Arena;
use super::block::{Block, Extra};
use super::plan::REACH;
use rayon::prelude::*;
use std::ops::Range;

/// Blocks that one thread fills at a time.
const PART: usize = 256;

/// Room for sorting, so that it allocates nothing.
#[derive(Debug, Clone)]
pub(super) struct Sorter {
    blocks: Vec<Block>,
    extras: Vec<Extra>,
    order: Vec<u32>,
    /// Nearest node of the point in each place before the sort.
    nearest: Vec<u32>,
    /// Where the points of each node go next; after the sort, where they end.
    places: Vec<u32>,
    /// The place before the sort of the point in each place after it.
    sources: Vec<u32>,
}

impl Sorter {
    pub(super) fn new(arena: &Arena, count: usize) -> Sorter {
        Sorter {
            blocks: arena.blocks.clone(),
            extras: arena.extras.clone(),
            order: vec![0; count],
            nearest: vec![0; count],
            places: vec![0; arena.grid.node_count()],
            sources: vec![0; count],
        }
    }

    /// Sorts the points stably by their nearest node, zeroes the grid, and marks the sums as to be scattered anew; with
    /// `side_by_side` in the threads of the current pool.
    pub(super) fn sort(&mut self, arena: &mut Arena, order: &mut Vec<u32>, side_by_side: bool) {
        arena.rescatter();
        self.find_places(arena, side_by_side);
        let Sorter { blocks, extras, sources, .. } = self;
        fill(blocks, side_by_side, |b, block| block.take_points(&arena.blocks, eight(sources, b)));
        fill(extras, side_by_side, |b, extra| extra.take_points(&arena.extras, eight(sources, b)));
        for (original, &source) in self.order.iter_mut().zip(&self.sources) {
            *original = order[source as usize];
        }
        std::mem::swap(&mut arena.blocks, &mut self.blocks);
        std::mem::swap(&mut arena.extras, &mut self.extras);
        std::mem::swap(order, &mut self.order);
        pad(arena, order.len());
        self.find_spans(arena);
        let Arena { grid, blocks, plan, .. } = arena;
        let row =
            |block: &Block, lane: usize| grid.nearest_node(block.x.0[lane], block.y.0[lane]) / grid.nodes[0];
        plan.cut(blocks, grid.nodes[1], row);
    }

    /// Finds where each point goes.
    fn find_places(&mut self, arena: &Arena, side_by_side: bool) {
        let Sorter { nearest, places, sources, .. } = self;
        fill(nearest, side_by_side, |i, nearest| {
            let block = &arena.blocks[i / 8];
            *nearest = arena.grid.nearest_node(block.x.0[i % 8], block.y.0[i % 8]) as u32;
        });
        places.fill(0);
        for &node in &*nearest {
            places[node as usize] += 1;
        }
        let mut before = 0;
        for place in &mut *places {
            let here = *place;
            *place = before;
            before += here;
        }
        for (from, &node) in nearest.iter().enumerate() {
            let place = &mut places[node as usize];
            sources[*place as usize] = from as u32;
            *place += 1;
        }
    }

    fn find_spans(&self, arena: &mut Arena) {
        let [nx, ny] = arena.grid.nodes;
        let spans = &mut arena.nodes.spans;
        spans.clear();
        spans.extend((0..ny).map(|j| {
            let near = j.saturating_sub(REACH)..(j + REACH + 1).min(ny);
            let columns = near.filter_map(|j| self.columns(j, nx));
            let union = columns.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end)).unwrap_or(0..0);
            j * nx + union.start..j * nx + union.end
        }));
    }

    /// Columns that the points nearest to row `j` of nodes, `nx` of them, may reach; absent if there are none.
    fn columns(&self, j: usize, nx: usize) -> Option<Range<usize>> {
        let end_of = |node: usize| self.places[node] as usize;
        let start = if j == 0 { 0 } else { end_of(j * nx - 1) };
        let end = end_of((j + 1) * nx - 1);
        // Sorted, so that the first of a row is the leftmost.
        let column = |place: usize| self.nearest[self.sources[place] as usize] as usize % nx;
        (start < end).then(|| column(start).saturating_sub(REACH)..(column(end - 1) + REACH + 1).min(nx))
    }
}

/// Fills every item, given its place; with `side_by_side` in the threads of the current pool.
fn fill<T: Send>(items: &mut [T], side_by_side: bool, of: impl Fn(usize, &mut T) + Sync) {
    let part = |(number, part): (usize, &mut [T])| {
        for (i, item) in part.iter_mut().enumerate() {
            of(number * PART + i, item);
        }
    };
    if side_by_side {
        items.par_chunks_mut(PART).enumerate().for_each(part);
    } else {
        items.chunks_mut(PART).enumerate().for_each(part);
    }
}

/// Where the points of block `b` come from; what only fills the last one goes with its last point.
fn eight(sources: &[u32], b: usize) -> [usize; 8] {
    let last = sources.len() - 1;
    std::array::from_fn(|lane| sources[(8 * b + lane).min(last)] as usize)
}

/// Has what only fills the last block go along with its last real point as that one's twins without mass, volume or
/// strength: they see what it sees, and so move as it does, but nothing feels them. Left elsewhere, they would see nodes
/// that real points have all but left, whose velocities mean nothing, and the fastest point sets the time step.
fn pad(arena: &mut Arena, count: usize) {
    if count.is_multiple_of(8) {
        return;
    }
    let filling = count % 8..8;
    if let Some(last) = arena.blocks.last_mut() {
        let Block { mass, volume, grains, pressure, sxx, syy, szz, sxy, .. } = last;
        for quantity in [mass, volume, grains, pressure, sxx, syy, szz, sxy] {
            quantity.0[filling.clone()].fill(0.0);
        }
        for strength in [&mut last.two_c_cos_phi, &mut last.apex, &mut last.tension] {
            strength.0[filling.clone()].fill(f64::INFINITY);
        }
    }
    if let Some(last) = arena.extras.last_mut() {
        for force in [&mut last.force_x, &mut last.force_y] {
            force.0[filling.clone()].fill(0.0);
        }
        for strength in [&mut last.cohesion, &mut last.tension_cutoff] {
            strength.0[filling.clone()].fill(f64::INFINITY);
        }
    }
}
