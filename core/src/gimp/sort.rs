//! Sorts the points by cell, so that neighbours in space are neighbours in memory, and finds the nodes in use.

use super::advance::Arena;
use super::block::Block;

/// Nodes beyond a point's cell that it may touch before the next sort: its own reach and one for its move.
const MARGIN: usize = 2;

/// Sorts the points stably by cell, zeroes the grid, and marks the sums as to be scattered anew.
pub(super) fn sort(arena: &mut Arena, order: &mut [u32]) {
    let count = order.len();
    let cells: Vec<usize> = (0..count)
        .map(|i| {
            let block = &arena.blocks[i / 8];
            arena.grid.cell_of(block.x.0[i % 8], block.y.0[i % 8])
        })
        .collect();
    let mut places: Vec<u32> = (0..count as u32).collect();
    places.sort_by_key(|&i| cells[i as usize]);

    let mut blocks = vec![Block::EMPTY; arena.blocks.len()];
    let old_order = order.to_vec();
    for (to, &from) in places.iter().enumerate() {
        let from = from as usize;
        blocks[to / 8].copy_point(to % 8, &arena.blocks[from / 8], from % 8);
        order[to] = old_order[from];
    }
    pad(&mut blocks, count);
    arena.blocks = blocks;
    find_spans(arena, &cells);
    arena.rescatter();
}

/// Fills the last block with elastic, unstressed points of no mass and no volume in the place of the last real point.
fn pad(blocks: &mut [Block], count: usize) {
    if count.is_multiple_of(8) {
        return;
    }
    if let Some(last) = blocks.last_mut() {
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
                &mut last.force_x,
                &mut last.force_y,
                &mut last.pressure,
                &mut last.sxx,
                &mut last.syy,
                &mut last.szz,
                &mut last.sxy,
            ] {
                quantity.0[lane] = 0.0;
            }
            last.cohesion.0[lane] = f64::INFINITY;
            last.tension_cutoff.0[lane] = f64::INFINITY;
            last.two_c_cos_phi.0[lane] = f64::INFINITY;
            last.apex.0[lane] = f64::INFINITY;
            last.tension.0[lane] = f64::INFINITY;
        }
    }
}

fn find_spans(arena: &mut Arena, cells: &[usize]) {
    let [nx, ny] = arena.grid.nodes;
    let mut ends = vec![(nx, 0); ny];
    for &cell in cells {
        let (i, j) = (cell % nx, cell / nx);
        for row in &mut ends[j.saturating_sub(MARGIN)..(j + MARGIN + 2).min(ny)] {
            row.0 = row.0.min(i.saturating_sub(MARGIN));
            row.1 = row.1.max((i + MARGIN + 2).min(nx));
        }
    }
    arena.nodes.spans.clear();
    for (j, &(start, end)) in ends.iter().enumerate() {
        if start < end {
            arena.nodes.spans.push(j * nx + start..j * nx + end);
        }
    }
}
