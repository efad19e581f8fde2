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

use super::contact::{Contact, Touching, hold_off, touch};
use super::lanes::V8;
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
    /// Share of the water's weight that acts on the water; the skeleton carries the rest. Where points differ this
    /// is 1 and the loads say how.
    pub(super) water_weight: f64,
    /// Local damping, share of the unbalanced force.
    pub(super) damping: f64,
    /// What a step's decay at the damping rate takes of a velocity, as a share.
    pub(super) decay: f64,
    /// Gravity over hydraulic conductivity, 1/s: drag per mass of water and relative velocity; unused with loads.
    pub(super) drag_rate: f64,
    /// Density of the water, kg/m3.
    pub(super) water_density: f64,
    /// Mass of a full cell, kg/m.
    pub(super) cell_mass: f64,
    /// Whether water cannot pass the ground surface.
    pub(super) closed_surface: bool,
}

/// Work at the nodes in one step, J per m of width.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct NodeWork {
    /// Done by weight, buoyancy and external forces.
    pub(super) outer: f64,
    /// Taken by Darcy drag.
    pub(super) drag: f64,
    /// Taken by local damping and by the decay of velocities.
    pub(super) damping: f64,
    /// Taken by friction and impact at frictional walls.
    pub(super) contact: f64,
}

/// What is known of one node before its balance is solved.
struct Node<'a> {
    sums: &'a [f64; 8],
    forces: &'a [f64; 8],
    loads: Option<&'a [f64; 8]>,
    free: &'a [f64; 4],
    contact: Option<Contact>,
    closed: bool,
}

/// Impulses on one node along one axis whose work counts: on skeleton and water; that of drag on the skeleton.
#[derive(Clone, Copy, Default)]
struct Impulses {
    outer: [f64; 2],
    drag: f64,
    damping: [f64; 2],
}

/// Mean of component `i` of a node's velocities before and after the step, walls included.
#[inline(always)]
fn mean_velocity(rates: &[f64; 8], i: usize) -> f64 {
    rates[4 + i] - 0.5 * rates[i]
}

/// Change of a velocity after damping: local damping (Cundall 1987) takes a share of the unbalanced force, against the
/// velocity, for which the change of velocity in the step, drag included, stands; then velocities decay at a rate.
#[inline(always)]
fn damp(change: f64, velocity: f64, balance: &Balance) -> f64 {
    let direction = if velocity > 0.0 {
        1.0
    } else if velocity < 0.0 {
        -1.0
    } else {
        0.0
    };
    let change = change - balance.damping * change.abs() * direction;
    change - balance.decay * (velocity + change)
}

/// Solves the balance at every node; leaves changes and new velocities in `rates`, and `velocities` zeroed.
#[inline(always)]
pub(super) fn accelerate<const TWO: bool, const EXTRA: bool>(
    nodes: &mut Nodes,
    balance: &Balance,
    dt: f64,
) -> NodeWork {
    let smallest = SMALLEST_MASS_SHARE * balance.cell_mass;
    let mut work = NodeWork::default();
    let Nodes { sums, forces, rates, velocities, loads, free, full_volume, contact, spans, .. } = nodes;
    for Range { start, end } in spans.iter().cloned() {
        for k in start..end {
            velocities[k] = V8::ZERO;
            if sums[k].0[0] <= smallest {
                rates[k] = V8::ZERO;
            } else {
                let closed = TWO && balance.closed_surface && sums[k].0[6] < SURFACE_FILL * full_volume[k];
                let node = Node {
                    sums: &sums[k].0,
                    forces: &forces[k].0,
                    loads: loads.get(k).filter(|_| EXTRA).map(|row| &row.0),
                    free: &free[k],
                    contact: contact[k],
                    closed,
                };
                rates[k].0 = if TWO {
                    two_phases(&node, balance, dt, &mut work)
                } else {
                    one_phase(&node, balance, dt, &mut work)
                };
            }
            if TWO {
                forces[k] = V8::ZERO;
            }
            if let Some(row) = loads.get_mut(k).filter(|_| EXTRA) {
                *row = V8::ZERO;
            }
        }
    }
    work
}

#[inline(always)]
fn one_phase(node: &Node<'_>, balance: &Balance, dt: f64, work: &mut NodeWork) -> [f64; 8] {
    let Node { sums, free, .. } = node;
    let mass = sums[0];
    let inverse = 1.0 / mass;
    let mut rates = [0.0; 8];
    let mut impulses = [[0.0; 2]; 2];
    for axis in 0..2 {
        let arriving = sums[2 + axis] * inverse;
        let outer = mass * balance.gravity[axis] + node.loads.map_or(0.0, |l| l[1 + axis]);
        let undamped = dt * (sums[4 + axis] + sums[6 + axis] + outer) * inverse;
        let change = damp(undamped, arriving, balance);
        rates[axis] = change * free[axis];
        rates[4 + axis] = (arriving + change) * free[axis];
        impulses[axis] = [dt * outer, mass * (undamped - change)];
    }
    if let Some(contact) = node.contact {
        let push = -mass * rates[4 + contact.axis] * contact.inward;
        work.contact +=
            touch(&mut rates, contact, &Touching { mass: [mass, 0.0], push, answer: [inverse, 0.0] });
    }
    for (axis, [outer, damping]) in impulses.into_iter().enumerate() {
        work.outer += outer * mean_velocity(&rates, axis);
        work.damping += damping * mean_velocity(&rates, axis);
    }
    rates
}

