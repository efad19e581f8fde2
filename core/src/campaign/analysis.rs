//! Numerical analysis.

use serde::{Deserialize, Serialize};

/// One-phase or two-phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Formulation {
    /// Total unit weight, no water.
    OnePhase,
    /// Skeleton and water, v-w.
    TwoPhase,
}

/// Which volumetric strain increment the stresses see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VolumetricStrain {
    /// The cell's mean (B-bar): avoids locking.
    CellAverage,
    /// Each point's own.
    Point,
}

/// Which part of the point velocities decays at the PIC rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VelocityFilter {
    /// All that the grid does not see: the difference to the grid's velocity (PIC).
    Pic,
    /// The same, filtered twice, so that smooth motion loses less (XPIC(2); Hammerquist & Nairn 2017).
    Xpic,
}

/// How the domains of the points follow the deformation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointDomain {
    /// They keep their size (uGIMP).
    Uniform,
    /// Their sides follow the stretch along the axes, up to one cell (cpGIMP), against numerical fracture.
    Stretched,
}

/// Where the stresses at the start of the failure stage come from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialStress {
    /// From a stage of its own: the elastic, drained ground under its weight, damped to rest.
    Gravity,
    /// Vertical from the weight of the column above, horizontal effective stress this share of the vertical (K0), no
    /// shear. Not in equilibrium under inclined ground.
    K0(f64),
}

/// Numerical analysis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Analysis {
    /// One-phase or two-phase.
    pub formulation: Formulation,
    /// Gravity, m/s2.
    pub gravity_m_s2: f64,
    /// Time step over the critical one.
    pub courant_number: f64,
    /// Which volumetric strain increment the stresses see.
    pub volumetric_strain: VolumetricStrain,
    /// Rate at which a point's pore pressure relaxes to its cell's mean, 1/s.
    pub pressure_relaxation_rate_per_s: f64,
    /// PIC share as a rate, 1/s: per step 1 - exp(-rate dt).
    pub pic_rate_per_s: f64,
    /// Which part of the point velocities decays at that rate.
    pub velocity_filter: VelocityFilter,
    /// Local damping in the failure stage, share of the unbalanced force (independent of the time step).
    pub local_damping: f64,
    /// Rate at which all velocities decay in the failure stage, 1/s.
    pub damping_rate_per_s: f64,
    /// Whether the points' domains follow their stretch.
    pub point_domain: PointDomain,
    /// Where the stresses at the start of the failure stage come from.
    pub initial_stress: InitialStress,
    /// Local damping of the gravity stage.
    pub gravity_stage_damping: f64,
    /// Duration of the gravity stage, s.
    pub gravity_stage_s: f64,
    /// Longest simulated time of the failure stage, s.
    pub duration_s: f64,
    /// Whether to stop once the material is at rest.
    pub stop_at_rest: bool,
    /// Rest, relative: kinetic energy below this share of its maximum.
    pub rest_kinetic_energy_share: f64,
    /// Rest, absolute: root mean square of the points' net velocity over several windows of `rest_hold_s` below
    /// this, m/s (see [`crate::gimp::RestRule`]).
    pub rest_velocity_m_s: f64,
    /// How long a rule for rest must hold, s.
    pub rest_hold_s: f64,
    /// Rest, absolute, two phases: change of pore pressure (root mean square over the points) in the time left, at its
    /// present rate, below which it has settled, Pa.
    pub rest_pore_pressure_change_pa: f64,
    /// Share of the available energy by which the balance may drift before a realisation is marked (see
    /// [`crate::gimp::Energy::drift`]).
    pub energy_drift_limit: f64,
}
