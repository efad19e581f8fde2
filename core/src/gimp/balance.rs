//! The momentum balance of eight nodes at a time, before walls have their say.
//!
//! Two phases couple by Darcy drag, taken implicitly at each node: with M skeleton mass, m water mass, D = dt times
//! the drag coefficient, and r the momenta after the other forces,
//!
//! [M + D, -D; -D, m + D] [v; w] = [r_v; r_w],
//!
//! symmetric, momentum conserving and stable for any permeability (the explicit limit is
//! 2 k (1 - n) rho_s / (n g rho_sat); Mieremet et al. 2016). The water's balance is the one not weighted with the
//! porosity, multiplied by the node's mean porosity: where porosity varies no force p grad n appears.

use super::lanes::{Lanes, V8};

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

/// The sums at eight nodes, lane by lane (see [`super::nodes::Nodes`]).
pub(super) struct Sums<S> {
    pub(super) sums: [S; 8],
    /// Only in two phases.
    pub(super) forces: [S; 8],
    /// Only where points carry loads.
    pub(super) loads: Option<[S; 8]>,
    /// Volumes of nodes that are full, m2; only with a closed ground surface.
    pub(super) full_volume: Option<V8>,
}

/// The balance of eight nodes solved, and what is needed to hold them at walls and to account for the work.
pub(super) struct Solved<S> {
    /// Changes of velocity of skeleton (2) and water (2), then the velocities they lead to.
    pub(super) rates: [S; 8],
    /// Masses of skeleton and water.
    pub(super) mass: [S; 2],
    /// Along each axis, the impulse of the effective reaction of a wall that lets nothing pass, its normal along the axis.
    pub(super) push: [S; 2],
    /// Change of the velocities of skeleton and water by an impulse on the skeleton, drag included.
    pub(super) answer: [S; 2],
    /// Impulses whose work counts, per axis.
    pub(super) impulses: [Impulses<S>; 2],
}

/// Impulses on nodes along one axis: on skeleton and water; that of drag on the skeleton.
#[derive(Clone, Copy)]
pub(super) struct Impulses<S> {
    pub(super) outer: [S; 2],
    pub(super) drag: S,
    pub(super) damping: [S; 2],
}

/// Change of a velocity after damping: local damping (Cundall 1987) takes a share of the unbalanced force, against the
/// velocity, for which the change of velocity in the step, drag included, stands; then velocities decay at a rate.
#[inline(always)]
fn damp<S: Lanes>(change: S, velocity: S, balance: &Balance) -> S {
    if balance.damping == 0.0 && balance.decay == 0.0 {
        return change;
    }
    let zero = S::splat(0.0);
    let size = change.max(-change);
    let against = S::select(velocity.gt(zero), size, S::select(zero.gt(velocity), -size, zero));
    let change = change - S::splat(balance.damping) * against;
    change - S::splat(balance.decay) * (velocity + change)
}

/// One phase: everything moves with the skeleton.
#[inline(always)]
pub(super) fn one_phase<S: Lanes>(node: &Sums<S>, balance: &Balance, dt: S) -> Solved<S> {
    let (zero, sums) = (S::splat(0.0), &node.sums);
    let mass = sums[0];
    let inverse = S::splat(1.0) / mass;
    let mut rates = [zero; 8];
    let mut push = [zero; 2];
    let mut impulses = [Impulses { outer: [zero; 2], drag: zero, damping: [zero; 2] }; 2];
    for axis in 0..2 {
        let arriving = sums[2 + axis] * inverse;
        let weight = mass * S::splat(balance.gravity[axis]);
        let outer = match &node.loads {
            Some(loads) => weight + loads[1 + axis],
            None => weight,
        };
        let undamped = dt * (sums[4 + axis] + sums[6 + axis] + outer) * inverse;
        let change = damp(undamped, arriving, balance);
        rates[axis] = change;
        rates[4 + axis] = arriving + change;
        push[axis] = -(mass * rates[4 + axis]);
        impulses[axis].outer[0] = dt * outer;
        impulses[axis].damping[0] = mass * (undamped - change);
    }
    Solved { rates, mass: [mass, zero], push, answer: [inverse, zero], impulses }
}

/// Skeleton and water.
#[inline(always)]
pub(super) fn two_phases<S: Lanes>(node: &Sums<S>, balance: &Balance, dt: S) -> Solved<S> {
    let (zero, one) = (S::splat(0.0), S::splat(1.0));
    let Sums { sums, forces, loads, full_volume } = node;
    let (skeleton, water) = (sums[0], sums[1]);
    let both = skeleton + water;
    let porosity = water / (S::splat(balance.water_density) * sums[6]);
    let drag = match loads {
        Some(loads) => dt * loads[0],
        None => dt * S::splat(balance.drag_rate) * porosity * water,
    };
    let inverse = one / (skeleton * water + drag * both);
    let (inverse_skeleton, inverse_water) = (one / skeleton, one / water);
    let mut answer = [(water + drag) * inverse, drag * inverse];
    let water_answer = (skeleton + drag) * inverse;
    let closed = full_volume.as_ref().map(|full| {
        let together = one / both;
        ((S::load(full) * S::splat(SURFACE_FILL)).gt(sums[6]), together)
    });
    if let Some((closed, together)) = closed {
        answer = [S::select(closed, together, answer[0]), S::select(closed, together, answer[1])];
    }
    let mut rates = [zero; 8];
    let mut push = [zero; 2];
    let mut impulses = [Impulses { outer: [zero; 2], drag: zero, damping: [zero; 2] }; 2];
    for axis in 0..2 {
        let v = sums[2 + axis] * inverse_skeleton;
        let w = sums[4 + axis] * inverse_water;
        let on_water = porosity * (forces[2 + axis] + forces[6 + axis]);
        let on_skeleton = forces[axis] + forces[4 + axis] - on_water;
        let gravity = S::splat(balance.gravity[axis]);
        let mut outer_water = S::splat(balance.water_weight) * (water * gravity);
        let mut outer_mixture = both * gravity;
        if let Some(loads) = loads {
            outer_water = outer_water + loads[3 + axis];
            outer_mixture = outer_mixture + loads[1 + axis];
        }
        let outer_skeleton = outer_mixture - outer_water;
        let r_v = dt.mul_add(on_skeleton + outer_skeleton, sums[2 + axis]);
        let r_w = dt.mul_add(on_water + outer_water, sums[4 + axis]);
        let mut new_v = answer[0] * r_v + answer[1] * r_w;
        let mut new_w = answer[1] * r_v + water_answer * r_w;
        if let Some((closed, together)) = closed {
            let joint = (r_v + r_w) * together;
            new_v = S::select(closed, joint, new_v);
            new_w = S::select(closed, joint, new_w);
        }
        let change_v = damp(new_v - v, v, balance);
        let change_w = damp(new_w - w, w, balance);
        rates[axis] = change_v;
        rates[2 + axis] = change_w;
        rates[4 + axis] = v + change_v;
        rates[6 + axis] = w + change_w;
        // Friction sees the effective stress: the wall's whole reaction less that of pore water in the whole volume.
        push[axis] = r_w * (one - porosity) / porosity - r_v;
        impulses[axis] = Impulses {
            outer: [dt * outer_skeleton, dt * outer_water],
            drag: skeleton * new_v - r_v,
            damping: [skeleton * (new_v - v - change_v), water * (new_w - w - change_w)],
        };
    }
    Solved { rates, mass: [skeleton, water], push, answer, impulses }
}
