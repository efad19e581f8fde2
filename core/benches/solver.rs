//! Point updates per second of the solver on one core: the paper's slope at 0.2 m points (10,125 of them), failing,
//! with every kernel that this processor has but the slow baseline. Run with
//! `cargo bench -p runout-core --bench solver`.
//!
//! The first seconds of the slide are computed, so that points are out of their initial order and yield. Timed is the
//! thread's own processor time where the system tells it (Linux), so that a busy machine does not matter; else the wall
//! clock.

use runout_core::campaign::{
    Analysis, Autocorrelation, Contact, Field, Formulation, GroundSurface, InitialPorePressure,
    InitialStress, Mesh, Model, PointDomain, RunoutMeasure, Sample, Slope, Soil, Surface, VelocityFilter,
    VolumetricStrain, Water, WaterAboveTable,
};
use runout_core::copula::Copula;
use runout_core::gimp::Kernel;
use runout_core::realisation::{Prepared, Progress};
use runout_core::spec::{SPEC_FORMAT, Spec};
use std::time::Instant;

fn main() {
    for formulation in [Formulation::OnePhase, Formulation::TwoPhase] {
        for kernel in Kernel::available().into_iter().filter(|&k| k != Kernel::Baseline) {
            time(formulation, kernel);
        }
    }
}

fn time(formulation: Formulation, kernel: Kernel) {
    let prepared = Prepared::new(spec(formulation), kernel).expect("a sound model");
    // The first call computes and keeps the gravity stage.
    let outcome = prepared.deterministic(&Progress::default()).expect("nothing cancels it");
    let (start, wall) = (processor_s(), Instant::now());
    let again = prepared.deterministic(&Progress::default()).expect("nothing cancels it");
    let seconds = match (start, processor_s()) {
        (Some(start), Some(end)) => end - start,
        _ => wall.elapsed().as_secs_f64(),
    };
    assert_eq!(again, outcome);
    println!(
        "{formulation:?} {:<8} {:6} points {:6} steps {:6.2} s {:6.2} million point updates/s",
        kernel.name(),
        outcome.points,
        outcome.steps,
        seconds,
        outcome.points as f64 * outcome.steps as f64 / seconds / 1e6
    );
}

/// Processor time of this thread, s: the first number of Linux's schedstat, in ns.
fn processor_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}

/// The paper's first example at its printed means, three seconds.
fn spec(formulation: Formulation) -> Spec {
    let model = Model {
        field: Field {
            autocorrelation: Autocorrelation::SingleExponential,
            scale_horizontal_m: 2.0,
            scale_vertical_m: 2.0,
            rotation_rad: 0.0,
        },
        slope: Slope {
            surface: Surface::Uniform {
                height_m: 15.0,
                angle_rad: std::f64::consts::FRAC_PI_4,
                crest_width_m: 19.4,
            },
            foundation_depth_m: 0.0,
            runout_plain_m: 45.0,
            base: Contact::Fixed,
        },
        obstacles: Vec::new(),
        mesh: Mesh { cell_size_m: 0.4, points_per_cell_side: 2 },
        soil: Soil {
            youngs_modulus_pa: 100e6,
            poissons_ratio: 0.35,
            cohesion_pa: Some(11.41e3),
            friction_angle_rad: Some(21.14_f64.to_radians()),
            unit_weight_n_m3: Some(20e3),
            dilation_angle_rad: 0.0,
            tension_cutoff_pa: None,
            softening: None,
            porosity: 0.3,
            permeability_m_s: 1e-4,
        },
        layers: Vec::new(),
        water: Water {
            density_kg_m3: 1000.0,
            bulk_modulus_pa: 4e8,
            initial_pore_pressure: InitialPorePressure::None,
            free_water_level_m: None,
            above_table: WaterAboveTable::Sinks,
            ground_surface: GroundSurface::Drained,
            cavitation_suction_pa: 100e3,
        },
        analysis: Analysis {
            formulation,
            gravity_m_s2: 9.81,
            courant_number: 0.8,
            volumetric_strain: VolumetricStrain::CellAverage,
            pressure_relaxation_rate_per_s: 300.0,
            pic_rate_per_s: 4.4,
            velocity_filter: VelocityFilter::Pic,
            local_damping: 0.0,
            damping_rate_per_s: 0.0,
            point_domain: PointDomain::Uniform,
            initial_stress: InitialStress::Gravity,
            gravity_stage_damping: 0.7,
            gravity_stage_s: 1.5,
            duration_s: 3.0,
            stop_at_rest: false,
            rest_kinetic_energy_share: 1e-3,
            rest_velocity_m_s: 1e-3,
            rest_hold_s: 0.5,
            rest_pore_pressure_change_pa: 500.0,
            energy_drift_limit: 0.05,
        },
        sample: Sample { measure: RunoutMeasure::DisplacementQ999, threshold_m: 0.1 },
        maximum_steps: 1_000_000,
    };
    let copula = Copula::Independent { dimension: 0 };
    Spec { format: SPEC_FORMAT, seed: 1, random: Vec::new(), copula, model }
}
