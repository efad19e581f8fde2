//! B11: points that cross cells.

use super::axial_bar::{self, E_PA, LENGTH_M};
use super::measure::{order, rms};
use super::set_up::{advance, body, elastic_body, filled};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::campaign::PointDomain;
use crate::gimp::{Body, Grid, InitialPoints, Support};

/// The case.
pub(super) const CASE: Case = Case {
    name: "grid-crossing",
    title: "Points that cross cells",
    about: "The bar of the case axial-bar in its first mode, started at 1 m/s: strains reach 10 %, and the \
            free end moves by 1.6 m, through cells of 1 m. Where a point crosses into another cell, the \
            gradients of the material point method jump; those of the generalized one (uGIMP) do not. The \
            same body is run with points of a thousandth of a cell, which is the material point method. \
            Reference: finite differences on 1000 elements that move with the bar, with the solver's law \
            sigma = E ln(stretch). Tolerances: root mean square error of the points' stress over one period \
            below 1/5 of the material point method's; neighbouring points keep their order. The error of \
            uGIMP itself grows where the mesh is refined under the same displacement: points spread by 10 % \
            leave parts of a cell to no point (Steffen, Wallstedt, Guilkey, Kirby & Berzins 2008); domains \
            that follow the stretch converge, from 25 to 50 cells with the first order (at least 0.8), as \
            the points' staircase does. A block that only moves, across ten cells, must stay free of stress: \
            1e-12 E.",
    run,
};

const SPEED_M_S: f64 = 1.0;
const PERIOD_S: f64 = 10.0;
const ELEMENTS: usize = 1000;
/// Times at which stresses are compared in one period.
const SAMPLES: u32 = 20;
/// Points per cell and direction that make a point's length a thousandth of a cell.
const NO_LENGTH: u32 = 1000;

/// Stress of a bar whose law is sigma = E ln(stretch) in elements that move with it, one row a time.
fn reference(times: &[f64]) -> Vec<Vec<f64>> {
    let dx = LENGTH_M / ELEMENTS as f64;
    let wave = (E_PA / axial_bar::DENSITY_KG_M3).sqrt();
    let longest = 0.4 * dx / wave;
    let b = axial_bar::wave_number(1);
    let mut v: Vec<f64> = (0..=ELEMENTS).map(|j| SPEED_M_S * libm::sin(b * j as f64 * dx)).collect();
    let mut u = vec![0.0; ELEMENTS + 1];
    let mut stress = vec![0.0; ELEMENTS];
    let mut time = 0.0;
    let mut rows = Vec::new();
    for &end in times {
        let steps = ((end - time) / longest).ceil();
        let dt = (end - time) / steps;
        for _ in 0..steps as u64 {
            for j in 1..=ELEMENTS {
                let (right, share) = if j == ELEMENTS { (0.0, 0.5) } else { (stress[j], 1.0) };
                v[j] += dt * (right - stress[j - 1]) / (axial_bar::DENSITY_KG_M3 * dx * share);
            }
            for j in 1..=ELEMENTS {
                u[j] += dt * v[j];
            }
            for j in 0..ELEMENTS {
                stress[j] = E_PA * libm::log1p((u[j + 1] - u[j]) / dx);
            }
        }
        time = end;
        rows.push(stress.clone());
    }
    rows
}

/// Error of the points' stress over the largest exact one, all samples together, and the stress at three quarters
/// of a period.
fn compare(mut bar: Body, times: &[f64], reference: &[Vec<f64>]) -> (f64, Vec<[f64; 2]>, bool) {
    let start = bar.setup().points.x.clone();
    let scale = reference.iter().flatten().fold(0.0, |a: f64, s| a.max(s.abs()));
    let (mut errors, mut profile, mut in_order) = (Vec::new(), Vec::new(), true);
    for (k, (&time, row)) in times.iter().zip(reference).enumerate() {
        advance(&mut bar, time, |_| {});
        let state = bar.state();
        let element = |x: f64| ((x / LENGTH_M * ELEMENTS as f64) as usize).min(ELEMENTS - 1);
        errors.extend(state.stress_xx.iter().zip(&start).map(|(s, x)| (s - row[element(*x)]) / scale));
        let lower = start.len() / 2;
        in_order &= state.x[..lower].windows(2).all(|pair| pair[0] < pair[1]);
        if 4 * (k + 1) == 3 * times.len() {
            profile = state.stress_xx[..lower].iter().zip(&start).map(|(s, x)| [*x, *s]).collect();
        }
    }
    (rms(errors), profile, in_order)
}

