//! Consolidation under self-weight (B6) and under a step load (B5) with water of three stiffnesses.

use crate::campaign::Formulation;
use crate::gimp::{Body, Setup};
use crate::validation::closed_forms::{triangular_excess, uniform_excess};
use crate::validation::measure::{rms, row_centres, row_means};
use crate::validation::set_up::{GRAINS_KG_M3, GRAVITY_M_S2, WATER_KG_M3, advance, body, column};
use crate::validation::{Check, Figure, Findings, Series};

const HEIGHT_M: f64 = 1.0;
const CELLS: usize = 20;
const CONSTRAINED_MODULUS_PA: f64 = 10e6;
const POROSITY: f64 = 0.3;
const PERMEABILITY_M_S: f64 = 1e-3;
const WATER_N_M3: f64 = WATER_KG_M3 * GRAVITY_M_S2;
const DENSITY_KG_M3: f64 = (1.0 - POROSITY) * GRAINS_KG_M3 + POROSITY * WATER_KG_M3;

/// Bulk moduli of the water, Pa: water's, the campaigns', and one whose B is 0.99.
const MODULI_PA: [f64; 3] = [2.2e9, 4e8, 1e8];
/// Late times: before, softer water still rings.
const TIME_FACTORS: [f64; 2] = [0.2, 0.5];
const TOLERANCE: f64 = 5e-3;
/// Of the step load, as in its own case.
const STEP_LOAD_TOLERANCE: f64 = 0.01;

/// Adds the checks and the figure.
pub(super) fn add(findings: &mut Findings) {
    let mut series: Vec<Series> = TIME_FACTORS.iter().map(|&factor| line(factor)).collect();
    for modulus in MODULI_PA {
        let mut body = body(saturated(modulus));
        for factor in TIME_FACTORS {
            advance(&mut body, factor * HEIGHT_M * HEIGHT_M / consolidation_m2_s(modulus), |_| {});
            let found = excess(&body);
            let errors = found.iter().map(|[excess, y]| excess - triangular_excess(1.0 - y, factor));
            let water = format!("K_w {} MPa, Tv {factor}", modulus / 1e6);
            let what = format!("self-weight consolidation, {water}, rms error over gamma' H");
            findings.checks.push(Check::at_most(what, "", TOLERANCE, rms(errors)));
            series.push(Series::circles(water, found));
        }
        findings.notes.push(format!(
            "Self-weight consolidation to Tv {}: {} steps with K_w {} MPa.",
            TIME_FACTORS[TIME_FACTORS.len() - 1],
            body.steps(),
            modulus / 1e6
        ));
    }
    MODULI_PA.into_iter().for_each(|modulus| step_load(modulus, findings));
    findings.figures.push(Figure {
        name: "consolidation".into(),
        title: "Self-weight consolidation: excess pore pressure".into(),
        x: "excess pore pressure over gamma' H".into(),
        y: "height over H".into(),
        equal_axes: false,
        series,
    });
}

/// The column under a step load: it starts with the undrained pressure and, counted from the loaded state, no total stress.
fn step_load(modulus: f64, findings: &mut Findings) {
    let mut setup = saturated(modulus);
    setup.conditions.gravity_m_s2 = [0.0, 0.0];
    let storage = modulus / POROSITY;
    let undrained = 10e3 * storage / (storage + CONSTRAINED_MODULUS_PA);
    setup.points.pressure.fill(undrained);
    setup.points.stress.fill([0.0, undrained, 0.0, 0.0]);
    let mut body = body(setup);
    let h = HEIGHT_M / CELLS as f64;
    for factor in TIME_FACTORS {
        advance(&mut body, factor * HEIGHT_M * HEIGHT_M / consolidation_m2_s(modulus), |_| {});
        let means = row_means(&body.setup().points.y, &body.state().pressure, CELLS, h);
        let centres = row_centres(CELLS, h);
        let errors = means
            .iter()
            .zip(centres)
            .map(|(p, y)| p / undrained - uniform_excess(1.0 - y / HEIGHT_M, factor));
        let what = format!(
            "step load, K_w {} MPa, Tv {factor}, rms error over the undrained pressure",
            modulus / 1e6
        );
        findings.checks.push(Check::at_most(what, "", STEP_LOAD_TOLERANCE, rms(errors)));
    }
}

/// c_v = k / gamma_w / (1 / E_oed + n / K_w), m2/s.
fn consolidation_m2_s(modulus: f64) -> f64 {
    PERMEABILITY_M_S / WATER_N_M3 / (1.0 / CONSTRAINED_MODULUS_PA + POROSITY / modulus)
}

fn line(time_factor: f64) -> Series {
    let heights = (0..=50).map(|k| f64::from(k) / 50.0);
    let points = heights.map(|y| [triangular_excess(1.0 - y, time_factor), y]).collect();
    Series::line(format!("closed form, Tv {time_factor}"), points)
}

/// Mean excess pore pressure over gamma' H in each row of cells of the undeformed column, and the row's height over H.
fn excess(body: &Body) -> Vec<[f64; 2]> {
    let h = HEIGHT_M / CELLS as f64;
    let means = row_means(&body.setup().points.y, &body.state().pressure, CELLS, h);
    let scale = (DENSITY_KG_M3 * GRAVITY_M_S2 - WATER_N_M3) * HEIGHT_M;
    let over = |(mean, y): (f64, f64)| [(mean - WATER_N_M3 * (HEIGHT_M - y)) / scale, y / HEIGHT_M];
    means.into_iter().zip(row_centres(CELLS, h)).map(over).collect()
}

/// A saturated column whose water carries all weight at first.
fn saturated(modulus: f64) -> Setup {
    let mut setup = column(CELLS, HEIGHT_M, DENSITY_KG_M3, CONSTRAINED_MODULUS_PA, 0.0);
    setup.controls.formulation = Formulation::TwoPhase;
    setup.conditions.gravity_m_s2 = [0.0, -GRAVITY_M_S2];
    setup.fluid.bulk_modulus_pa = modulus;
    setup.materials[0].porosity = POROSITY;
    setup.materials[0].permeability_m_s = PERMEABILITY_M_S;
    for i in 0..setup.points.len() {
        setup.points.pressure[i] = DENSITY_KG_M3 * GRAVITY_M_S2 * (HEIGHT_M - setup.points.y[i]);
    }
    setup
}
