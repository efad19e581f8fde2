//! Shape functions of the generalized interpolation material point method on square cells.
//!
//! Bardenhagen & Kober (2004), "The generalized interpolation material point method", CMES 5:477; in one dimension
//! the hat function averaged over the point's length 2 l, which stays (uGIMP) or follows the point's stretch along the axis
//! (cpGIMP). With d the distance from the nearest node in cells,
//! e = d clamped to [-l, l], the weights of the three nodes around a point are
//!
//! left (l - e)^2 / 4l + max(e - d, 0), right (l + e)^2 / 4l + max(d - e, 0), centre 1 - left - right:
//!
//! one expression for all three branches of the definition. Valid for l from 0 to 1/2 cell.

use super::block::Block;
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};

/// Weights of the 3 x 3 nodes around each of eight points; node k = 3 row + column.
pub(super) struct Shape {
    /// S, dimensionless.
    pub(super) value: [V8; 9],
    /// dS/dx and dS/dy, 1/m; only where gradients were asked for.
    pub(super) gradient: [[V8; 9]; 2],
    /// Index of the lower left of the nine nodes.
    pub(super) base: [usize; 8],
}

impl Shape {
    #[inline(always)]
    pub(super) fn empty() -> Shape {
        Shape { value: [V8::ZERO; 9], gradient: [[V8::ZERO; 9]; 2], base: [0; 8] }
    }
}

/// One dimension: index of the left node, weights, derivatives per cell.
#[inline(always)]
fn along<S: Lanes>(coordinate: S, last_nearest: S, l: S) -> (S, [S; 3], [S; 3]) {
    let one = S::splat(1.0);
    let nearest = (coordinate + S::splat(0.5)).floor().max(one).min(last_nearest);
    let d = coordinate - nearest;
    let e = d.max(-l).min(l);
    let half_over_l = S::splat(0.5) / l;
    let quarter_over_l = S::splat(0.25) / l;
    let (to_left, to_right) = (l - e, l + e);
    let zero = S::splat(0.0);
    let left = (to_left * to_left).mul_add(quarter_over_l, (e - d).max(zero));
    let right = (to_right * to_right).mul_add(quarter_over_l, (d - e).max(zero));
    let slope_left = -(to_left * half_over_l);
    let slope_right = to_right * half_over_l;
    (nearest - one, [left, one - left - right, right], [slope_left, -(slope_left + slope_right), slope_right])
}

/// Half the sides of the domains of eight points, in cells: their own in the step with extras.
#[inline(always)]
fn half_lengths<S: Lanes, const EXTRA: bool>(grid: &GridLanes<S>, block: &Block) -> [S; 2] {
    if EXTRA { [S::load(&block.half_x), S::load(&block.half_y)] } else { [grid.half_length; 2] }
}

/// Values of the shape functions of eight points.
#[inline(always)]
pub(super) fn values<S: Lanes, const EXTRA: bool>(grid: &GridLanes<S>, block: &Block, shape: &mut Shape) {
    let [cx, cy] = grid.coordinates(&block.x, &block.y);
    let [lx, ly] = half_lengths::<S, EXTRA>(grid, block);
    let (i, sx, _) = along(cx, grid.last_nearest[0], lx);
    let (j, sy, _) = along(cy, grid.last_nearest[1], ly);
    shape.base = j.mul_add(grid.stride, i).indices();
    for (row, &sy) in sy.iter().enumerate() {
        for (column, &sx) in sx.iter().enumerate() {
            (sx * sy).store(&mut shape.value[3 * row + column]);
        }
    }
}

