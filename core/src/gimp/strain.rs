//! Velocity gradients at the points and their means over cells (B-bar for the material point method: the
//! volumetric strain increment of a point is replaced by its cell's mean, weighted with volume).

use super::block::Block;
use super::gather::collect_gradients;
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};
use super::nodes::Nodes;
use super::shape::{self, Shape};
use std::ops::Range;

/// How means over cells are taken.
#[derive(Debug, Clone, Copy)]
pub(super) struct Averaging {
    /// Density of the water times the gravity vector times the share of the water's weight that acts on it, Pa/m.
    pub(super) water_weight: [f64; 2],
    /// Whether that share differs from point to point.
    pub(super) held_differs: bool,
}

impl Averaging {
    /// Pore pressure of eight points over that in the middle of their cells if the water is at rest, Pa. What differs
    /// between the points of a cell beyond that is what relaxation takes away: water at rest stays at rest.
    #[inline(always)]
    pub(super) fn hydrostatic<S: Lanes, const EXTRA: bool>(&self, grid: &GridLanes<S>, block: &Block) -> S {
        let [x, y] = grid.offsets_in_cells(grid.coordinates(&block.x, &block.y));
        let rise = S::splat(self.water_weight[0]).mul_add(x, S::splat(self.water_weight[1]) * y);
        if EXTRA && self.held_differs { rise * (S::splat(1.0) - S::load(&block.held)) } else { rise }
    }
}

/// Displacement gradients of eight points in this step; adds their volumetric parts to the cells if `average`.
#[inline(always)]
pub(super) fn gradients<S: Lanes, const TWO: bool, const EXTRA: bool>(
    grid: &GridLanes<S>,
    stride: usize,
    dt: S,
    average: Option<&Averaging>,
    block: &mut Block,
    nodes: &mut Nodes,
) {
    let mut shape = Shape::empty();
    shape::values_and_gradients::<S, EXTRA>(grid, block, &mut shape);
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
    if let Some(averaging) = average {
        let volume = S::load(&block.volume);
        let pressure = if TWO {
            volume * (S::load(&block.pressure) - averaging.hydrostatic::<S, EXTRA>(grid, block))
        } else {
            zero
        };
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

/// Means of the cells of eight points: volumetric strain increment of skeleton and water, pore pressure in the middle.
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
