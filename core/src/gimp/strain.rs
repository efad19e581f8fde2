//! Velocity gradients at the points and their means over cells (B-bar for the material point method: the
//! volumetric strain increment of a point is replaced by its cell's mean, weighted with volume).

use super::block::{Block, Extra};
use super::grid::GridLanes;
use super::lanes::{Lanes, Row, V8};
use super::shape;
use super::transfer::{self, GradientPairs, Gradients};
use super::window::Window;
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
    pub(super) fn hydrostatic<S: Lanes, const EXTRA: bool>(
        &self,
        grid: &GridLanes<S>,
        block: &Block,
        extra: Option<&Extra>,
    ) -> S {
        let [x, y] = grid.offsets_in_cells(grid.coordinates(&block.x, &block.y));
        let rise = S::splat(self.water_weight[0]).mul_add(x, S::splat(self.water_weight[1]) * y);
        match extra {
            Some(extra) if EXTRA && self.held_differs => rise * (S::splat(1.0) - S::load(&extra.held)),
            _ => rise,
        }
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
    extra: Option<&Extra>,
    nodes: &mut Window<'_>,
) {
    let zero = S::splat(0.0);
    let (shape, slopes) = shape::values_and_slopes::<S, EXTRA>(grid, block, extra);
    let [vx_x, vy_x, wx_x, vx_y, vy_y, wy_y] = if TWO {
        let [vx_x, vy_x, wx_x, _, vx_y, vy_y, _, wy_y] =
            transfer::collect::<S>(&Gradients(&shape, &slopes), stride, nodes.velocities);
        [vx_x, vy_x, wx_x, vx_y, vy_y, wy_y]
    } else {
        let [vx_x, vy_x, vx_y, vy_y] =
            transfer::collect_low::<S>(&GradientPairs(&shape, &slopes), stride, nodes.velocities);
        [vx_x, vy_x, zero, vx_y, vy_y, zero]
    };
    let (xx, yy) = (vx_x * dt, vy_y * dt);
    xx.store(&mut block.lxx);
    (vy_x * dt).store(&mut block.lyx);
    (vx_y * dt).store(&mut block.lxy);
    yy.store(&mut block.lyy);
    let mut water = zero;
    if TWO {
        water = (wx_x + wy_y) * dt;
        water.store(&mut block.water_divergence);
    }
    if let Some(averaging) = average {
        let volume = S::load(&block.volume);
        let pressure = if TWO {
            volume * (S::load(&block.pressure) - averaging.hydrostatic::<S, EXTRA>(grid, block, extra))
        } else {
            zero
        };
        let rows = transfer::low_rows([volume, volume * (xx + yy), volume * water, pressure]);
        let cells = grid.cells(grid.coordinates(&block.x, &block.y));
        for (row, &cell) in rows.iter().zip(&cells) {
            let cell = &mut nodes.cells[cell];
            (S::Low::load(cell) + S::Low::load(row)).store(cell);
        }
    }
}

/// Turns the cells' sums into means.
#[inline(always)]
pub(super) fn average_cells(nodes: &mut Window<'_>, spans: &[Range<usize>]) {
    for Range { start, end } in spans.iter().cloned() {
        for cell in &mut nodes.cells[start - nodes.first..end - nodes.first] {
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
    let mut rows = [V8::ZERO; 8];
    for (row, &place) in rows.iter_mut().zip(&places) {
        S::Low::load(&cells[place]).store(row);
    }
    let [_, skeleton, water, pressure] = S::load_low_rows(&rows);
    [skeleton, water, pressure]
}
