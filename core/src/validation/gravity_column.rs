//! B1: an elastic column under its own weight, at rest and struck by sudden gravity.

use super::measure::{every, mean, order, period, rms, row_centres, row_means};
use super::set_up::{GRAVITY_M_S2, advance, body, column};
use super::{Case, Check, Depth, Figure, Findings, Series};

/// The case.
pub(super) const CASE: Case = Case {
    name: "gravity-column",
    title: "Elastic column under its own weight",
    about: "A laterally confined elastic column of 10 m (E 100 MPa, Poisson's ratio 0.3, 2000 kg/m3) comes \
            to rest under gravity with local damping. Closed forms: stress -rho g (H - y), lateral stress nu \
            / (1 - nu) times that, settlement of the top rho g H^2 / (2 E_c) with the constrained modulus \
            E_c; strains are 0.1 %, so that small-strain theory errs by that much of the settlement. \
            Tolerances: 0.2 % for settlement and cell means. The points' own stresses are a staircase, whose \
            root mean square distance from the linear profile is h / 4 times its slope for points at the \
            quarters of a cell: 5 % of that, and first order in h, as long as the settlement moves no point \
            by more than a few percent of a cell. Without damping, sudden gravity swings the column: the \
            stress at the base is a triangle in time from 0 to 2 rho g H with the period 4 H / c of a bar's \
            first mode (d'Alembert's solution); period 0.5 %, mean over a period 1 %.",
    run,
};

const HEIGHT_M: f64 = 10.0;
const E_PA: f64 = 100e6;
const NU: f64 = 0.3;
const DENSITY_KG_M3: f64 = 2000.0;
/// Local damping and time (20 natural periods) that bring the column to rest.
const DAMPING: f64 = 0.7;
const REST_AFTER_S: f64 = 3.0;
/// Periods that the undamped column is watched for.
const PERIODS: f64 = 10.0;

/// Constrained modulus, Pa.
fn constrained_modulus() -> f64 {
    E_PA * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))
}

fn vertical_stress(y: f64) -> f64 {
    -DENSITY_KG_M3 * GRAVITY_M_S2 * (HEIGHT_M - y)
}

fn run(depth: Depth) -> Findings {
    let resolutions: &[usize] = match depth {
        Depth::Quick => &[10, 20],
        Depth::Full => &[10, 20, 40],
    };
    let mut findings = Findings::default();
    let (mut staircases, mut means) = (Vec::new(), Vec::new());
    for &cells in resolutions {
        let (staircase, profile) = at_rest(cells, &mut findings.checks);
        staircases.push(staircase);
        means.push(profile);
    }
    for (pair, cells) in staircases.windows(2).zip(resolutions) {
        let what = format!("order of the points' stress in h, {cells} to {} cells", 2 * cells);
        findings.checks.push(Check::absolute(what, "", 1.0, order(pair[0], pair[1]), 0.05));
    }
    let line = [0.0, HEIGHT_M].map(|y| [1e-3 * vertical_stress(y), y]).to_vec();
    findings.figures.push(Figure {
        name: "stress".to_owned(),
        title: format!("Vertical stress at rest, {} cells", resolutions[0]),
        x: "vertical stress (kPa)".to_owned(),
        y: "elevation (m)".to_owned(),
        equal_axes: false,
        series: vec![Series::line("closed form", line), Series::circles("cell means", means.swap_remove(0))],
    });
    sudden_gravity(resolutions[1], &mut findings);
    findings
}

