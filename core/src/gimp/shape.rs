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

use super::block::{Block, Extra};
use super::grid::GridLanes;
use super::lanes::{Lanes, V8};

/// Shape functions of eight points at the 3 x 3 nodes around each: S = S_x S_y.
pub(super) struct Shape {
    /// S_x at the three columns of nodes.
    pub(super) x: [V8; 3],
    /// S_y at the three rows of nodes.
    pub(super) y: [V8; 3],
    /// Index of the lower left of the nine nodes.
    pub(super) base: [usize; 8],
}

/// Derivatives of S_x and S_y, 1/m.
pub(super) struct Slopes {
    pub(super) x: [V8; 3],
    pub(super) y: [V8; 3],
}

/// Half the side of a point's domain along one axis, in cells, and what follows from it.
#[derive(Clone, Copy)]
pub(super) struct HalfLength<S> {
    l: S,
    quarter_over_l: S,
    half_over_l: S,
}

impl<S: Lanes> HalfLength<S> {
    #[inline(always)]
    pub(super) fn new(l: S) -> Self {
        HalfLength { l, quarter_over_l: S::splat(0.25) / l, half_over_l: S::splat(0.5) / l }
    }
}

/// The shape functions of eight points.
#[inline(always)]
pub(super) fn values<S: Lanes, const EXTRA: bool>(
    grid: &GridLanes<S>,
    block: &Block,
    extra: Option<&Extra>,
) -> Shape {
    let (places, _) = places::<S, EXTRA>(grid, block, extra);
    shape_at(grid, &places)
}

/// The shape functions of eight points and their derivatives.
#[inline(always)]
pub(super) fn values_and_slopes<S: Lanes, const EXTRA: bool>(
    grid: &GridLanes<S>,
    block: &Block,
    extra: Option<&Extra>,
) -> (Shape, Slopes) {
    let (places, lengths) = places::<S, EXTRA>(grid, block, extra);
    let slopes = Slopes {
        x: places[0].slopes(&lengths[0], grid.inverse_cell),
        y: places[1].slopes(&lengths[1], grid.inverse_cell),
    };
    (shape_at(grid, &places), slopes)
}

#[inline(always)]
fn shape_at<S: Lanes>(grid: &GridLanes<S>, [x, y]: &[Place<S>; 2]) -> Shape {
    let one = S::splat(1.0);
    let base = (y.nearest - one).mul_add(grid.stride, x.nearest - one) - grid.first;
    Shape { x: x.values, y: y.values, base: base.indices() }
}

#[inline(always)]
fn places<S: Lanes, const EXTRA: bool>(
    grid: &GridLanes<S>,
    block: &Block,
    extra: Option<&Extra>,
) -> ([Place<S>; 2], [HalfLength<S>; 2]) {
    let [cx, cy] = grid.coordinates(&block.x, &block.y);
    let lengths = half_lengths::<S, EXTRA>(grid, extra);
    let x = Place::new(cx, grid.nearest[0], &lengths[0]);
    let y = Place::new(cy, grid.nearest[1], &lengths[1]);
    ([x, y], lengths)
}

/// Half the sides of the domains of eight points: their own if domains stretch.
#[inline(always)]
fn half_lengths<S: Lanes, const EXTRA: bool>(
    grid: &GridLanes<S>,
    extra: Option<&Extra>,
) -> [HalfLength<S>; 2] {
    match extra {
        Some(own) if EXTRA && grid.stretch => {
            [HalfLength::new(S::load(&own.half_x)), HalfLength::new(S::load(&own.half_y))]
        }
        _ => [grid.half_length; 2],
    }
}

/// Where eight points are along one axis.
struct Place<S> {
    /// The nearest node.
    nearest: S,
    /// Distances from the ends of the point's domain to the nearest node, clamped to the domain, in cells.
    to_left: S,
    to_right: S,
    /// The shape functions of the three nodes.
    values: [V8; 3],
}

impl<S: Lanes> Place<S> {
    #[inline(always)]
    fn new(coordinate: S, nearest: [S; 2], length: &HalfLength<S>) -> Self {
        let (one, zero, l) = (S::splat(1.0), S::splat(0.0), length.l);
        let nearest = (coordinate + S::splat(0.5)).floor().max(nearest[0]).min(nearest[1]);
        let d = coordinate - nearest;
        let e = d.max(-l).min(l);
        let (to_left, to_right) = (l - e, l + e);
        let left = (to_left * to_left).mul_add(length.quarter_over_l, (e - d).max(zero));
        let right = (to_right * to_right).mul_add(length.quarter_over_l, (d - e).max(zero));
        let values = store([left, one - left - right, right]);
        Place { nearest, to_left, to_right, values }
    }

