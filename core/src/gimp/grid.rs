//! The background grid: square cells, one layer of nodes behind every wall.
//!
//! Node (i, j) stands at origin + (i h, j h) and has the index j nx + i. The walls run through nodes 1 and nx - 2
//! (ny - 2) of each direction; the nodes behind them exist because a point nearer to a wall than its half-length
//! reaches over it.

use super::lanes::{Lanes, V8};
use super::shape::HalfLength;
use std::ops::Range;

/// A regular grid of square cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Position of node (0, 0), behind the lower left corner, m.
    pub origin_m: [f64; 2],
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Nodes along x and y, the layers behind the walls included.
    pub nodes: [usize; 2],
}

impl Grid {
    /// A grid whose walls enclose [left, left + cells_x h] x [bottom, bottom + cells_y h], lengths in m.
    pub fn enclosing(left_m: f64, bottom_m: f64, cells: [usize; 2], cell_m: f64) -> Grid {
        Grid { origin_m: [left_m - cell_m, bottom_m - cell_m], cell_m, nodes: [cells[0] + 3, cells[1] + 3] }
    }

    /// Number of nodes, those behind the walls included.
    pub fn node_count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Share of the four cells around node (i, j) that lie between the walls: 1 inside, 1/2 on a wall.
    pub(super) fn share_inside(&self, i: usize, j: usize) -> f64 {
        let along = |k: usize, n: usize| match k {
            _ if k == 0 || k + 1 == n => 0.0,
            _ if k == 1 || k + 2 == n => 0.5,
            _ => 1.0,
        };
        along(i, self.nodes[0]) * along(j, self.nodes[1])
    }

    /// The node nearest to a point.
    pub(super) fn nearest_node(&self, x: f64, y: f64) -> usize {
        self.cell_of(x + 0.5 * self.cell_m, y + 0.5 * self.cell_m)
    }

    /// The cell that holds a point, as the index of its lower left node.
    pub(crate) fn cell_of(&self, x: f64, y: f64) -> usize {
        let along = |position: f64, origin: f64, n: usize| {
            let cell = ((position - origin) / self.cell_m).floor();
            cell.clamp(0.0, (n - 1) as f64) as usize
        };
        along(y, self.origin_m[1], self.nodes[1]) * self.nodes[0] + along(x, self.origin_m[0], self.nodes[0])
    }
}

/// The grid as the kernels see it.
#[derive(Clone, Copy)]
pub(super) struct GridLanes<S> {
    pub(super) origin: [S; 2],
    pub(super) inverse_cell: S,
    /// Nodes in a row.
    pub(super) stride: S,
    /// Index of the first node at hand: others are counted from it.
    pub(super) first: S,
    /// First and last node that may be the nearest to a point, per direction.
    pub(super) nearest: [[S; 2]; 2],
    /// First and last node that may be the lower left corner of a point's cell, per direction.
    corner: [[S; 2]; 2],
    /// Last node that may be the nearest to a point in the whole grid, per direction (the first is 1).
    pub(super) last: [S; 2],
    /// Side of a cell, m.
    pub(super) cell: S,
    /// Half the side of a point's domain at the start.
    pub(super) half_length: HalfLength<S>,
    /// Whether the points' domains follow their stretch.
    pub(super) stretch: bool,
}

impl<S: Lanes> GridLanes<S> {
    #[inline(always)]
    /// For points that touch no other nodes than those of these rows.
    pub(super) fn new(grid: &Grid, rows: &Range<usize>, half_length: f64, stretch: bool) -> Self {
        let between = |low: usize, high: usize| [S::splat(low as f64), S::splat(high as f64)];
        GridLanes {
            origin: [S::splat(grid.origin_m[0]), S::splat(grid.origin_m[1])],
            inverse_cell: S::splat(1.0 / grid.cell_m),
            stride: S::splat(grid.nodes[0] as f64),
            first: S::splat((rows.start * grid.nodes[0]) as f64),
            nearest: [between(1, grid.nodes[0] - 2), between(rows.start + 1, rows.end - 2)],
            corner: [between(0, grid.nodes[0] - 2), between(rows.start, rows.end - 2)],
            last: [S::splat((grid.nodes[0] - 2) as f64), S::splat((grid.nodes[1] - 2) as f64)],
            cell: S::splat(grid.cell_m),
            half_length: HalfLength::new(S::splat(half_length)),
            stretch,
        }
    }

    /// Cell coordinates of eight points.
    #[inline(always)]
    pub(super) fn coordinates(&self, x: &V8, y: &V8) -> [S; 2] {
        [(S::load(x) - self.origin[0]) * self.inverse_cell, (S::load(y) - self.origin[1]) * self.inverse_cell]
    }

    /// Cells of eight points, clamped into the grid.
    #[inline(always)]
    pub(super) fn cells(&self, coordinates: [S; 2]) -> [usize; 8] {
        let [i, j] = self.corners(coordinates);
        (j.mul_add(self.stride, i) - self.first).indices()
    }

    /// Cell coordinates of the lower left corners of the cells of eight points, clamped into the grid.
    #[inline(always)]
    fn corners(&self, coordinates: [S; 2]) -> [S; 2] {
        let ([x, y], [along_x, along_y]) = (coordinates, self.corner);
        [x.max(along_x[0]).min(along_x[1]).floor(), y.max(along_y[0]).min(along_y[1]).floor()]
    }

    /// Positions of eight points from the middles of their cells, m.
    #[inline(always)]
    pub(super) fn offsets_in_cells(&self, coordinates: [S; 2]) -> [S; 2] {
        let ([x, y], [i, j], half) = (coordinates, self.corners(coordinates), S::splat(0.5));
        [(x - i - half) * self.cell, (y - j - half) * self.cell]
    }
}
