//! The momentum balance at the nodes, with drag, damping, walls and a closed ground surface.

use super::{Node, Reference};
use runout_core::gimp::{Setup, Support};

/// Share of a cell's mass below which a node is left alone, as in the solver.
const SMALLEST_MASS_SHARE: f64 = 1e-26;

/// A node filled less than this, as a share of what it holds inside the ground, is at the ground surface.
const SURFACE_FILL: f64 = 0.75;

impl Reference {
    /// New velocities at the nodes.
    pub(super) fn balance_momentum(&mut self, dt: f64) {
        let gravity = self.setup.conditions.gravity_m_s2;
        for k in 0..self.nodes.len() {
            let mut node = self.nodes[k].clone();
            if !self.counts(&node) {
                continue;
            }
            let held = self.held(k);
            for a in 0..2 {
                let v = node.momentum[a] / node.mass;
                if !self.two() {
                    let acceleration = node.force[a] / node.mass + gravity[a];
                    let change = self.damp(dt * acceleration, v, dt);
                    (node.change_v[a], node.v[a]) = if held[a] { (0.0, 0.0) } else { (change, v + change) };
                    continue;
                }
                let w = node.water_momentum[a] / node.water_mass;
                let (new_v, new_w) = self.two_phases(&node, k, a, dt);
                let change_v = self.damp(new_v - v, v, dt);
                let change_w = self.damp(new_w - w, w, dt);
                (node.change_v[a], node.v[a]) = if held[a] { (0.0, 0.0) } else { (change_v, v + change_v) };
                (node.change_w[a], node.w[a]) = if held[a] { (0.0, 0.0) } else { (change_w, w + change_w) };
            }
            self.closed += usize::from(self.two() && self.is_closed_surface(&node, k));
            self.nodes[k] = node;
        }
    }

    /// Velocities of skeleton and water along axis `a` after the forces, with Darcy's drag D (w - v), D = n^2 rho_w g V / k,
    /// at its value at the end of the step:
    ///
    /// M (v1 - v0) / dt = f_v + D (w1 - v1), m (w1 - w0) / dt = f_w - D (w1 - v1).
    fn two_phases(&self, node: &Node, k: usize, a: usize, dt: f64) -> (f64, f64) {
        let Setup { fluid, conditions, materials, .. } = &self.setup;
        let (mass, water_mass) = (node.mass, node.water_mass);
        let porosity = water_mass / (fluid.density_kg_m3 * node.volume);
        let weight = (mass + water_mass) * conditions.gravity_m_s2[a];
        let water_weight = self.water_weight() * water_mass * conditions.gravity_m_s2[a];
        let on_water = porosity * node.water_force[a] + water_weight;
        let on_skeleton = node.force[a] + weight - on_water;
        // Momenta after all forces but drag.
        let p = node.momentum[a] + dt * on_skeleton;
        let q = node.water_momentum[a] + dt * on_water;
        if self.is_closed_surface(node, k) {
            let together = (p + q) / (mass + water_mass);
            return (together, together);
        }
        let drag = dt * porosity * water_mass * fluid.gravity_m_s2 / materials[0].permeability_m_s;
        // The momentum of both stays, their difference of velocity decays.
        let difference = (q / water_mass - p / mass) / (1.0 + drag * (1.0 / mass + 1.0 / water_mass));
        let v = (p + q - water_mass * difference) / (mass + water_mass);
        (v, v + difference)
    }

    /// Change of a velocity after local damping, which takes a share of the force against the velocity (Cundall 1987), and
    /// after the decay of all velocities.
    fn damp(&self, change: f64, velocity: f64, dt: f64) -> f64 {
        let controls = &self.setup.controls;
        let sign = if velocity == 0.0 { 0.0 } else { velocity.signum() };
        let change = change - controls.local_damping * change.abs() * sign;
        change - Self::share(controls.damping_rate_per_s, dt) * (velocity + change)
    }

    /// Whether a node has any mass to speak of.
    pub(super) fn counts(&self, node: &Node) -> bool {
        let largest_density = self.setup.points.density.iter().copied().fold(0.0, f64::max);
        let h = self.setup.grid.cell_m;
        node.mass > SMALLEST_MASS_SHARE * largest_density * h * h
    }

    /// Which components of the velocities the walls hold at node `k`: the wall itself runs through the second layer of nodes.
    pub(super) fn held(&self, k: usize) -> [bool; 2] {
        let conditions = &self.setup.conditions;
        let [nx, ny] = self.setup.grid.nodes;
        let (i, j) = (k % nx, k / nx);
        let mut held = [false; 2];
        for (at_wall, support, normal) in [
            (i <= 1, conditions.left, 0),
            (i >= nx - 2, conditions.right, 0),
            (j <= 1, conditions.bottom, 1),
            (j >= ny - 2, conditions.top, 1),
        ] {
            match support {
                _ if !at_wall => {}
                Support::Open => {}
                Support::Roller => held[normal] = true,
                Support::Fixed => held = [true; 2],
                Support::Friction(_) => panic!("the reference has no frictional walls"),
            }
        }
        held
    }

    /// Whether water cannot pass node `k` because it lies at a closed ground surface.
    fn is_closed_surface(&self, node: &Node, k: usize) -> bool {
        let grid = &self.setup.grid;
        let cells_inside = |i: usize, n: usize| match i {
            0 => 0.0,
            _ if i == n - 1 => 0.0,
            1 => 0.5,
            _ if i == n - 2 => 0.5,
            _ => 1.0,
        };
        let [nx, ny] = grid.nodes;
        let full = grid.cell_m * grid.cell_m * cells_inside(k % nx, nx) * cells_inside(k / nx, ny);
        self.setup.conditions.closed_surface && node.volume < SURFACE_FILL * full
    }
}