    /// Derivatives of the shape functions, 1/m.
    #[inline(always)]
    fn slopes(&self, length: &HalfLength<S>, inverse_cell: S) -> [V8; 3] {
        let per_metre = length.half_over_l * inverse_cell;
        let left = -(self.to_left * per_metre);
        let right = self.to_right * per_metre;
        store([left, -(left + right), right])
    }
}

#[inline(always)]
fn store<S: Lanes>(vectors: [S; 3]) -> [V8; 3] {
    let mut rows = [V8::ZERO; 3];
    vectors[0].store(&mut rows[0]);
    vectors[1].store(&mut rows[1]);
    vectors[2].store(&mut rows[2]);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gimp::Grid;
    use crate::gimp::lanes::Baseline;

    fn points(half: f64) -> (Block, Extra) {
        (Block::EMPTY, Extra { half_x: V8([half; 8]), half_y: V8([half; 8]), ..Extra::EMPTY })
    }

    /// Weights add up to 1, gradients to 0, and both reproduce a linear function: to 1e-13 of the cell coordinates'
    /// size, which is what round-off in the position (about 20 cells from the origin) leaves.
    #[test]
    fn partition_of_unity_and_linear_reproduction() {
        let grid = Grid::enclosing(0.0, 0.0, [20, 20], 0.5);
        for points_per_side in [2.0, 3.0, 4.0] {
            let lanes = GridLanes::<Baseline>::new(&grid, &(0..grid.nodes[1]), 0.25, true);
            for step in 0..200 {
                let place = |k: usize| 0.1 + (0.618 * (8 * step + k) as f64).fract() * 9.8;
                let (mut block, mut extra) = points(0.5 / points_per_side);
                for q in 0..8 {
                    block.x.0[q] = place(q);
                    block.y.0[q] = place(q + 3);
                    // Stretched points, up to a cell long.
                    extra.half_x.0[q] = (extra.half_x.0[q] * (0.4 + 0.3 * q as f64)).min(0.5);
                }
                let (shape, slopes) = values_and_slopes::<Baseline, true>(&lanes, &block, Some(&extra));
                for q in 0..8 {
                    check(&grid, &shape, &slopes, q, block.x.0[q], block.y.0[q]);
                }
            }
        }
    }

    fn check(grid: &Grid, shape: &Shape, slopes: &Slopes, q: usize, x: f64, y: f64) {
        let (mut one, mut position) = (0.0, [0.0; 2]);
        let (mut zero, mut jacobian) = ([0.0; 2], [[0.0; 2]; 2]);
        for k in 0..9 {
            let (column, row) = (k % 3, k / 3);
            let [sx, sy] = [shape.x[column].0[q], shape.y[row].0[q]];
            let value = sx * sy;
            let gradient = [slopes.x[column].0[q] * sy, sx * slopes.y[row].0[q]];
            let node = shape.base[q] + column + row * grid.nodes[0];
            let at = [
                grid.origin_m[0] + (node % grid.nodes[0]) as f64 * grid.cell_m,
                grid.origin_m[1] + (node / grid.nodes[0]) as f64 * grid.cell_m,
            ];
            one += value;
            for a in 0..2 {
                position[a] += value * at[a];
                zero[a] += gradient[a];
                for (sum, position) in jacobian[a].iter_mut().zip(at) {
                    *sum += gradient[a] * position;
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
        let lanes = GridLanes::<Baseline>::new(&grid, &(0..grid.nodes[1]), 0.25, false);
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
            let (mut block, extra) = points(l);
            block.x = V8([1.0 + 0.017 * f64::from(step); 8]);
            block.y = V8([2.0; 8]);
            let shape = values::<Baseline, true>(&lanes, &block, Some(&extra));
            for column in 0..3 {
                let node = (shape.base[0] + column) % grid.nodes[0];
                let r = block.x.0[0] - (grid.origin_m[0] + node as f64);
                let found = shape.x[column].0[0];
                assert!((found - definition(r)).abs() < 1e-14, "r = {r}");
            }
        }
    }
}
