//! Sorts the points by the node nearest to them, so that neighbours in space are neighbours in memory, finds the nodes in
//! use, and cuts the work into parts.

use super::advance::Arena;
use super::block::{Block, Extra};
use super::plan::REACH;

/// Room for sorting, so that it allocates nothing.
#[derive(Debug, Clone)]
pub(super) struct Sorter {
    blocks: Vec<Block>,
    extras: Vec<Extra>,
    order: Vec<u32>,
    /// Nearest node of the point in each place.
    nearest: Vec<u32>,
    /// Where the points of each node go next.
    places: Vec<u32>,
}

impl Sorter {
    pub(super) fn new(arena: &Arena, count: usize) -> Sorter {
        Sorter {
            blocks: arena.blocks.clone(),
            extras: arena.extras.clone(),
            order: vec![0; count],
            nearest: vec![0; count],
            places: vec![0; arena.grid.node_count()],
        }
    }

    /// Sorts the points stably by their nearest node, zeroes the grid, and marks the sums as to be scattered anew.
    pub(super) fn sort(&mut self, arena: &mut Arena, order: &mut Vec<u32>) {
        let count = order.len();
        self.find_places(arena, count);
        for (from, &original) in order.iter().enumerate() {
            let place = &mut self.places[self.nearest[from] as usize];
            let to = *place as usize;
            *place += 1;
            self.blocks[to / 8].copy_point(to % 8, &arena.blocks[from / 8], from % 8);
            self.order[to] = original;
            if let Some(extra) = self.extras.get_mut(to / 8) {
                extra.copy_point(to % 8, &arena.extras[from / 8], from % 8);
            }
        }
        std::mem::swap(&mut arena.blocks, &mut self.blocks);
        std::mem::swap(&mut arena.extras, &mut self.extras);
        std::mem::swap(order, &mut self.order);
        pad(arena, count);
        self.find_spans(arena);
        let Arena { grid, blocks, plan, .. } = arena;
        let row =
            |block: &Block, lane: usize| grid.nearest_node(block.x.0[lane], block.y.0[lane]) / grid.nodes[0];
        plan.cut(blocks, grid.nodes[1], row);
        arena.rescatter();
    }

    fn find_places(&mut self, arena: &Arena, count: usize) {
        self.places.fill(0);
        for i in 0..count {
            let block = &arena.blocks[i / 8];
            let node = arena.grid.nearest_node(block.x.0[i % 8], block.y.0[i % 8]);
            self.nearest[i] = node as u32;
            self.places[node] += 1;
        }
        let mut before = 0;
        for place in &mut self.places {
            let here = *place;
            *place = before;
            before += here;
        }
    }

    fn find_spans(&self, arena: &mut Arena) {
        let [nx, ny] = arena.grid.nodes;
        let spans = &mut arena.nodes.spans;
        spans.clear();
        spans.extend((0..ny).map(|j| (j + 1) * nx..j * nx));
        for &node in &self.nearest {
            let (i, j) = (node as usize % nx, node as usize / nx);
            let rows = j.saturating_sub(REACH)..(j + REACH + 1).min(ny);
            for (span, j) in spans[rows.clone()].iter_mut().zip(rows) {
                span.start = span.start.min(j * nx + i.saturating_sub(REACH));
                span.end = span.end.max(j * nx + (i + REACH + 1).min(nx));
            }
        }
        for span in spans.iter_mut().filter(|span| span.start > span.end) {
            span.start = span.end;
        }
    }
}

/// Fills the last block with elastic, unstressed points of no mass and no volume in the place of the last real point.
fn pad(arena: &mut Arena, count: usize) {
    if count.is_multiple_of(8) {
        return;
    }
    if let Some(last) = arena.blocks.last_mut() {
        let model = last.clone();
        for lane in count % 8..8 {
            last.copy_point(lane, &model, count % 8 - 1);
            for quantity in [
                &mut last.vx,
                &mut last.vy,
                &mut last.wx,
                &mut last.wy,
                &mut last.mass,
                &mut last.volume,
                &mut last.grains,
                &mut last.pressure,
                &mut last.sxx,
                &mut last.syy,
                &mut last.szz,
                &mut last.sxy,
            ] {
                quantity.0[lane] = 0.0;
            }
            last.two_c_cos_phi.0[lane] = f64::INFINITY;
            last.apex.0[lane] = f64::INFINITY;
            last.tension.0[lane] = f64::INFINITY;
        }
    }
    if let Some(last) = arena.extras.last_mut() {
        let model = last.clone();
        for lane in count % 8..8 {
            last.copy_point(lane, &model, count % 8 - 1);
            last.force_x.0[lane] = 0.0;
            last.force_y.0[lane] = 0.0;
            last.cohesion.0[lane] = f64::INFINITY;
            last.tension_cutoff.0[lane] = f64::INFINITY;
        }
    }
}
