//! Bodies that several tests set up.

#![allow(unreachable_pub)]

use runout_core::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};
use runout_core::gimp::{Conditions, Controls, Fluid, Grid, InitialPoints, Material, Setup, Support};

/// An elastic, frictionless box without gravity; the tests change what they need.
pub fn setup(grid: Grid, youngs_modulus_pa: f64, poissons_ratio: f64, points: InitialPoints) -> Setup {
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
            density_kg_m3: 1000.0,
            bulk_modulus_pa: 2.2e9,
            cavitation_suction_pa: f64::INFINITY,
            gravity_m_s2: 9.81,
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

/// Points at the quarters of `nx` by `ny` cells of side `h` from (left, bottom).
pub fn filled(left: f64, bottom: f64, nx: usize, ny: usize, h: f64) -> Vec<[f64; 2]> {
    let mut positions = Vec::new();
    for j in 0..2 * ny {
        for i in 0..2 * nx {
            positions.push([left + (i as f64 + 0.5) * 0.5 * h, bottom + (j as f64 + 0.5) * 0.5 * h]);
        }
    }
    positions
}