/// Checks the column at rest; returns the root mean square of the staircase over rho g H and the cell means.
fn at_rest(cells: usize, checks: &mut Vec<Check>) -> (f64, Vec<[f64; 2]>) {
    let h = HEIGHT_M / cells as f64;
    let mut setup = column(cells, HEIGHT_M, DENSITY_KG_M3, E_PA, NU);
    setup.conditions.gravity_m_s2 = [0.0, -GRAVITY_M_S2];
    setup.controls.local_damping = DAMPING;
    let start = setup.points.y.clone();
    let mut body = body(setup);
    advance(&mut body, REST_AFTER_S, |_| {});
    let state = body.state();

    let moved = |point: usize| start[point] - state.y[point];
    // The surface lies half a point's distance beyond the last row; displacements are linear within a cell.
    let (last, before) = (start.len() - 1, start.len() - 3);
    let surface = moved(last) + 0.5 * (moved(last) - moved(before));
    let what = format!("settlement of the surface, {cells} cells");
    let reference = DENSITY_KG_M3 * GRAVITY_M_S2 * HEIGHT_M * HEIGHT_M / (2.0 * constrained_modulus());
    checks.push(Check::relative(what, "m", reference, surface, 2e-3));

    let scale = DENSITY_KG_M3 * GRAVITY_M_S2 * HEIGHT_M;
    let rows = row_means(&start, &state.stress_yy, cells, h);
    let centres = row_centres(cells, h);
    let worst =
        rows.iter().zip(&centres).map(|(s, y)| (s - vertical_stress(*y)).abs() / scale).fold(0.0, f64::max);
    let what = format!("largest error of a cell's vertical stress over rho g H, {cells} cells");
    checks.push(Check::at_most(what, "", 2e-3, worst));

    let ratio = state.stress_xx.iter().zip(&state.stress_yy).map(|(x, y)| x / y);
    let worst = ratio.map(|r| (r / (NU / (1.0 - NU)) - 1.0).abs()).fold(0.0, f64::max);
    let what = format!("largest relative error of lateral over vertical stress, {cells} cells");
    checks.push(Check::at_most(what, "", 1e-4, worst));

    let staircase = rms(start.iter().zip(&state.stress_yy).map(|(y, s)| (s - vertical_stress(*y)) / scale));
    let what = format!("rms of the points' stress staircase over rho g H, {cells} cells");
    checks.push(Check::relative(what, "", h / (4.0 * HEIGHT_M), staircase, 0.05));
    (staircase, rows.iter().zip(&centres).map(|(s, y)| [1e-3 * s, *y]).collect())
}

/// Gravity from the first step, without damping.
fn sudden_gravity(cells: usize, findings: &mut Findings) {
    let mut setup = column(cells, HEIGHT_M, DENSITY_KG_M3, E_PA, NU);
    setup.conditions.gravity_m_s2 = [0.0, -GRAVITY_M_S2];
    let natural = 4.0 * HEIGHT_M / (constrained_modulus() / DENSITY_KG_M3).sqrt();
    let scale = DENSITY_KG_M3 * GRAVITY_M_S2 * HEIGHT_M;
    let mut body = body(setup);
    let (mut velocity, mut base) = (Vec::new(), Vec::new());
    advance(&mut body, PERIODS * natural, |body| {
        let state = body.state();
        velocity.push([body.time_s(), mean(&state.vy)]);
        // The lowest cell's four points.
        base.push([body.time_s() / natural, -mean(&state.stress_yy[..4]) / scale]);
    });
    let what = format!("period after sudden gravity, {PERIODS} periods, {cells} cells");
    findings.checks.push(Check::relative(what, "s", natural, period(&velocity), 5e-3));
    let middle = 1.0 - 0.5 / cells as f64;
    let average = mean(&base.iter().map(|b| b[1]).collect::<Vec<_>>());
    let what = format!("mean stress of the lowest cell over rho g H, {PERIODS} periods, {cells} cells");
    findings.checks.push(Check::relative(what, "", middle, average, 0.01));
    let peak = base.iter().filter(|b| b[0] < 1.0).map(|b| b[1]).fold(0.0, f64::max);
    let what = format!("first peak of the lowest cell's stress over rho g H, {cells} cells");
    findings.checks.push(Check::information(what, "", 2.0 * middle, peak));

    let triangle = (0..=6).map(|k| [0.5 * f64::from(k), if k % 2 == 0 { 0.0 } else { 2.0 }]).collect();
    findings.figures.push(Figure {
        name: "sudden-gravity".to_owned(),
        title: format!("Sudden gravity, undamped, {cells} cells"),
        x: "time over 4 H / c".to_owned(),
        y: "stress at the base over rho g H".to_owned(),
        equal_axes: false,
        series: vec![
            Series::line("d'Alembert", triangle),
            Series::circles("lowest cell", every(&base, 3.0, 120)),
        ],
    });
}
