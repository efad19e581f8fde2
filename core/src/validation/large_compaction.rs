//! B2: a soft column that its own weight compacts to a fraction of its height.

use super::measure::{order, rms, row_centres, row_means};
use super::set_up::{advance, body, column};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::campaign::PointDomain;
use crate::gimp::{Body, Setup};

/// The case.
pub(super) const CASE: Case = Case {
    name: "large-compaction",
    title: "Compaction of a soft column",
    about: "A column of 50 m (Poisson's ratio 0, 80 kg/m3, g 10 m/s2) under its own weight, put on in ten \
            parts. In one dimension the Cauchy stress on a horizontal plane is the weight above it, -rho0 g \
            (H0 - Y), for any law. The solver's rate form integrates to sigma = E ln(stretch), so that the \
            stretch is exp(-rho0 g (H0 - Y) / E), and the height at rest is E / (rho0 g) (1 - exp(-rho0 g H0 \
            / E)). With E = 40 kPa the base is compacted to exp(-1) = 0.37, as much as with the benchmark's \
            own hyperelastic law and its E = 10 kPa (0.30; Charlton, Coombs & Augarde 2017, Computers & \
            Structures 190). Tolerances as published for it at 25 cells or more: 1 % of the height, 2 % of \
            the base stress for the root mean square error of the stress averaged over what was a cell. With \
            E = 10 kPa this law compacts the base to exp(-4) = 0.018, so that a cell of 2 m at the base \
            holds more than half of the mass: information.",
    run,
};

const HEIGHT_M: f64 = 50.0;
const DENSITY_KG_M3: f64 = 80.0;
const WEIGHT_N_M3: f64 = DENSITY_KG_M3 * 10.0;
/// Young's modulus of the gate and of the benchmark, Pa.
const E_PA: f64 = 40e3;
const SOFT_E_PA: f64 = 10e3;
/// Parts in which gravity is put on, so that no inertia compacts more than the weight does.
const PARTS: u32 = 10;
/// Travel times of the uncompacted column for which each part is let settle.
const TRAVELS: f64 = 10.0;

/// Elevation at rest of what was at `y`, m: the integral of the stretch.
fn at_rest(e: f64, y: f64) -> f64 {
    let stretch = |y: f64| libm::exp(-WEIGHT_N_M3 * (HEIGHT_M - y) / e);
    e / WEIGHT_N_M3 * (stretch(y) - stretch(0.0))
}

fn run(depth: Depth) -> Findings {
    let resolutions: &[usize] = match depth {
        Depth::Quick => &[25, 50],
        Depth::Full => &[25, 50, 100],
    };
    let mut findings = Findings::default();
    let mut errors = Vec::new();
    for &cells in resolutions {
        let Profile { height, stress_error, figure } = compact(cells, E_PA, PointDomain::Uniform);
        let reference = at_rest(E_PA, HEIGHT_M);
        findings.checks.push(Check::relative(
            format!("height at rest, {cells} cells"),
            "m",
            reference,
            height,
            0.01,
        ));
        let what = format!("rms error of the stress over that at the base, {cells} cells");
        findings.checks.push(Check::at_most(what, "", 0.02, stress_error));
        errors.push(height / reference - 1.0);
        if cells == resolutions[0] {
            findings.figures.push(figure);
        }
    }
    for (pair, cells) in errors.windows(2).zip(resolutions) {
        let what = format!("order of the height's error in h, {cells} to {} cells", 2 * cells);
        findings.checks.push(Check::information(what, "", 2.0, order(pair[0], pair[1])));
    }
    for &cells in resolutions {
        for (domain, name) in [(PointDomain::Uniform, "uniform"), (PointDomain::Stretched, "stretched")] {
            let height = compact(cells, SOFT_E_PA, domain).height;
            let what = format!("height at rest, E = 10 kPa, {name} domains, {cells} cells");
            findings.checks.push(Check::information(what, "m", at_rest(SOFT_E_PA, HEIGHT_M), height));
        }
    }
    findings
}

struct Profile {
    height: f64,
    stress_error: f64,
    figure: Figure,
}

/// The setup with the points as `body` has left them and `share` of the whole gravity.
fn carry_on(setup: &Setup, body: &Body, share: f64) -> Setup {
    let state = body.state();
    let mut next = setup.clone();
    next.conditions.gravity_m_s2 = [0.0, -10.0 * share];
    for i in 0..state.x.len() {
        next.points.velocity[i] = [state.vx[i], state.vy[i]];
        next.points.stress[i] =
            [state.stress_xx[i], state.stress_yy[i], state.stress_zz[i], state.stress_xy[i]];
        next.points.density[i] = DENSITY_KG_M3 * setup.points.volume[i] / state.volume[i];
    }
    (next.points.x, next.points.y, next.points.volume) = (state.x, state.y, state.volume);
    next
}

fn compact(cells: usize, e: f64, domain: PointDomain) -> Profile {
    let h = HEIGHT_M / cells as f64;
    let mut setup = column(cells, HEIGHT_M, DENSITY_KG_M3, e, 0.0);
    setup.controls.local_damping = 0.7;
    setup.controls.point_domain = domain;
    let start = setup.points.y.clone();
    let settle_s = TRAVELS * HEIGHT_M / (e / DENSITY_KG_M3).sqrt();
    let mut current = body(setup.clone());
    for part in 1..=PARTS {
        current = body(carry_on(&setup, &current, f64::from(part) / f64::from(PARTS)));
        advance(&mut current, settle_s, |_| {});
    }
    let state = current.state();

    let (last, before) = (start.len() - 1, start.len() - 3);
    let height = state.y[last] + 0.5 * (state.y[last] - state.y[before]);
    let stress = |y: f64| -WEIGHT_N_M3 * (HEIGHT_M - y);
    let means = row_means(&start, &state.stress_yy, cells, h);
    let errors = means.iter().zip(row_centres(cells, h)).map(|(s, y)| (s - stress(y)) / stress(0.0));
    let stress_error = rms(errors);

    let line = (0..=100).map(|k| 0.5 * f64::from(k)).map(|y| [1e-3 * stress(y), at_rest(e, y)]).collect();
    let heights = row_means(&start, &state.y, cells, h);
    let found = means.iter().zip(&heights).map(|(s, y)| [1e-3 * s, *y]).collect();
    let figure = Figure {
        name: "stress".to_owned(),
        title: format!("Vertical stress at rest, E = {} kPa, {cells} cells", 1e-3 * e),
        x: "vertical stress (kPa)".to_owned(),
        y: "elevation at rest (m)".to_owned(),
        equal_axes: false,
        series: vec![Series::line("closed form", line), Series::circles("means over what were cells", found)],
    };
    Profile { height, stress_error, figure }
}