#[inline(always)]
fn two_phases(node: &Node<'_>, balance: &Balance, dt: f64, work: &mut NodeWork) -> [f64; 8] {
    let Node { sums, forces, free, .. } = node;
    let (skeleton, water) = (sums[0], sums[1]);
    let porosity = water / (balance.water_density * sums[6]);
    let both = skeleton + water;
    let drag = dt * node.loads.map_or(balance.drag_rate * porosity * water, |l| l[0]);
    let inverse = 1.0 / (skeleton * water + drag * both);
    let (inverse_skeleton, inverse_water, inverse_both) = (1.0 / skeleton, 1.0 / water, 1.0 / both);
    let mut rates = [0.0; 8];
    let mut arrived = [[0.0; 2]; 2];
    let mut impulses = [Impulses::default(); 2];
    for axis in 0..2 {
        let v = sums[2 + axis] * inverse_skeleton;
        let w = sums[4 + axis] * inverse_water;
        let on_water = porosity * (forces[2 + axis] + forces[6 + axis]);
        let on_skeleton = forces[axis] + forces[4 + axis] - on_water;
        let (extra_mixture, extra_water) = node.loads.map_or((0.0, 0.0), |l| (l[1 + axis], l[3 + axis]));
        let outer_water = balance.water_weight * (water * balance.gravity[axis]) + extra_water;
        let outer_skeleton = both * balance.gravity[axis] + extra_mixture - outer_water;
        let r_v = sums[2 + axis] + dt * (on_skeleton + outer_skeleton);
        let r_w = sums[4 + axis] + dt * (on_water + outer_water);
        let (new_v, new_w) = if node.closed {
            let together = (r_v + r_w) * inverse_both;
            (together, together)
        } else {
            (((water + drag) * r_v + drag * r_w) * inverse, (drag * r_v + (skeleton + drag) * r_w) * inverse)
        };
        let change_v = damp(new_v - v, v, balance);
        let change_w = damp(new_w - w, w, balance);
        rates[axis] = change_v * free[axis];
        rates[2 + axis] = change_w * free[2 + axis];
        rates[4 + axis] = (v + change_v) * free[axis];
        rates[6 + axis] = (w + change_w) * free[2 + axis];
        arrived[axis] = [r_v, r_w];
        impulses[axis] = Impulses {
            outer: [dt * outer_skeleton, dt * outer_water],
            drag: skeleton * new_v - r_v,
            damping: [skeleton * (new_v - v - change_v), water * (new_w - w - change_w)],
        };
    }
    if let Some(contact) = node.contact {
        // Friction sees the effective stress: the wall's whole reaction less that of pore water in the whole volume.
        let [r_v, r_w] = arrived[contact.axis];
        let push = (r_w * (1.0 - porosity) / porosity - r_v) * contact.inward;
        let answer = if node.closed {
            [inverse_both, inverse_both]
        } else {
            [(water + drag) * inverse, drag * inverse]
        };
        work.contact += touch(&mut rates, contact, &Touching { mass: [skeleton, water], push, answer });
    }
    for (axis, impulses) in impulses.iter().enumerate() {
        let [v, w] = [mean_velocity(&rates, axis), mean_velocity(&rates, 2 + axis)];
        work.outer += impulses.outer[0] * v + impulses.outer[1] * w;
        work.drag += impulses.drag * (w - v);
        work.damping += impulses.damping[0] * v + impulses.damping[1] * w;
    }
    rates
}

/// Turns the momenta of the filter's scatter into velocities; the masses are those of the first scatter.
#[inline(always)]
pub(super) fn filtered_velocities<const TWO: bool>(nodes: &mut Nodes, balance: &Balance) {
    let smallest = SMALLEST_MASS_SHARE * balance.cell_mass;
    let Nodes { sums, filtered, free, spans, .. } = nodes;
    for Range { start, end } in spans.iter().cloned() {
        for k in start..end {
            let [skeleton, water, ..] = sums[k].0;
            let inverse = if skeleton > smallest { 1.0 / skeleton } else { 0.0 };
            let inverse_water = if TWO && skeleton > smallest { 1.0 / water } else { 0.0 };
            for axis in 0..2 {
                filtered[k].0[axis] *= inverse * free[k][axis];
                filtered[k].0[2 + axis] *= inverse_water * free[k][2 + axis];
            }
        }
    }
}

/// Turns the momenta of the second scatter into velocities, twice in a row; leaves `sums` zeroed.
#[inline(always)]
pub(super) fn velocities<const TWO: bool>(nodes: &mut Nodes, balance: &Balance) {
    let smallest = SMALLEST_MASS_SHARE * balance.cell_mass;
    let Nodes { sums, rates, velocities, cells, filtered, free, contact, spans, .. } = nodes;
    for Range { start, end } in spans.iter().cloned() {
        for k in start..end {
            cells[k] = V8::ZERO;
            let [skeleton, water, ..] = sums[k].0;
            sums[k] = V8::ZERO;
            if let Some(row) = filtered.get_mut(k) {
                *row = V8::ZERO;
            }
            if skeleton <= smallest {
                velocities[k] = V8::ZERO;
                continue;
            }
            let inverse = 1.0 / skeleton;
            let inverse_water = if TWO { 1.0 / water } else { 0.0 };
            let (p, free) = (velocities[k].0, &free[k]);
            let mut v = [
                p[0] * inverse * free[0],
                p[1] * inverse * free[1],
                p[2] * inverse_water * free[2],
                p[3] * inverse_water * free[3],
            ];
            if let Some(contact) = contact[k] {
                hold_off(&mut v, &rates[k].0, contact);
            }
            velocities[k].0 = [v[0], v[1], v[2], v[3], v[0], v[1], v[2], v[3]];
        }
    }
}
