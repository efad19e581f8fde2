//! Grid: the momentum balance at the nodes, boundary conditions, and the velocities of the second scatter.
//!
//! Two phases couple by Darcy drag, taken implicitly at each node: with M skeleton mass, m water mass, D = dt times
//! the drag coefficient, and r the momenta after the other forces,
//!
//! [M + D, -D; -D, m + D] [v; w] = [r_v; r_w],
//!
//! symmetric, momentum conserving and stable for any permeability (the explicit limit is
//! 2 k (1 - n) rho_s / (n g rho_sat); Mieremet et al. 2016). The water's balance is the one not weighted with the
//! porosity, multiplied by the node's mean porosity: where porosity varies no force p grad n appears.

use super::nodes::Nodes;
use std::ops::Range;

/// A node with less than this share of a cell's mass is left alone: its sums are round-off. Near the edge of a shape
/// function S falls with the square of the distance and its gradient with the distance, so that the force left out is
/// of the order of the square root of this share: 1e-13.
const SMALLEST_MASS_SHARE: f64 = 1e-26;

/// With a closed ground surface, a node with less than this share of its full volume is at the surface: half way
/// between a flat surface (1/2) and the inside (1).
const SURFACE_FILL: f64 = 0.75;

/// Constants of the momentum balance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Balance {
    /// Gravity vector, m/s2.
    pub(super) gravity: [f64; 2],
    /// Local damping, share of the unbalanced force.
    pub(super) damping: f64,
    /// Gravity over hydraulic conductivity, 1/s: drag per mass of water and relative velocity.
    pub(super) drag_rate: f64,
    /// Density of the water, kg/m3.
    pub(super) water_density: f64,
    /// Mass of a full cell, kg/m.
    pub(super) cell_mass: f64,
    /// Whether water cannot pass the ground surface.
    pub(super) closed_surface: bool,
}

/// Local damping (Cundall 1987): takes a share of the unbalanced force, against the velocity. The change of
/// velocity in the step stands for the unbalanced force, drag included.
#[inline(always)]
fn damp(change: f64, velocity: f64, share: f64) -> f64 {
    let direction = if velocity > 0.0 {
        1.0
    } else if velocity < 0.0 {
        -1.0
    } else {
        0.0
    };
    change - share * change.abs() * direction
}

/// Solves the balance at every node; leaves changes and new velocities in `rates`, and `velocities` zeroed.
#[inline(always)]
pub(super) fn accelerate<const TWO: bool>(nodes: &mut Nodes, balance: &Balance, dt: f64) {
    let smallest = SMALLEST_MASS_SHARE * balance.cell_mass;
    for span in 0..nodes.spans.len() {
        let Range { start, end } = nodes.spans[span].clone();
        let rows = nodes.sums[start..end]
            .iter()
            .zip(&mut nodes.forces[start..end])
            .zip(&mut nodes.rates[start..end])
            .zip(&mut nodes.velocities[start..end])
            .zip(&nodes.free[start..end])
            .zip(&nodes.full_volume[start..end])
            .zip(&nodes.friction[start..end]);
        for ((((((sums, forces), rates), velocities), free), &full), &friction) in rows {
            velocities.0 = [0.0; 8];
            if sums.0[0] <= smallest {
                forces.0 = [0.0; 8];
                rates.0 = [0.0; 8];
                continue;
            }
            rates.0 = if TWO {
                let closed = balance.closed_surface && sums.0[6] < SURFACE_FILL * full;
                let solved = two_phases(&sums.0, &forces.0, free, balance, closed, dt);
                forces.0 = [0.0; 8];
                solved
            } else {
                one_phase(&sums.0, free, friction, balance, dt)
            };
        }
    }
}

#[inline(always)]
fn one_phase(
    sums: &[f64; 8],
    free: &[f64; 4],
    friction: Option<f64>,
    balance: &Balance,
    dt: f64,
) -> [f64; 8] {
    let inverse = 1.0 / sums[0];
    let mut rates = [0.0; 8];
    for axis in 0..2 {
        let arriving = sums[2 + axis] * inverse;
        let force = (sums[4 + axis] + sums[6 + axis]) * inverse + balance.gravity[axis];
        let change = damp(dt * force, arriving, balance.damping);
        rates[axis] = change * free[axis];
        rates[4 + axis] = (arriving + change) * free[axis];
    }
    if let Some(coefficient) = friction {
        touch_down(&mut rates, coefficient);
    }
    rates
}

