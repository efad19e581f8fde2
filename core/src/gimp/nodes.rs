//! What the grid's nodes and cells hold during a step: one cache line each.

use super::contact::Contact;
use super::grid::Grid;
use super::lanes::V8;
use super::setup::{Conditions, Obstacle, Support};
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
    /// Loads of single points: drag coefficient (kg/s), forces besides the weights on the mixture (2) and on the
    /// water (2); empty if there are none.
    pub(super) loads: Vec<V8>,
    /// Filtered velocities of skeleton (2) and water (2), or their momenta; empty without that filter.
    pub(super) filtered: Vec<V8>,
    /// Frictional walls that nodes lie on or behind.
    pub(super) contact: Vec<Option<Contact>>,
    /// Whether a wall or an obstacle has its say at a node: where `free` is not 1 or `contact` not absent.
    pub(super) walls: Vec<bool>,
    /// Nodes that points may reach before the next sort, row by row of the grid.
    pub(super) spans: Vec<Range<usize>>,
}

impl Nodes {
    /// The nodes of a grid with its walls and obstacles; `loads` and `filter` say what else they must hold.
    pub(super) fn new(
        grid: &Grid,
        conditions: &Conditions,
        obstacles: &[Obstacle],
        loads: bool,
        filter: bool,
    ) -> Nodes {
        let count = grid.node_count();
        let mut nodes = Nodes {
            sums: vec![V8::ZERO; count],
            forces: vec![V8::ZERO; count],
            rates: vec![V8::ZERO; count],
            velocities: vec![V8::ZERO; count],
            cells: vec![V8::ZERO; count],
            free: vec![[1.0; 4]; count],
            full_volume: vec![0.0; count],
            loads: if loads { vec![V8::ZERO; count] } else { Vec::new() },
            filtered: if filter { vec![V8::ZERO; count] } else { Vec::new() },
            contact: vec![None; count],
            walls: vec![false; count],
            spans: Vec::with_capacity(grid.nodes[1]),
        };
        let [nx, ny] = grid.nodes;
        for j in 0..ny {
            for i in 0..nx {
                let k = j * nx + i;
                nodes.full_volume[k] = grid.cell_m * grid.cell_m * grid.share_inside(i, j);
                let sides = [
                    (i <= 1, conditions.left, 0, 1.0),
                    (i + 2 >= nx, conditions.right, 0, -1.0),
                    (j <= 1, conditions.bottom, 1, 1.0),
                    (j + 2 >= ny, conditions.top, 1, -1.0),
                ];
                for (_, support, normal, inward) in sides.into_iter().filter(|side| side.0) {
                    nodes.hold(k, support, normal, inward);
                }
            }
        }
        for obstacle in obstacles {
            nodes.block(grid, obstacle);
        }
        for (k, wall) in nodes.walls.iter_mut().enumerate() {
            *wall = nodes.free[k] != [1.0; 4] || nodes.contact[k].is_some();
        }
        nodes
    }

    /// Holds the nodes of an obstacle. A node inside follows the nearest side, since points near a wall reach behind it;
    /// where two sides are equally near, at corners, it is fixed.
    fn block(&mut self, grid: &Grid, obstacle: &Obstacle) {
        let place = |axis: usize, at: f64| {
            let node = ((at - grid.origin_m[axis]) / grid.cell_m).round();
            node.clamp(0.0, (grid.nodes[axis] - 1) as f64) as usize
        };
        let [left, right] = obstacle.x_m.map(|x| place(0, x));
        let [bottom, top] = obstacle.y_m.map(|y| place(1, y));
        // An obstacle that stands on the base has no side below, and goes on behind the wall.
        let stands = bottom <= 1;
        for j in if stands { 0 } else { bottom }..=top {
            for i in left..=right {
                let below = if stands { usize::MAX } else { j - bottom };
                let sides = [(i - left, 0, -1.0), (right - i, 0, 1.0), (top - j, 1, 1.0), (below, 1, -1.0)];
                let nearest = sides.iter().map(|side| side.0).min().unwrap_or(0);
                let mut near = sides.into_iter().filter(|side| side.0 == nearest);
                let k = j * grid.nodes[0] + i;
                match (near.next(), near.next()) {
                    (Some((_, normal, inward)), None) => self.hold(k, obstacle.support, normal, inward),
                    _ => self.hold(k, Support::Fixed, 0, 1.0),
                }
            }
        }
    }

    /// Holds node `k` on a wall whose normal is axis `normal`, skeleton and water alike.
    fn hold(&mut self, k: usize, support: Support, normal: usize, inward: f64) {
        match support {
            Support::Open => {}
            Support::Roller => {
                self.free[k][normal] = 0.0;
                self.free[k][normal + 2] = 0.0;
            }
            Support::Fixed => self.free[k] = [0.0; 4],
            Support::Friction(coefficient) => {
                self.contact[k] = Some(Contact { axis: normal, inward, coefficient });
            }
        }
    }

    /// Zeroes all sums: those outside the spans are zero already.
    pub(super) fn clear(&mut self) {
        let Nodes { sums, forces, rates, velocities, cells, loads, filtered, spans, .. } = self;
        for rows in [sums, forces, rates, velocities, cells, loads, filtered] {
            if !rows.is_empty() {
                spans.iter().for_each(|span| rows[span.clone()].fill(V8::ZERO));
            }
        }
    }
}
