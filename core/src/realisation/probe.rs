//! A tiny realisation whose digest tells whether this machine computes the bits that others do.

use super::{Prepared, Progress};
use crate::campaign::{
    Analysis, Autocorrelation, Contact, Field, Formulation, GroundSurface, InitialPorePressure,
    InitialStress, Layer, Mesh, Model, Obstacle, PointDomain, Polyline, RunoutMeasure, Sample, Slope,
    Softening, Soil, Surface, VelocityFilter, VolumetricStrain, Water, WaterAboveTable, WaterTable,
};
use crate::copula::Copula;
use crate::gimp::Kernel;
use crate::marginal::{Family, Marginal};
use crate::site::Property;
use crate::spec::{RandomProperty, SPEC_FORMAT, Spec};

/// Digest (32 hexadecimal digits) of a realisation of a few milliseconds with `kernel`: two random fields, 26 points,
/// both stages, two phases, two layers, yielding and softening soil under a water table, free water, a frictional base
/// and an obstacle. Every kernel gives the same one.
///
/// The numbers of its spec mean nothing but that every phase of the time step has something to do.
pub fn probe(kernel: Kernel) -> String {
    let prepared = Prepared::new(spec(), kernel).expect("the probe's slope has points and fields");
    let outcome = prepared.realise(0, &Progress::default());
    outcome.expect("nobody cancels the probe").digest
}

pub(super) fn spec() -> Spec {
    let random = |property, family, p, q| RandomProperty { property, marginal: Marginal { family, p, q } };
    Spec {
        format: SPEC_FORMAT,
        seed: 1,
        random: vec![
            random(Property::Cohesion, Family::Lognormal, -1.0, 0.5),
            random(Property::FrictionAngle, Family::Weibull, 20.0, 5.0),
        ],
        copula: Copula::Frank { theta: -2.0 },
        model: model(),
    }
}

const SOIL: Soil = Soil {
    youngs_modulus_pa: 1e7,
    poissons_ratio: 0.35,
    cohesion_pa: None,
    friction_angle_rad: None,
    unit_weight_n_m3: Some(20e3),
    dilation_angle_rad: 0.0,
    tension_cutoff_pa: Some(0.0),
    softening: Some(Softening {
        residual_cohesion_ratio: 0.5,
        residual_friction_ratio: 0.9,
        residual_dilation_ratio: 0.0,
        displacement_m: 0.05,
    }),
    porosity: 0.3,
    permeability_m_s: 1e-4,
};

fn model() -> Model {
    Model {
        field: Field {
            autocorrelation: Autocorrelation::SingleExponential,
            scale_horizontal_m: 4.0,
            scale_vertical_m: 2.0,
            rotation_rad: 0.0,
        },
        slope: Slope {
            surface: Surface::Uniform {
                height_m: 2.0,
                angle_rad: std::f64::consts::FRAC_PI_4,
                crest_width_m: 2.0,
            },
            foundation_depth_m: 0.0,
            runout_plain_m: 3.0,
            base: Contact::Friction(0.5),
        },
        obstacles: vec![Obstacle { x_m: [1.0, 2.0], y_m: [0.0, 1.0], contact: Contact::Friction(0.3) }],
        mesh: Mesh { cell_size_m: 1.0, points_per_cell_side: 2 },
        soil: SOIL,
        layers: vec![
            Layer { name: "upper".to_owned(), bottom: Some(Polyline::level(1.0)), soil: SOIL },
            Layer {
                name: "lower".to_owned(),
                bottom: None,
                soil: Soil { permeability_m_s: 1e-5, softening: None, ..SOIL },
            },
        ],
        water: Water {
            density_kg_m3: 1000.0,
            bulk_modulus_pa: 4e8,
            initial_pore_pressure: InitialPorePressure::Hydrostatic(WaterTable::GroundSurface),
            free_water_level_m: Some(0.3),
            above_table: WaterAboveTable::Held,
            ground_surface: GroundSurface::Drained,
            cavitation_suction_pa: 1e3,
        },
        analysis: Analysis {
            formulation: Formulation::TwoPhase,
            gravity_m_s2: 9.81,
            courant_number: 0.8,
            volumetric_strain: VolumetricStrain::CellAverage,
            pressure_relaxation_rate_per_s: 300.0,
            pic_rate_per_s: 10.0,
            velocity_filter: VelocityFilter::Pic,
            local_damping: 0.05,
            damping_rate_per_s: 0.1,
            point_domain: PointDomain::Uniform,
            initial_stress: InitialStress::Gravity,
            gravity_stage_damping: 0.7,
            gravity_stage_s: 0.1,
            duration_s: 0.05,
            stop_at_rest: false,
            rest_kinetic_energy_share: 1e-3,
            rest_velocity_m_s: 1e-3,
            rest_hold_s: 0.01,
            rest_pore_pressure_change_pa: 100.0,
            energy_drift_limit: 0.05,
        },
        sample: Sample { measure: RunoutMeasure::MaxDisplacement, threshold_m: 1e-3, profile: false },
        maximum_steps: 1000,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::OutcomeKind;
    use crate::realisation::Source;

    #[test]
    fn the_probe_slides_yields_and_is_the_same_with_every_kernel() {
        let prepared = Prepared::new(spec(), Kernel::Baseline).unwrap();
        let mut strained = 0;
        let mut last = |snapshot: &crate::realisation::Snapshot<'_>| {
            strained = snapshot.state.plastic_strain.iter().filter(|e| **e > 0.0).count();
        };
        let outcome = prepared.analyse(Source::Index(0), 1.0, &mut last, &Progress::default()).unwrap();
        assert_eq!(outcome.outcome, OutcomeKind::Runout, "{outcome:?}");
        assert_eq!(outcome.points, 26);
        assert!((20..200).contains(&outcome.steps), "{} steps", outcome.steps);
        assert!(strained > 6, "only {strained} points have yielded");
        for kernel in Kernel::available() {
            assert_eq!(probe(kernel), outcome.digest, "{}", kernel.name());
        }
    }
}
