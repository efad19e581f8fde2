//! Pore pressure: storage, relaxation to the cell's mean, cavitation.
//!
//! Water that cavitates pulls no more than the largest suction. What a point carries on is the pressure without that limit:
//! below it, a measure of the void that must close before the pressure rises again. Cutting the carried pressure itself
//! would forget the void, and every ringing of the pressure would pump its mean up, the more the stiffer the water.
//!
//! Dp/Dt = -(K_w / n) [(1 - n) div v + n div w] with incompressible grains (Biot coefficient 1), the convective term
//! (w - v) . grad n left out (Zabala & Alonso 2011; Bandara & Soga 2015).

use super::lanes::Lanes;

/// Constants of the pore water.
#[derive(Debug, Clone, Copy)]
pub(super) struct PoreWater {
    /// Bulk modulus, Pa.
    pub(super) bulk: f64,
    /// Share by which a point's pressure moves to its cell's mean in this step.
    pub(super) relaxation: f64,
    /// Largest suction, Pa.
    pub(super) cavitation: f64,
}

/// Guards the division by the volume of the padding's points, which is zero, m2.
const SMALLEST_VOLUME_M2: f64 = 1e-300;

/// Porosity of points with `volume` of which `grains` is solid.
#[inline(always)]
pub(super) fn porosity<S: Lanes>(volume: S, grains: S) -> S {
    S::splat(1.0) - grains / volume.max(S::splat(SMALLEST_VOLUME_M2))
}

/// Divergence of the pore fluid's flow in a step: (1 - n) div v + n div w, times the step.
#[inline(always)]
pub(super) fn inflow<S: Lanes>(porosity: S, skeleton_divergence: S, water_divergence: S) -> S {
    porosity.mul_add(water_divergence, (S::splat(1.0) - porosity) * skeleton_divergence)
}

/// New carried pore pressure from the step's inflow and what relaxation tends to.
#[inline(always)]
pub(super) fn pressure<S: Lanes>(water: &PoreWater, porosity: S, pressure: S, target: S, inflow: S) -> S {
    let relaxed = S::splat(water.relaxation).mul_add(target - pressure, pressure);
    let stiffness = S::splat(water.bulk) / porosity;
    (-stiffness).mul_add(inflow, relaxed)
}

/// The part of a carried pressure that acts.
#[inline(always)]
pub(super) fn acting<S: Lanes>(water: &PoreWater, pressure: S) -> S {
    pressure.max(S::splat(-water.cavitation))
}
