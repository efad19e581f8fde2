//! `[analysis]`: from words and edge units to [`Analysis`].

use super::{Checked, PA_PER_KPA, between, non_negative, positive, share, within, word};
use crate::campaign::file::{AnalysisSection, InitialStressText};
use crate::campaign::{Analysis, Formulation, InitialStress, PointDomain, VelocityFilter, VolumetricStrain};

/// Largest coefficient of earth pressure at rest: above the passive coefficient of almost any soil (5 is that of 42
/// degrees), so that the state could not stand.
const LARGEST_K0: f64 = 5.0;

pub(super) fn check_analysis(raw: &AnalysisSection) -> Checked<Analysis> {
    Ok(Analysis {
        formulation: word(
            "analysis.formulation",
            &raw.formulation,
            &[("one-phase", Formulation::OnePhase), ("two-phase", Formulation::TwoPhase)],
        )?,
        gravity_m_s2: between("analysis.gravity_m_s2", raw.gravity_m_s2, 1e-3, 1e3)?,
        courant_number: within(
            "analysis.courant_number",
            raw.courant_number,
            raw.courant_number > 0.0 && raw.courant_number <= 1.0,
            "it must be in (0, 1]",
        )?,
        volumetric_strain: word(
            "analysis.volumetric_strain",
            &raw.volumetric_strain,
            &[("cell-average", VolumetricStrain::CellAverage), ("point", VolumetricStrain::Point)],
        )?,
        pressure_relaxation_rate_per_s: non_negative(
            "analysis.pressure_relaxation_rate_per_s",
            raw.pressure_relaxation_rate_per_s,
        )?,
        pic_rate_per_s: non_negative("analysis.pic_rate_per_s", raw.pic_rate_per_s)?,
        velocity_filter: word(
            "analysis.velocity_filter",
            &raw.velocity_filter,
            &[("pic", VelocityFilter::Pic), ("xpic", VelocityFilter::Xpic)],
        )?,
        local_damping: share("analysis.local_damping", raw.local_damping)?,
        damping_rate_per_s: non_negative("analysis.damping_rate_per_s", raw.damping_rate_per_s)?,
        point_domain: word(
            "analysis.point_domain",
            &raw.point_domain,
            &[("uniform", PointDomain::Uniform), ("stretched", PointDomain::Stretched)],
        )?,
        initial_stress: match &raw.initial_stress {
            InitialStressText::Word(text) => {
                word("analysis.initial_stress", text, &[("gravity", InitialStress::Gravity)])?
            }
            InitialStressText::K0(value) => {
                InitialStress::K0(between("analysis.initial_stress.k0", value.k0, 0.0, LARGEST_K0)?)
            }
        },
        gravity_stage_damping: share("analysis.gravity_stage_damping", raw.gravity_stage_damping)?,
        gravity_stage_s: positive("analysis.gravity_stage_s", raw.gravity_stage_s)?,
        duration_s: positive("analysis.duration_s", raw.duration_s)?,
        stop_at_rest: raw.stop_at_rest,
        rest_kinetic_energy_share: share(
            "analysis.rest_kinetic_energy_share",
            raw.rest_kinetic_energy_share,
        )?,
        rest_velocity_m_s: non_negative("analysis.rest_velocity_m_s", raw.rest_velocity_m_s)?,
        rest_hold_s: non_negative("analysis.rest_hold_s", raw.rest_hold_s)?,
        rest_pore_pressure_change_pa: positive(
            "analysis.rest_pore_pressure_change_kpa",
            raw.rest_pore_pressure_change_kpa,
        )? * PA_PER_KPA,
        energy_drift_limit: positive("analysis.energy_drift_limit", raw.energy_drift_limit)?,
    })
}
