//! Mesh and time step of one clear failure.

use super::{EXAMPLE_I, Slide, TWO_PHASE, check, ending, runout_m};
use crate::validation::{Case, Check, Comparison, Depth, Figure, Findings, Marks, Series};

pub(in crate::validation) const CONVERGENCE: Case = Case {
    name: "slope-convergence",
    title: "Mesh and time step of one slide",
    about: "The reference paper's Example I with its printed mean strength (factor of safety 0.845), B-bar and a \
little PIC, no softening. Time step: Courant numbers 0.4 and 0.2 against 0.8; the gate of 2 per cent is what an \
independent code showed between 0.25 and 0.8 with B-bar (1.7 per cent). Scatter: plastic flow amplifies round-off, so \
that five time steps within 5 per cent of each other give five runouts; their range is the scatter of one mesh. Mesh: \
perfect plasticity has no length scale, bands are as thin as the cells allow, and the runout grows with refinement; an \
independent code with B-bar showed 10 to 15 per cent per halving from 0.8 m cells on. The gate is 20 per cent from 0.8 \
to 0.4 m (19 cells over the height at the coarse end), and each halving must change less than the one before. The step \
to 0.2 m is shown without a gate: 14 per cent in one phase and 15 per cent in two were found, above the 10 per cent one \
would wish for, so that the runout of a perfectly plastic slope is not converged at any of these cells.",
    run,
};

const TIME_STEP_TOLERANCE: f64 = 0.02;

/// Cells of the meshes, m, coarse to fine, and how much the runout may change to each from the one before.
const QUICK_CELLS: [(f64, f64); 3] = [(1.6, f64::INFINITY), (0.8, f64::INFINITY), (0.4, 0.20)];
const FULL_CELLS: [(f64, f64); 4] =
    [(1.6, f64::INFINITY), (0.8, f64::INFINITY), (0.4, 0.20), (0.2, f64::INFINITY)];

/// Five time steps within 5 per cent.
const NEARBY_COURANT: [f64; 5] = [0.80, 0.79, 0.78, 0.77, 0.76];

fn run(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    let one_phase = "one phase";
    time_step(&mut findings, one_phase, Slide { cell_m: 0.8, ..EXAMPLE_I });
    scatter(&mut findings, one_phase, Slide { cell_m: 0.8, ..EXAMPLE_I });
    let mut series = Vec::new();
    match depth {
        Depth::Quick => series.push(mesh(&mut findings, one_phase, EXAMPLE_I, &QUICK_CELLS)),
        Depth::Full => {
            series.push(mesh(&mut findings, one_phase, EXAMPLE_I, &FULL_CELLS));
            time_step(&mut findings, one_phase, EXAMPLE_I);
            scatter(&mut findings, one_phase, EXAMPLE_I);
            let two_phase = "two phases";
            time_step(&mut findings, two_phase, Slide { cell_m: 0.8, ..TWO_PHASE });
            scatter(&mut findings, two_phase, Slide { cell_m: 0.8, ..TWO_PHASE });
            series.push(mesh(&mut findings, two_phase, TWO_PHASE, &FULL_CELLS));
        }
    }
    findings.figures.push(Figure {
        name: "mesh".into(),
        title: "Displacement against cell size".into(),
        x: "cell size, m".into(),
        y: "99.9 % quantile of displacement, m".into(),
        equal_axes: false,
        series,
    });
    findings
}

fn time_step(findings: &mut Findings, phases: &str, slide: Slide) {
    let at = |courant: f64| runout_m(&Slide { courant, ..slide }.run());
    let reference = at(0.8);
    for courant in [0.4, 0.2] {
        let what =
            format!("displacement, {phases}, {} m cells, Courant number {courant} against 0.8", slide.cell_m);
        let tolerance = Comparison::Relative(TIME_STEP_TOLERANCE);
        findings.checks.push(check(what, "m", reference, at(courant), tolerance));
    }
}

fn scatter(findings: &mut Findings, phases: &str, slide: Slide) {
    let runouts = NEARBY_COURANT.map(|courant| runout_m(&Slide { courant, ..slide }.run()));
    let mean = runouts.iter().sum::<f64>() / runouts.len() as f64;
    let largest = runouts.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = runouts.iter().copied().fold(f64::INFINITY, f64::min);
    let what = format!(
        "scatter over five neighbouring time steps (range over mean), {phases}, {} m cells",
        slide.cell_m
    );
    let range = if mean.is_finite() { (largest - smallest) / mean } else { f64::NAN };
    findings.checks.push(check(what, "", TIME_STEP_TOLERANCE, range, Comparison::AtMost));
}

fn mesh(findings: &mut Findings, phases: &str, slide: Slide, cells: &[(f64, f64)]) -> Series {
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut changes = Vec::new();
    for &(cell_m, tolerance) in cells {
        let outcome = Slide { cell_m, ..slide }.run();
        let found = runout_m(&outcome);
        if let Some(&[coarse_m, coarse]) = points.last() {
            let what = format!("displacement, {phases}, {cell_m} against {coarse_m} m cells");
            let comparison =
                if tolerance.is_finite() { Comparison::Relative(tolerance) } else { Comparison::Information };
            findings.checks.push(check(what, "m", coarse, found, comparison));
            changes.push(found / coarse - 1.0);
        }
        let measures = outcome.measures.as_ref();
        findings.notes.push(format!(
            "{phases}, {cell_m} m cells: toe advance {:.2} m, largest displacement {:.2} m, {} steps, {}.",
            measures.map_or(f64::NAN, |m| m.toe_advance_m),
            measures.map_or(f64::NAN, |m| m.max_displacement_m),
            outcome.steps,
            ending(&outcome)
        ));
        points.push([cell_m, found]);
    }
    findings.checks.extend(falling(phases, &changes));
    Series { label: phases.into(), points, marks: Marks::Circles }
}

/// Each halving of the cell must change the runout less than the one before.
fn falling(phases: &str, changes: &[f64]) -> Vec<Check> {
    let ratio = |pair: &[f64]| (pair[1] / pair[0]).abs();
    let what = |k: usize| format!("change by halving {} over change by halving {}, {phases}", k + 2, k + 1);
    changes
        .windows(2)
        .enumerate()
        .map(|(k, pair)| check(what(k), "", 1.0, ratio(pair), Comparison::AtMost))
        .collect()
}
