//! Velocity gradients at the points and their means over cells (B-bar for the material point method: the
//! volumetric strain increment of a point is replaced by its cell's mean, weighted with volume).

use super::block::Block;
use super::gather::collect_gradients;
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::nodes::Nodes;
use super::shape::{self, Shape};
use std::ops::Range;

/// Displacement gradients of eight points in this step; adds their volumetric parts to the cells if `average`.
#[inline(always)]
pub(super) fn gradients<S: Lanes, const TWO: bool>(
    grid: &GridLanes<S>,
    stride: usize,
    dt: S,
    average: bool,
    block: &mut Block,
    nodes: &mut Nodes,
) {
    let mut shape = Shape::empty();
    shape::values_and_gradients(grid, &block.x, &block.y, &mut shape);
    let rows = collect_gradients(&shape, stride, &nodes.velocities);
    let [vx_x, vy_x, wx_x, _, vx_y, vy_y, _, wy_y] = S::transpose(rows);
    let (xx, yy) = (vx_x * dt, vy_y * dt);
    xx.store(&mut block.lxx);
    (vy_x * dt).store(&mut block.lyx);
    (vx_y * dt).store(&mut block.lxy);
    yy.store(&mut block.lyy);
    let zero = S::splat(0.0);
    let mut water = zero;
    if TWO {
        water = (wx_x + wy_y) * dt;
        water.store(&mut block.water_divergence);
    }
    if average {
        let volume = S::load(&block.volume);
        let pressure = if TWO { volume * S::load(&block.pressure) } else { zero };
        let parts = [volume, volume * (xx + yy), volume * water, pressure, zero, zero, zero, zero];
        let rows = S::transpose(parts);
        let cells = grid.cells(grid.coordinates(&block.x, &block.y));
        for (q, &row) in rows.iter().enumerate() {
            let cell = &mut nodes.cells[cells[q]];
            (S::load(cell) + row).store(cell);
        }
    }
}

/// Turns the cells' sums into means.
#[inline(always)]
pub(super) fn average_cells(nodes: &mut Nodes) {
    for span in 0..nodes.spans.len() {
        let Range { start, end } = nodes.spans[span].clone();
        for cell in &mut nodes.cells[start..end] {
            if cell.0[0] > 0.0 {
                let inverse = 1.0 / cell.0[0];
                for sum in &mut cell.0[1..4] {
                    *sum *= inverse;
                }
            }
        }
    }
}

/// Means of the cells of eight points: volumetric strain increment of skeleton and water, pore pressure.
#[inline(always)]
pub(super) fn cell_means<S: Lanes>(grid: &GridLanes<S>, block: &Block, cells: &[V8]) -> [S; 3] {
    let places = grid.cells(grid.coordinates(&block.x, &block.y));
    let mut rows = [S::splat(0.0); 8];
    for (row, &place) in rows.iter_mut().zip(&places) {
        *row = S::load(&cells[place]);
    }
    let [_, skeleton, water, pressure, ..] = S::transpose(rows);
    [skeleton, water, pressure]
}
