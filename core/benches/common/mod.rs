//! What benches and tests share: the paper's first slope, as a spec and as a body that already flows, and the clock.

#![allow(unreachable_pub, dead_code)]

use runout_core::campaign::{
    Analysis, Autocorrelation, Contact, Field, Formulation, GroundSurface, InitialPorePressure,
    InitialStress, Mesh, Model, PointDomain, RunoutMeasure, Sample, Slope, Soil, Surface, VelocityFilter,
    VolumetricStrain, Water, WaterAboveTable,
};
use runout_core::copula::Copula;
use runout_core::gimp::{Conditions, Controls, Fluid, InitialPoints, Material, Setup, Support};
use runout_core::marginal::{Family, Marginal};
use runout_core::points;
use runout_core::site::Property;
use runout_core::slope;
use runout_core::spec::{RandomProperty, SPEC_FORMAT, Spec};

/// The cell of the headline figure: 10,125 points.
pub const CELL_M: f64 = 0.4;

/// Processor time of this thread, s, where the system tells it (Linux: the first number of schedstat, in ns): a busy
/// machine does not matter to it. It moves on in ticks of about 4 ms.
pub fn processor_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}

/// Seconds of this thread that `work` takes; of the wall clock where the system does not tell.
pub fn seconds<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let (start, wall) = (processor_s(), std::time::Instant::now());
    let result = work();
    let seconds = match (start, processor_s()) {
        (Some(start), Some(end)) => end - start,
        _ => wall.elapsed().as_secs_f64(),
    };
    (result, seconds)
}

/// The name of a formulation on the command line and in tables.
pub fn name(formulation: Formulation) -> &'static str {
    match formulation {
        Formulation::OnePhase => "one-phase",
        Formulation::TwoPhase => "two-phase",
    }
}

/// The formulation of that name.
pub fn formulation(name: &str) -> Option<Formulation> {
    match name {
        "one-phase" => Some(Formulation::OnePhase),
        "two-phase" => Some(Formulation::TwoPhase),
        _ => None,
    }
}

/// Cohesion and friction angle as fitted to the paper's Table 2, tied by the No.16 copula.
pub fn random_properties() -> (Vec<RandomProperty>, Copula) {
    let random = |property, family, p, q| RandomProperty {
        property,
        marginal: Marginal::new(family, p, q).expect("the fit is a distribution"),
    };
    let both = vec![
        random(Property::Cohesion, Family::TruncNormal, 11.412, 6.1915),
        random(Property::FrictionAngle, Family::Weibull, 29.37, 5.75),
    ];
    (both, Copula::No16 { theta: 0.017_395_307_2 })
}

/// Fastest sliding velocity of [`flowing_slope`], m/s: that of the paper's slide.
const SLIDING_M_S: f64 = 5.0;

/// The slope of [`spec`] with cells of `cell_m`, as a body in developed flow: every point somewhere in the square that it
/// stands for, stressed by the weight above it, sheared down the slope and yielding.
///
/// A slide that is computed from its beginning would be the same, but takes minutes with a million points.
pub fn flowing_slope(formulation: Formulation, cell_m: f64) -> Setup {
    let mut model = spec(formulation).model;
    model.mesh.cell_size_m = cell_m;
    let Model { slope, mesh, soil, water, analysis, .. } = &model;
    let layout = points::fill(slope, mesh);
    let weight = soil.unit_weight_n_m3.expect("it is given");
    // Low-discrepancy places in the square (Roberts's R2 sequence: powers of the inverse of the plastic number).
    let place = |i: usize, step: f64| ((i as f64 * step).fract() - 0.5) * layout.spacing_m;
    let positions: Vec<[f64; 2]> = (0..layout.len())
        .map(|i| {
            [layout.x[i] + place(i, 0.754_877_666_246_693), layout.y[i] + place(i, 0.569_840_290_998_053)]
        })
        .collect();
    let start = InitialPoints::at_rest(
        &positions,
        layout.spacing_m * layout.spacing_m,
        weight / analysis.gravity_m_s2,
    );
    let height_m = slope::height_m(slope);
    let weight_above = |&[x, y]: &[f64; 2]| weight * (slope::ground_surface_y(slope, x) - y).max(0.0);
    let points = InitialPoints {
        velocity: positions
            .iter()
            .map(|&[_, y]| [SLIDING_M_S * y / height_m, -0.5 * SLIDING_M_S * y / height_m])
            .collect(),
        stress: positions.iter().map(weight_above).map(|v| [-0.6 * v, -v, -0.6 * v, 0.0]).collect(),
        cohesion: vec![soil.cohesion_pa.expect("it is given"); positions.len()],
        friction_angle: vec![soil.friction_angle_rad.expect("it is given"); positions.len()],
        ..start
    };
    Setup {
        grid: slope::grid(slope, mesh),
        points_per_cell_side: mesh.points_per_cell_side,
        conditions: Conditions {
            left: Support::Roller,
            right: Support::Roller,
            bottom: Support::Fixed,
            top: Support::Open,
            gravity_m_s2: [0.0, -analysis.gravity_m_s2],
            closed_surface: false,
            free_water_level_m: None,
        },
        obstacles: Vec::new(),
        fluid: Fluid {
            density_kg_m3: water.density_kg_m3,
            bulk_modulus_pa: water.bulk_modulus_pa,
            cavitation_suction_pa: water.cavitation_suction_pa,
            gravity_m_s2: analysis.gravity_m_s2,
        },
        materials: vec![Material {
            youngs_modulus_pa: soil.youngs_modulus_pa,
            poissons_ratio: soil.poissons_ratio,
            dilation_angle_rad: soil.dilation_angle_rad,
            tension_cutoff_pa: soil.tension_cutoff_pa,
            softening: None,
            porosity: soil.porosity,
            permeability_m_s: soil.permeability_m_s,
        }],
        controls: Controls {
            formulation,
            volumetric_strain: analysis.volumetric_strain,
            pressure_relaxation_rate_per_s: analysis.pressure_relaxation_rate_per_s,
            pic_rate_per_s: analysis.pic_rate_per_s,
            velocity_filter: analysis.velocity_filter,
            local_damping: analysis.local_damping,
            damping_rate_per_s: analysis.damping_rate_per_s,
            point_domain: analysis.point_domain,
            courant_number: analysis.courant_number,
        },
        points,
    }
}

/// The paper's first example at its printed means, three seconds.
pub fn spec(formulation: Formulation) -> Spec {
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
        mesh: Mesh { cell_size_m: CELL_M, points_per_cell_side: 2 },
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
        sample: Sample { measure: RunoutMeasure::DisplacementQ999, threshold_m: 0.1, profile: false },
        maximum_steps: 1_000_000,
    };
    let copula = Copula::Independent { dimension: 0 };
    Spec { format: SPEC_FORMAT, seed: 1, random: Vec::new(), copula, model }
}