fn run(depth: Depth) -> Findings {
    let resolutions: &[usize] = match depth {
        Depth::Quick => &[25, 50],
        Depth::Full => &[25, 50, 100],
    };
    let times: Vec<f64> = (1..=SAMPLES).map(|k| PERIOD_S * f64::from(k) / f64::from(SAMPLES)).collect();
    let reference = reference(&times);
    let mut findings = Findings::default();
    let mut stretching_errors = Vec::new();
    for &cells in resolutions {
        let bar = axial_bar::bar(cells, 1, SPEED_M_S);
        let mut no_length = bar.setup().clone();
        no_length.points_per_cell_side = NO_LENGTH;
        let mut stretching = bar.setup().clone();
        stretching.controls.point_domain = PointDomain::Stretched;
        let (gimp, profile, in_order) = compare(bar, &times, &reference);
        let (mpm, jumpy, _) = compare(body(no_length), &times, &reference);
        let what = format!("rms stress error of uGIMP over that of the material point method, {cells} cells");
        // Stated for 25 cells; with cells smaller than the spread of the points uGIMP ends where the other one
        // starts.
        findings.checks.push(if cells <= 50 {
            Check::at_most(what, "", 0.2, gimp / mpm)
        } else {
            Check::information(what, "", 0.2, gimp / mpm)
        });
        let (stretching, _, _) = compare(body(stretching), &times, &reference);
        stretching_errors.push(stretching);
        for (error, scheme) in
            [(mpm, "the material point method"), (gimp, "uGIMP"), (stretching, "stretched domains")]
        {
            let what = format!("rms stress error of {scheme} over the largest stress, {cells} cells");
            findings.checks.push(Check::information(what, "", 0.0, error));
        }
        let what = format!("points in order (1: all), {cells} cells");
        findings.checks.push(Check::at_least(what, "", 1.0, f64::from(u8::from(in_order))));
        if cells == resolutions[0] {
            let row = &reference[3 * SAMPLES as usize / 4 - 1];
            let line =
                row.iter().enumerate().map(|(j, s)| [(j as f64 + 0.5) * LENGTH_M / ELEMENTS as f64, *s]);
            findings.figures.push(Figure {
                name: "stress".to_owned(),
                title: format!("Axial stress after 3/4 of the period, {cells} cells"),
                x: "place in the undeformed bar (m)".to_owned(),
                y: "axial stress (Pa)".to_owned(),
                equal_axes: false,
                series: vec![
                    Series::line("finite differences", line.collect()),
                    Series::circles("uGIMP", profile),
                    Series::circles("material point method", jumpy),
                ],
            });
        }
    }
    for (pair, cells) in stretching_errors.windows(2).zip(resolutions) {
        let what = format!("order of the stress error of stretched domains, {cells} to {} cells", 2 * cells);
        let found = order(pair[0], pair[1]);
        findings.checks.push(if *cells == resolutions[0] {
            Check::at_least(what, "", 0.8, found)
        } else {
            Check::information(what, "", 1.0, found)
        });
    }
    findings.checks.push(moving_block());
    findings
}

/// An unstressed block of four by four cells on its way across ten cells.
fn moving_block() -> Check {
    let (h, e) = (0.5, 10e6);
    let positions = filled([h, h], [4, 4], h);
    let mut points = InitialPoints::at_rest(&positions, 0.25 * h * h, 2000.0);
    points.velocity.fill([1.0, 0.5]);
    let mut setup = elastic_body(Grid::enclosing(0.0, 0.0, [20, 14], h), e, 0.3, points);
    setup.conditions.left = Support::Open;
    setup.conditions.bottom = Support::Open;
    let mut body = body(setup);
    advance(&mut body, 10.0 * h, |_| {});
    let state = body.state();
    let all = [&state.stress_xx, &state.stress_yy, &state.stress_zz, &state.stress_xy];
    let largest = all.iter().flat_map(|s| s.iter()).fold(0.0, |a: f64, s| a.max(s.abs()));
    Check::at_most("largest stress of a block moved across ten cells, over E", "", 1e-12, largest / e)
}
