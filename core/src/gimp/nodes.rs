//! What the grid's nodes and cells hold during a step: one cache line each.

use super::grid::Grid;
use super::lanes::V8;
use super::setup::{Conditions, Support};
use std::ops::Range;

/// Nodes and cells. Outside `spans` every row of sums is zero.
#[derive(Debug, Clone)]
pub(super) struct Nodes {
    /// First scatter. One phase: mass, -, momentum x and y, internal force from gradients along x (2) and y (2).
    /// Two phases: masses of skeleton and water, momenta of skeleton (2) and water (2), volume, -.
    pub(super) sums: Vec<V8>,
    /// Two phases: internal forces from gradients along x, then y: on the mixture (2), on the water (2).
    pub(super) forces: Vec<V8>,
    /// Changes of velocity of skeleton (2) and water (2), then their new velocities (4).
    pub(super) rates: Vec<V8>,
    /// Second scatter: momenta of skeleton (2) and water (2); then velocities, twice.
    pub(super) velocities: Vec<V8>,
    /// Sums over a cell's points, then means weighted with volume: volume, volumetric strain increment of the
    /// skeleton, of the water, pore pressure. The cell's index is that of its lower left node.
    pub(super) cells: Vec<V8>,
    /// What is kept of a node's velocity: 0 where it is held; skeleton (2), water (2).
    pub(super) free: Vec<[f64; 4]>,
    /// Volume of a node all of whose cells between the walls are full, m2.
    pub(super) full_volume: Vec<f64>,
    /// Coulomb coefficient of the base that a node lies on.
    pub(super) friction: Vec<Option<f64>>,
    /// Nodes that points may reach before the next sort, per grid row.
    pub(super) spans: Vec<Range<usize>>,
}

impl Nodes {
    pub(super) fn new(grid: &Grid, conditions: &Conditions) -> Nodes {
        let count = grid.node_count();
        let mut nodes = Nodes {
            sums: vec![V8::ZERO; count],
            forces: vec![V8::ZERO; count],
            rates: vec![V8::ZERO; count],
            velocities: vec![V8::ZERO; count],
            cells: vec![V8::ZERO; count],
            free: vec![[1.0; 4]; count],
            full_volume: vec![0.0; count],
            friction: vec![None; count],
            spans: Vec::with_capacity(grid.nodes[1]),
        };
        let [nx, ny] = grid.nodes;
        for j in 0..ny {
            for i in 0..nx {
                let k = j * nx + i;
                nodes.full_volume[k] = grid.cell_m * grid.cell_m * grid.share_inside(i, j);
                let sides = [
                    (i <= 1, conditions.left, 0),
                    (i + 2 >= nx, conditions.right, 0),
                    (j <= 1, conditions.bottom, 1),
                    (j + 2 >= ny, conditions.top, 1),
                ];
                for (_, support, normal) in sides.into_iter().filter(|side| side.0) {
                    nodes.hold(k, support, normal);
                }
            }
        }
        nodes
    }

    /// Holds node `k` on a wall whose normal is axis `normal`, skeleton and water alike.
    fn hold(&mut self, k: usize, support: Support, normal: usize) {
        match support {
            Support::Open => {}
            Support::Roller => {
                self.free[k][normal] = 0.0;
                self.free[k][normal + 2] = 0.0;
            }
            Support::Fixed => self.free[k] = [0.0; 4],
            Support::Friction(coefficient) => self.friction[k] = Some(coefficient),
        }
    }

    /// Zeroes all sums and takes over new spans.
    pub(super) fn clear(&mut self) {
        for rows in [&mut self.sums, &mut self.forces, &mut self.rates, &mut self.velocities, &mut self.cells]
        {
            rows.fill(V8::ZERO);
        }
    }
}
