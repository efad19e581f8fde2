//! Bodies that the cases share: an elastic box, points that fill cells, one-dimensional columns.

use crate::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};
use crate::gimp::{
    Body, Conditions, Controls, End, Fluid, Grid, InitialPoints, Kernel, Limits, Material, Setup, Support,
    run,
};
use std::ops::ControlFlow;

/// Gravity of the cases on earth, m/s2.
pub(super) const GRAVITY_M_S2: f64 = 9.81;
/// Density of water, kg/m3.
pub(super) const WATER_KG_M3: f64 = 1000.0;
/// Bulk modulus of water, Pa.
pub(super) const WATER_BULK_PA: f64 = 2.2e9;
/// Density of grains (quartz), kg/m3.
pub(super) const GRAINS_KG_M3: f64 = 2650.0;

/// A dry elastic body without gravity and damping, on rollers to its left and below, free to its right and above;
/// the cases change what they need. Courant number 0.4, as the tolerances are stated for it.
pub(super) fn elastic_body(
    grid: Grid,
    youngs_modulus_pa: f64,
    poissons_ratio: f64,
    points: InitialPoints,
) -> Setup {
    Setup {
        grid,
        points_per_cell_side: 2,
        conditions: Conditions {
            left: Support::Roller,
            right: Support::Open,
            bottom: Support::Roller,
            top: Support::Open,
            gravity_m_s2: [0.0, 0.0],
            closed_surface: false,
            free_water_level_m: None,
        },
        obstacles: Vec::new(),
        fluid: Fluid {
            density_kg_m3: WATER_KG_M3,
            bulk_modulus_pa: WATER_BULK_PA,
            cavitation_suction_pa: f64::INFINITY,
            gravity_m_s2: GRAVITY_M_S2,
        },
        materials: vec![Material {
            youngs_modulus_pa,
            poissons_ratio,
            dilation_angle_rad: 0.0,
            tension_cutoff_pa: None,
            softening: None,
            porosity: 0.3,
            permeability_m_s: 1e-3,
        }],
        controls: Controls {
            formulation: Formulation::OnePhase,
            volumetric_strain: VolumetricStrain::Point,
            pressure_relaxation_rate_per_s: 0.0,
            pic_rate_per_s: 0.0,
            velocity_filter: VelocityFilter::Pic,
            local_damping: 0.0,
            damping_rate_per_s: 0.0,
            point_domain: PointDomain::Uniform,
            courant_number: 0.4,
        },
        points,
    }
}

/// Points at the quarters of `cells[0]` by `cells[1]` cells of side `h` from `corner`, row by row; m.
pub(super) fn filled(corner: [f64; 2], cells: [usize; 2], h: f64) -> Vec<[f64; 2]> {
    let quarter = |k: usize| (k as f64 + 0.5) * 0.5 * h;
    let row = |j: usize| (0..2 * cells[0]).map(move |i| [corner[0] + quarter(i), corner[1] + quarter(j)]);
    (0..2 * cells[1]).flat_map(row).collect()
}

/// A column one cell wide between rollers, from y = 0 to `height_m`, with two free cells above it.
pub(super) fn column(
    cells: usize,
    height_m: f64,
    density_kg_m3: f64,
    youngs_modulus_pa: f64,
    poissons_ratio: f64,
) -> Setup {
    let h = height_m / cells as f64;
    let points = InitialPoints::at_rest(&filled([0.0, 0.0], [1, cells], h), 0.25 * h * h, density_kg_m3);
    let grid = Grid::enclosing(0.0, 0.0, [1, cells + 2], h);
    let mut setup = elastic_body(grid, youngs_modulus_pa, poissons_ratio, points);
    setup.conditions.right = Support::Roller;
    setup
}

/// Sets `setup` up with the fastest kernel: all give the same bits.
pub(super) fn body(setup: Setup) -> Body {
    Body::new(setup, Kernel::best()).expect("the cases' strengths and densities can be analysed")
}

/// Carries `body` to `time_s`; `each` sees it after every step.
///
/// # Panics
/// If the analysis blows up or leaves the grid: nothing that it tells then means anything.
pub(super) fn advance(body: &mut Body, time_s: f64, mut each: impl FnMut(&Body)) {
    let limits = Limits { duration_s: time_s - body.time_s(), maximum_steps: u64::MAX, rest: None };
    let end = run(body, &limits, &mut |body| {
        each(body);
        ControlFlow::Continue(())
    });
    assert!(end == End::Duration, "the analysis ended at {} s: {end:?}", body.time_s());
}