/// Values and gradients of the shape functions of eight points.
#[inline(always)]
pub(super) fn values_and_gradients<S: Lanes, const EXTRA: bool>(
    grid: &GridLanes<S>,
    block: &Block,
    shape: &mut Shape,
) {
    let [cx, cy] = grid.coordinates(&block.x, &block.y);
    let [lx, ly] = half_lengths::<S, EXTRA>(grid, block);
    let (i, sx, dx) = along(cx, grid.last_nearest[0], lx);
    let (j, sy, dy) = along(cy, grid.last_nearest[1], ly);
    shape.base = j.mul_add(grid.stride, i).indices();
    for (row, (&sy, &dy)) in sy.iter().zip(&dy).enumerate() {
        let dy = dy * grid.inverse_cell;
        for (column, (&sx, &dx)) in sx.iter().zip(&dx).enumerate() {
            let k = 3 * row + column;
            (sx * sy).store(&mut shape.value[k]);
            (dx * grid.inverse_cell * sy).store(&mut shape.gradient[0][k]);
            (sx * dy).store(&mut shape.gradient[1][k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gimp::Grid;
    use crate::gimp::lanes::Baseline;

    fn block(half_x: f64, half_y: f64) -> Block {
        Block { half_x: V8([half_x; 8]), half_y: V8([half_y; 8]), ..Block::EMPTY }
    }

    /// Weights add up to 1, gradients to 0, and both reproduce a linear function: to 1e-13 of the cell coordinates'
    /// size, which is what round-off in the position (about 20 cells from the origin) leaves.
    #[test]
    fn partition_of_unity_and_linear_reproduction() {
        let grid = Grid::enclosing(0.0, 0.0, [20, 20], 0.5);
        for points_per_side in [2.0, 3.0, 4.0] {
            let lanes = GridLanes::<Baseline>::new(&grid, 0.25);
            for step in 0..200 {
                let place = |k: usize| 0.1 + (0.618 * (8 * step + k) as f64).fract() * 9.8;
                let mut block = block(0.5 / points_per_side, 0.5 / points_per_side);
                for q in 0..8 {
                    block.x.0[q] = place(q);
                    block.y.0[q] = place(q + 3);
                    // Stretched points, up to a cell long.
                    block.half_x.0[q] = (block.half_x.0[q] * (0.4 + 0.3 * q as f64)).min(0.5);
                }
                let mut shape = Shape::empty();
                values_and_gradients::<Baseline, true>(&lanes, &block, &mut shape);
                for q in 0..8 {
                    check(&grid, &shape, q, block.x.0[q], block.y.0[q]);
                }
            }
        }
    }

    fn check(grid: &Grid, shape: &Shape, q: usize, x: f64, y: f64) {
        let (mut one, mut position) = (0.0, [0.0; 2]);
        let (mut zero, mut jacobian) = ([0.0; 2], [[0.0; 2]; 2]);
        for k in 0..9 {
            let node = shape.base[q] + k % 3 + (k / 3) * grid.nodes[0];
            let at = [
                grid.origin_m[0] + (node % grid.nodes[0]) as f64 * grid.cell_m,
                grid.origin_m[1] + (node / grid.nodes[0]) as f64 * grid.cell_m,
            ];
            one += shape.value[k].0[q];
            for a in 0..2 {
                position[a] += shape.value[k].0[q] * at[a];
                zero[a] += shape.gradient[a][k].0[q];
                for (sum, position) in jacobian[a].iter_mut().zip(at) {
                    *sum += shape.gradient[a][k].0[q] * position;
                }
            }
        }
        let tolerance = 1e-13 * 20.0;
        assert!((one - 1.0).abs() < 1e-13);
        assert!((position[0] - x).abs() < tolerance && (position[1] - y).abs() < tolerance);
        for a in 0..2 {
            assert!(zero[a].abs() < 1e-13 / grid.cell_m);
            for (b, found) in jacobian[a].iter().enumerate() {
                let expected = if a == b { 1.0 } else { 0.0 };
                assert!((found - expected).abs() < tolerance);
            }
        }
    }

    /// The three branches of the definition (Steffen, Kirby & Berzins 2008, Eq. 33), written out.
    #[test]
    fn weights_are_those_of_the_definition() {
        let grid = Grid::enclosing(0.0, 0.0, [4, 4], 1.0);
        let lanes = GridLanes::<Baseline>::new(&grid, 0.25);
        let l = 0.25;
        let definition = |r: f64| {
            let r: f64 = r.abs();
            if r < l {
                1.0 - (r * r + l * l) / (2.0 * l)
            } else if r <= 1.0 - l {
                1.0 - r
            } else if r < 1.0 + l {
                (1.0 + l - r) * (1.0 + l - r) / (4.0 * l)
            } else {
                0.0
            }
        };
        for step in 0..100 {
            let mut block = block(l, l);
            block.x = V8([1.0 + 0.017 * f64::from(step); 8]);
            block.y = V8([2.0; 8]);
            let mut shape = Shape::empty();
            values::<Baseline, true>(&lanes, &block, &mut shape);
            for column in 0..3 {
                let node = (shape.base[0] + column) % grid.nodes[0];
                let r = block.x.0[0] - (grid.origin_m[0] + node as f64);
                let found: f64 = (0..3).map(|row| shape.value[3 * row + column].0[0]).sum();
                assert!((found - definition(r)).abs() < 1e-14, "r = {r}");
            }
        }
    }
}
