//! B6, self-weight consolidation, with water of three stiffnesses.

use super::check;
use crate::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};
use crate::gimp::{
    Body, Conditions, Controls, Fluid, Grid, InitialPoints, Kernel, Material, Setup, State, Support,
};
use crate::validation::{Comparison, Figure, Findings, Marks, Series};

const HEIGHT_M: f64 = 1.0;
const CELLS: usize = 20;
const CONSTRAINED_MODULUS_PA: f64 = 10e6;
const POROSITY: f64 = 0.3;
const PERMEABILITY_M_S: f64 = 1e-3;
const GRAVITY_M_S2: f64 = 9.81;
const WATER_KG_M3: f64 = 1000.0;
const GRAINS_KG_M3: f64 = 2650.0;
const DENSITY_KG_M3: f64 = (1.0 - POROSITY) * GRAINS_KG_M3 + POROSITY * WATER_KG_M3;

/// Bulk moduli of the water, Pa: water's, the campaigns', and one whose B is 0.99.
const MODULI_PA: [f64; 3] = [2.2e9, 4e8, 1e8];
const TIME_FACTORS: [f64; 2] = [0.2, 0.5];
const TOLERANCE: f64 = 5e-3;

/// Terms of the series: the next is below 1e-30 at the least time factor.
const TERMS: usize = 20;

/// Adds the checks and the figure.
pub(super) fn add(findings: &mut Findings) {
    let mut series: Vec<Series> = TIME_FACTORS.iter().map(|&factor| line(factor)).collect();
    for modulus in MODULI_PA {
        let mut body = column(modulus);
        let mut steps = 0;
        for factor in TIME_FACTORS {
            let end = factor * HEIGHT_M * HEIGHT_M / consolidation_m2_s(modulus);
            while body.time_s() < end {
                body.step(body.stable_step_s().min(end - body.time_s()));
                steps += 1;
            }
            let found = cell_means(&body);
            let errors = found.iter().map(|[excess, y]| excess - closed_form(1.0 - y, factor));
            let squares: f64 = errors.map(|error| error * error).sum();
            findings.checks.push(check(
                format!("self-weight consolidation, K_w {} MPa, Tv {factor}, rms error", modulus / 1e6),
                "gamma' H",
                TOLERANCE,
                libm::sqrt(squares / found.len() as f64),
                Comparison::AtMost,
            ));
            series.push(Series {
                label: format!("K_w {} MPa, Tv {factor}", modulus / 1e6),
                points: found,
                marks: Marks::Circles,
            });
        }
        findings.notes.push(format!(
            "Self-weight consolidation to Tv {}: {steps} steps with K_w {} MPa.",
            TIME_FACTORS[TIME_FACTORS.len() - 1],
            modulus / 1e6
        ));
    }
    findings.figures.push(Figure {
        name: "consolidation".into(),
        title: "Self-weight consolidation: excess pore pressure".into(),
        x: "excess pore pressure over gamma' H".into(),
        y: "height over H".into(),
        equal_axes: false,
        series,
    });
}

/// c_v = k / gamma_w / (1 / E_oed + n / K_w), m2/s.
fn consolidation_m2_s(modulus: f64) -> f64 {
    PERMEABILITY_M_S / (WATER_KG_M3 * GRAVITY_M_S2) / (1.0 / CONSTRAINED_MODULUS_PA + POROSITY / modulus)
}

/// Excess pore pressure over gamma' H at depth `z` H (drained top): the sum over M = (m + 1/2) pi of
/// 2 (-1)^m / M^2 sin(M z) exp(-M^2 Tv) (Terzaghi's equation with the load growing linearly with depth).
fn closed_form(z: f64, time_factor: f64) -> f64 {
    (0..TERMS)
        .map(|m| {
            let root = (m as f64 + 0.5) * std::f64::consts::PI;
            let sign = if m % 2 == 0 { 2.0 } else { -2.0 };
            sign / (root * root) * libm::sin(root * z) * libm::exp(-root * root * time_factor)
        })
        .sum()
}

fn line(time_factor: f64) -> Series {
    let points = (0..=50).map(|k| f64::from(k) / 50.0).map(|y| [closed_form(1.0 - y, time_factor), y]);
    Series { label: format!("closed form, Tv {time_factor}"), points: points.collect(), marks: Marks::Line }
}

/// Mean excess pore pressure over gamma' H in each cell of the undeformed column, and the cell's height over H.
fn cell_means(body: &Body) -> Vec<[f64; 2]> {
    let state: State = body.state();
    let (start, h) = (&body.setup().points.y, HEIGHT_M / CELLS as f64);
    let water = WATER_KG_M3 * GRAVITY_M_S2;
    (0..CELLS)
        .map(|row| {
            let of_cell: Vec<usize> = (0..start.len()).filter(|&i| (start[i] / h) as usize == row).collect();
            let height = (row as f64 + 0.5) * h;
            let mean = of_cell.iter().map(|&i| state.pressure[i]).sum::<f64>() / of_cell.len() as f64;
            let buoyant = DENSITY_KG_M3 * GRAVITY_M_S2 - water;
            [(mean - water * (HEIGHT_M - height)) / (buoyant * HEIGHT_M), height / HEIGHT_M]
        })
        .collect()
}

/// A saturated column of one cell's width whose water carries all weight at first; drained top, closed base.
fn column(modulus: f64) -> Body {
    let h = HEIGHT_M / CELLS as f64;
    let mut positions = Vec::new();
    for j in 0..2 * CELLS {
        for i in 0..2 {
            positions.push([(f64::from(i) + 0.5) * 0.5 * h, (j as f64 + 0.5) * 0.5 * h]);
        }
    }
    let mut points = InitialPoints::at_rest(&positions, 0.25 * h * h, DENSITY_KG_M3);
    for i in 0..points.len() {
        points.pressure[i] = DENSITY_KG_M3 * GRAVITY_M_S2 * (HEIGHT_M - points.y[i]);
    }
    let setup = Setup {
        grid: Grid::enclosing(0.0, 0.0, [1, CELLS + 2], h),
        points_per_cell_side: 2,
        conditions: Conditions {
            left: Support::Roller,
            right: Support::Roller,
            bottom: Support::Roller,
            top: Support::Open,
            gravity_m_s2: [0.0, -GRAVITY_M_S2],
            closed_surface: false,
            free_water_level_m: None,
        },
        obstacles: Vec::new(),
        fluid: Fluid {
            density_kg_m3: WATER_KG_M3,
            bulk_modulus_pa: modulus,
            cavitation_suction_pa: f64::INFINITY,
            gravity_m_s2: GRAVITY_M_S2,
        },
        materials: vec![Material {
            youngs_modulus_pa: CONSTRAINED_MODULUS_PA,
            poissons_ratio: 0.0,
            dilation_angle_rad: 0.0,
            tension_cutoff_pa: None,
            softening: None,
            porosity: POROSITY,
            permeability_m_s: PERMEABILITY_M_S,
        }],
        controls: Controls {
            formulation: Formulation::TwoPhase,
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
    };
    Body::new(setup, Kernel::best()).expect("the column's material can be analysed")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Base and middle of the independent table (physics.json, `self_weight_consolidation`).
    #[test]
    fn the_closed_form_meets_the_table() {
        for (factor, base) in [(0.05, 0.7477), (0.1, 0.6432), (0.2, 0.4960), (0.5, 0.2361), (1.0, 0.0687)] {
            assert!((closed_form(1.0, factor) - base).abs() < 1e-4, "Tv {factor}");
        }
    }
}
