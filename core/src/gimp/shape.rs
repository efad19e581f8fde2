//! Shape functions of the uniform generalized interpolation material point method (uGIMP) on square cells.
//!
//! Bardenhagen & Kober (2004), "The generalized interpolation material point method", CMES 5:477; in one dimension
//! the hat function averaged over the point's fixed length 2 l. With d the distance from the nearest node in cells,
//! e = d clamped to [-l, l], the weights of the three nodes around a point are
//!
//! left (l - e)^2 / 4l + max(e - d, 0), right (l + e)^2 / 4l + max(d - e, 0), centre 1 - left - right:
//!
//! one expression for all three branches of the definition. Valid for l from 0 to 1/2 cell.

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

/// Values of the shape functions of eight points.
#[inline(always)]
pub(super) fn values<S: Lanes>(grid: &GridLanes<S>, x: &V8, y: &V8, shape: &mut Shape) {
    let [cx, cy] = grid.coordinates(x, y);
    let (i, sx, _) = along(cx, grid.last_nearest[0], grid.half_length);
    let (j, sy, _) = along(cy, grid.last_nearest[1], grid.half_length);
    shape.base = j.mul_add(grid.stride, i).indices();
    for row in 0..3 {
        for column in 0..3 {
            (sx[column] * sy[row]).store(&mut shape.value[3 * row + column]);
        }
    }
}

/// Values and gradients of the shape functions of eight points.
#[inline(always)]
pub(super) fn values_and_gradients<S: Lanes>(grid: &GridLanes<S>, x: &V8, y: &V8, shape: &mut Shape) {
    let [cx, cy] = grid.coordinates(x, y);
    let (i, sx, dx) = along(cx, grid.last_nearest[0], grid.half_length);
    let (j, sy, dy) = along(cy, grid.last_nearest[1], grid.half_length);
    shape.base = j.mul_add(grid.stride, i).indices();
    for row in 0..3 {
        let dy_row = dy[row] * grid.inverse_cell;
        for column in 0..3 {
            let k = 3 * row + column;
            (sx[column] * sy[row]).store(&mut shape.value[k]);
            (dx[column] * grid.inverse_cell * sy[row]).store(&mut shape.gradient[0][k]);
            (sx[column] * dy_row).store(&mut shape.gradient[1][k]);
        }
    }
}
