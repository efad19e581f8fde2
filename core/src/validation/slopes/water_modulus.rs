//! How stiff must the pore water be? The explicit scheme's alternative to a semi-implicit treatment of the water.

use super::{Slide, TWO_PHASE, check, ending, runout_m};
use crate::outcome::Outcome;
use crate::validation::{Case, Comparison, Depth, Figure, Findings, Marks, Series};

pub(in crate::validation) const WATER_MODULUS: Case = Case {
    name: "water-modulus",
    title: "Softer pore water instead of a semi-implicit scheme",
    about: "The explicit time step follows the undrained wave, whose speed comes from the water's bulk modulus K_w; but \
once the water is much stiffer than the skeleton, how stiff it is no longer moves the answer. Measures: Skempton's \
B = Q / (Q + K), Q = K_w / n. The slide of Example I in two phases with K_w from 0.1 to 6.1 GPa (the reference paper's): \
from 0.4 GPa on the runout must agree with the stiffest within 5 per cent, which is less than half of what halving the \
cell changes (slope-convergence); the steps per simulated second must follow the undrained wave speed \
sqrt((E_oed + Q) / rho) within 10 per cent (where the step is so short that drag does not join the phases within it, the step \
follows the fast wave of the uncoupled phases, at most 8.7 per cent faster here; the rest is the material's own speed). Twice: without a limit on \
suction, and with one of 100 kPa. Then self-weight consolidation of a column (B6; E_oed 10 MPa) against the closed form \
with water's 2.2 GPa, 0.4 GPa and 0.1 GPa (B 0.99), at Tv 0.2 and 0.5: root mean square of the cell means within 0.005 of \
gamma' H; and the same column under a step load (B5) within 0.01 of the undrained pressure.",
    run,
};

/// Suction that water never reaches here, kPa.
const NO_LIMIT_KPA: f64 = 1e6;
const LIMIT_KPA: f64 = 100.0;

/// Change of runout that softer water may cause.
const RUNOUT_TOLERANCE: f64 = 0.05;

/// By how much the steps per second may depart from the undrained wave speed: the fast wave of the uncoupled phases runs 3,459
/// instead of 3,182 m/s with the paper's water, 8.7 % more, and the material itself moves.
const STEPS_TOLERANCE: f64 = 0.10;

/// Moduli from which the runout must agree, MPa.
const STIFF_ENOUGH_MPA: f64 = 400.0;

fn run(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    let (moduli, cells): (&[f64], &[f64]) = match depth {
        Depth::Quick => (&[400.0, 1600.0], &[0.8]),
        Depth::Full => (&[100.0, 400.0, 1600.0, 6146.0], &[0.8, 0.4]),
    };
    let mut series = Vec::new();
    for &cell_m in cells {
        for limit_kpa in [NO_LIMIT_KPA, LIMIT_KPA] {
            let slide = Slide { cell_m, cavitation_suction_kpa: limit_kpa, ..TWO_PHASE };
            series.push(slides(&mut findings, slide, moduli));
        }
    }
    findings.figures.push(Figure {
        name: "runout".into(),
        title: "Displacement against the water's bulk modulus".into(),
        x: "bulk modulus of the water, GPa".into(),
        y: "99.9 % quantile of displacement, m".into(),
        equal_axes: false,
        series,
    });
    super::consolidation::add(&mut findings);
    findings
}

/// The slide with each modulus against the stiffest, the last.
fn slides(findings: &mut Findings, slide: Slide, moduli: &[f64]) -> Series {
    let cell_m = slide.cell_m;
    let suction = if slide.cavitation_suction_kpa == NO_LIMIT_KPA {
        "any suction".to_owned()
    } else {
        format!("suction to {} kPa", slide.cavitation_suction_kpa)
    };
    let with = |&modulus: &f64| (modulus, Slide { water_modulus_mpa: modulus, ..slide }.run());
    let outcomes: Vec<(f64, Outcome)> = moduli.iter().map(with).collect();
    let (stiffest, reference) = outcomes.last().expect("there are moduli");
    for (modulus, outcome) in &outcomes[..outcomes.len() - 1] {
        let pair = format!("{cell_m} m cells, {suction}, K_w {modulus} against {stiffest} MPa");
        let comparison = if *modulus >= STIFF_ENOUGH_MPA {
            Comparison::Relative(RUNOUT_TOLERANCE)
        } else {
            Comparison::Information
        };
        let (soft_m, stiff_m) = (runout_m(outcome), runout_m(reference));
        findings.checks.push(check(format!("displacement, {pair}"), "m", stiff_m, soft_m, comparison));
        findings.checks.push(check(
            format!("steps saved (factor), {pair}"),
            "",
            wave_m_s(&slide, *stiffest) / wave_m_s(&slide, *modulus),
            steps_per_s(reference) / steps_per_s(outcome),
            Comparison::Relative(STEPS_TOLERANCE),
        ));
    }
    for (modulus, outcome) in &outcomes {
        findings.notes.push(format!(
            "{cell_m} m cells, {suction}, K_w {modulus} MPa (B {:.3}): {:.2} m, {} steps in {:.1} s, {}.",
            skempton(&slide, *modulus),
            runout_m(outcome),
            outcome.steps,
            outcome.simulated_s,
            ending(outcome)
        ));
    }
    Series {
        label: format!("{cell_m} m cells, {suction}"),
        points: outcomes.iter().map(|(modulus, outcome)| [modulus / 1e3, runout_m(outcome)]).collect(),
        marks: Marks::Circles,
    }
}

fn steps_per_s(outcome: &Outcome) -> f64 {
    outcome.steps as f64 / outcome.simulated_s
}

/// Storage modulus of the pore water, Q = K_w / n, and Young's modulus and Poisson's ratio of the skeleton, Pa.
fn stiffness(slide: &Slide, modulus_mpa: f64) -> (f64, f64, f64) {
    let soil = slide.model().soil;
    (modulus_mpa * 1e6 / soil.porosity, soil.youngs_modulus_pa, soil.poissons_ratio)
}

/// Skempton's B with incompressible grains: Q / (Q + K).
fn skempton(slide: &Slide, modulus_mpa: f64) -> f64 {
    let (storage, young, poisson) = stiffness(slide, modulus_mpa);
    storage / (storage + young / (3.0 * (1.0 - 2.0 * poisson)))
}

/// Speed of the undrained compression wave, m/s.
fn wave_m_s(slide: &Slide, modulus_mpa: f64) -> f64 {
    let (storage, young, poisson) = stiffness(slide, modulus_mpa);
    let constrained = young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let density = slide.unit_weight_kn_m3 * 1e3 / 9.81;
    libm::sqrt((constrained + storage) / density)
}