/// Contact with the bottom wall where the node moves into it: the normal velocity is taken away, and of the
/// tangential one up to `coefficient` times as much (Coulomb). A node that moves off is free.
#[inline(always)]
fn touch_down(rates: &mut [f64; 8], coefficient: f64) {
    let (sliding, normal) = (rates[4], rates[5]);
    if normal >= 0.0 {
        return;
    }
    let kept = (sliding.abs() + coefficient * normal).max(0.0);
    let slowed = if sliding < 0.0 { -kept } else { kept };
    rates[0] += slowed - sliding;
    rates[1] -= normal;
    rates[4] = slowed;
    rates[5] = 0.0;
}

#[inline(always)]
fn two_phases(
    sums: &[f64; 8],
    forces: &[f64; 8],
    free: &[f64; 4],
    balance: &Balance,
    closed: bool,
    dt: f64,
) -> [f64; 8] {
    let (skeleton, water) = (sums[0], sums[1]);
    let porosity = water / (balance.water_density * sums[6]);
    let both = skeleton + water;
    let drag = dt * balance.drag_rate * porosity * water;
    let inverse = 1.0 / (skeleton * water + drag * both);
    let (inverse_skeleton, inverse_water, inverse_both) = (1.0 / skeleton, 1.0 / water, 1.0 / both);
    let mut rates = [0.0; 8];
    for axis in 0..2 {
        let v = sums[2 + axis] * inverse_skeleton;
        let w = sums[4 + axis] * inverse_water;
        let on_water = porosity * (forces[2 + axis] + forces[6 + axis]);
        let on_skeleton = forces[axis] + forces[4 + axis] - on_water;
        let r_v = sums[2 + axis] + dt * (on_skeleton + skeleton * balance.gravity[axis]);
        let r_w = sums[4 + axis] + dt * (on_water + water * balance.gravity[axis]);
        let (new_v, new_w) = if closed {
            let together = (r_v + r_w) * inverse_both;
            (together, together)
        } else {
            (((water + drag) * r_v + drag * r_w) * inverse, (drag * r_v + (skeleton + drag) * r_w) * inverse)
        };
        let change_v = damp(new_v - v, v, balance.damping);
        let change_w = damp(new_w - w, w, balance.damping);
        rates[axis] = change_v * free[axis];
        rates[2 + axis] = change_w * free[2 + axis];
        rates[4 + axis] = (v + change_v) * free[axis];
        rates[6 + axis] = (w + change_w) * free[2 + axis];
    }
    rates
}

/// Turns the momenta of the second scatter into velocities, twice in a row; leaves `sums` zeroed.
#[inline(always)]
pub(super) fn velocities<const TWO: bool>(nodes: &mut Nodes, balance: &Balance) {
    let smallest = SMALLEST_MASS_SHARE * balance.cell_mass;
    for span in 0..nodes.spans.len() {
        let Range { start, end } = nodes.spans[span].clone();
        let rows = nodes.sums[start..end]
            .iter_mut()
            .zip(&mut nodes.velocities[start..end])
            .zip(&mut nodes.cells[start..end])
            .zip(&nodes.free[start..end])
            .zip(&nodes.friction[start..end])
            .zip(&nodes.rates[start..end]);
        for (((((sums, velocities), cell), free), friction), rates) in rows {
            cell.0 = [0.0; 8];
            let [skeleton, water, ..] = sums.0;
            sums.0 = [0.0; 8];
            if skeleton <= smallest {
                velocities.0 = [0.0; 8];
                continue;
            }
            let inverse = 1.0 / skeleton;
            let inverse_water = if TWO { 1.0 / water } else { 0.0 };
            let p = velocities.0;
            let mut v = [
                p[0] * inverse * free[0],
                p[1] * inverse * free[1],
                p[2] * inverse_water * free[2],
                p[3] * inverse_water * free[3],
            ];
            if friction.is_some() {
                v[1] = v[1].max(0.0);
                // A node that sticks does so for the strains as well.
                if rates.0[4] == 0.0 && rates.0[5] == 0.0 {
                    v[0] = 0.0;
                }
            }
            velocities.0 = [v[0], v[1], v[2], v[3], v[0], v[1], v[2], v[3]];
        }
    }
}
