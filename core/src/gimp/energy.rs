//! The balance of energy of an analysis.
//!
//! Work of weight, buoyancy and external forces = change of kinetic energy + change of the energy stored in skeleton and
//! pore water + plastic work + drag + friction at walls + damping + drift. Every term but the last is measured where it
//! arises (outer work, drag, friction and damping at the nodes, with the mean of the velocities before and after the
//! step; stress work at the points, with the mean stress), so that the drift is what the scheme makes or loses by
//! itself: between points and grid, in the second scatter of MUSL, and because cell-averaged strains do other work than
//! the forces. (FLIP's transfer to the points loses what MUSL's strains, taken with the velocities at the end of the step,
//! gain: the two are second order in the step and are not told apart.)

use super::advance::{Arena, StepReport};
use super::lanes::{Baseline, Lanes, V8, numbers};
use super::setup::Fluid;
use super::water;
use serde::{Deserialize, Serialize};

/// Energies and work since the start of an analysis, J per metre of width.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Work done by weight, buoyancy and external forces.
    pub outer_work_j: f64,
    /// Change of the kinetic energy of skeleton and water.
    pub kinetic_j: f64,
    /// Change of the elastic energy of the skeleton.
    pub elastic_j: f64,
    /// Change of the energy of the compressed pore water.
    pub pore_water_j: f64,
    /// Plastic work.
    pub plastic_j: f64,
    /// Taken by Darcy drag.
    pub drag_j: f64,
    /// Taken by friction and impact at frictional walls and obstacles.
    pub contact_j: f64,
    /// Taken by local damping, decay of velocities, velocity filter, and the relaxation of pore pressure.
    pub damping_j: f64,
    /// What is missing in the balance: energy lost (positive) or made (negative) by the scheme.
    pub drift_j: f64,
    /// Energy that there was to turn over: kinetic, elastic and pore water energy at the start, and outer work.
    pub available_j: f64,
}

impl Energy {
    /// Drift over the energy that there was to turn over; 0 if there was none.
    pub fn drift(&self) -> f64 {
        if self.available_j > 0.0 { self.drift_j / self.available_j } else { 0.0 }
    }
}

/// Energy held by the points, J per m.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stored {
    kinetic: f64,
    elastic: f64,
    pore_water: f64,
}

/// Work since the start, J per m.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ledger {
    outer: f64,
    drag: f64,
    contact: f64,
    damping: f64,
    stress: f64,
    water: f64,
}

impl Ledger {
    /// Enters a step.
    pub(super) fn enter(&mut self, step: &StepReport) {
        self.outer += step.nodes.outer;
        self.drag += step.nodes.drag;
        self.contact += step.nodes.contact;
        self.damping += step.nodes.damping + step.filtered;
        self.stress += step.stress_work;
        self.water += step.water_work;
    }

    /// The balance between `start` and `now`.
    pub(super) fn balance(&self, start: &Stored, now: &Stored) -> Energy {
        let kinetic_j = now.kinetic - start.kinetic;
        let elastic_j = now.elastic - start.elastic;
        let pore_water_j = now.pore_water - start.pore_water;
        let taken = self.stress + self.water + self.drag + self.contact + self.damping;
        Energy {
            outer_work_j: self.outer,
            kinetic_j,
            elastic_j,
            pore_water_j,
            plastic_j: self.stress - elastic_j,
            drag_j: self.drag,
            contact_j: self.contact,
            damping_j: self.damping + (self.water - pore_water_j),
            drift_j: self.outer - kinetic_j - taken,
            available_j: start.kinetic + start.elastic + start.pore_water + self.outer.max(0.0),
        }
    }
}

/// What the points hold now: kinetic energy; elastic energy tr^2 / (18 K) + s:s / (4 G) per volume with s the deviatoric
/// effective stress; energy n p^2 / (2 K_w) per volume of the compressed water.
pub(super) fn stored(arena: &Arena, fluid: &Fluid, two: bool) -> Stored {
    let mut sum = Stored::default();
    let load = |v: &V8| Baseline::load(v);
    for (i, block) in arena.blocks.iter().enumerate() {
        let porosity = numbers(water::porosity(load(&block.volume), load(&block.grains)));
        let live = if i + 1 == arena.blocks.len() { arena.live_in_last } else { 8 };
        for (q, &porosity) in porosity[..live].iter().enumerate() {
            let at = |v: &V8| v.0[q];
            let volume = at(&block.volume);
            sum.kinetic +=
                0.5 * at(&block.mass) * (at(&block.vx) * at(&block.vx) + at(&block.vy) * at(&block.vy));
            let mean = (at(&block.sxx) + at(&block.syy) + at(&block.szz)) / 3.0;
            let [xx, yy, zz] = [at(&block.sxx) - mean, at(&block.syy) - mean, at(&block.szz) - mean];
            let deviator = xx * xx + yy * yy + zz * zz + 2.0 * at(&block.sxy) * at(&block.sxy);
            sum.elastic +=
                volume * (0.5 * mean * mean / at(&block.bulk) + 0.25 * deviator / at(&block.shear));
            if two {
                let water = (volume - at(&block.grains)) * fluid.density_kg_m3;
                sum.kinetic += 0.5 * water * (at(&block.wx) * at(&block.wx) + at(&block.wy) * at(&block.wy));
                // Beyond the largest suction c the void opens at constant pull: c^2 / 2 + c (|p| - c) for p^2 / 2.
                let pressure = at(&block.pressure);
                let acting = pressure.max(-fluid.cavitation_suction_pa);
                let stored = if acting > pressure { acting * pressure } else { acting * acting }
                    - 0.5 * acting * acting;
                sum.pore_water += volume * porosity * stored / fluid.bulk_modulus_pa;
            }
        }
    }
    sum
}
