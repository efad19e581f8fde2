//! B3: an elastic bar that vibrates along its axis, fixed at one end.

use super::measure::{every, mean, order, period, rms};
use super::set_up::{advance, body, elastic_body, filled};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::gimp::{Body, Grid, InitialPoints, Support};
use std::f64::consts::PI;

/// The case.
pub(super) const CASE: Case = Case {
    name: "axial-bar",
    title: "Axial vibration of an elastic bar",
    about: "A bar of 25 m (E 100 Pa, 1 kg/m3, Poisson's ratio 0), fixed at its left end and free at its \
            right, starts with the velocity v0 sin(b x), b = (2 m - 1) pi / (2 L), of its mode m; exact: v = \
            v0 sin(b x) cos(w t), w = b sqrt(E / rho) (d'Alembert). Mode 1 with v0 = 0.1 m/s for ten periods \
            of 10 s: period 0.15 %, amplitude of the centre's velocity lost 0.3 %, total energy kept to 0.5 \
            %. With v0 = 0.1 mm/s, so that no point leaves its cell, displacements are second order in h. \
            Mode 10, with that speed as well, has a wave of 5.3 m, so few cells that its period is the \
            grid's: for linear shape functions, lumped masses and points at the quarters of cells a wave \
            that turns by a = b h in a cell has w_h = (2 / dt) asin(C f sin(a / 2)), f^2 = (5 + 3 cos a) / \
            8, C = sqrt(E / rho) dt / h. sin(a / 2) is the finite element's, f comes from sending the \
            points' velocities back to the grid before strains are taken (MUSL), the arc sine from the \
            leapfrog in time. Period 0.1 % of that, and second order in h against the exact one.",
    run,
};

pub(super) const LENGTH_M: f64 = 25.0;
pub(super) const E_PA: f64 = 100.0;
pub(super) const DENSITY_KG_M3: f64 = 1.0;
const SPEED_M_S: f64 = 0.1;
/// Room for the free end, which moves by 1.6 m at 1 m/s.
const ROOM_M: f64 = 3.0;
/// Speed at which no point leaves its cell and strains are 1e-5, for orders of convergence.
const SMALL_SPEED_M_S: f64 = 1e-4;
const PERIODS: f64 = 10.0;

/// Wave number of a mode, 1/m.
pub(super) fn wave_number(mode: u32) -> f64 {
    f64::from(2 * mode - 1) * PI / (2.0 * LENGTH_M)
}

/// Frequency of a mode, rad/s.
fn frequency(mode: u32) -> f64 {
    wave_number(mode) * (E_PA / DENSITY_KG_M3).sqrt()
}

/// Steps in an eighth of the first mode's period, a cell: Courant number 0.39 for all resolutions.
const STEPS_A_CELL: f64 = 1.28;

/// What ten periods show.
struct Vibration {
    /// Velocity of the centre of mass over time.
    velocity: Vec<[f64; 2]>,
    /// Kinetic and stored energy over time.
    energy: Vec<[f64; 2]>,
    /// Root mean square error of the points' displacements after 1/8 period, over the exact amplitude.
    displacement_error: f64,
}

/// The bar with `cells` cells along it, moving in `mode` with `speed`.
pub(super) fn bar(cells: usize, mode: u32, speed: f64) -> Body {
    let h = LENGTH_M / cells as f64;
    let grid = Grid::enclosing(0.0, 0.0, [cells + (ROOM_M / h).ceil() as usize, 1], h);
    let mut points = InitialPoints::at_rest(&filled([0.0, 0.0], [cells, 1], h), 0.25 * h * h, DENSITY_KG_M3);
    for i in 0..points.len() {
        points.velocity[i] = [speed * libm::sin(wave_number(mode) * points.x[i]), 0.0];
    }
    let mut setup = elastic_body(grid, E_PA, 0.0, points);
    setup.conditions.top = Support::Roller;
    body(setup)
}

fn vibrate(cells: usize, mode: u32, speed: f64) -> Vibration {
    let (b, w) = (wave_number(mode), frequency(mode));
    let mut body = bar(cells, mode, speed);
    let start = body.setup().points.x.clone();
    let mass = DENSITY_KG_M3 * body.setup().points.volume[0];
    let exact_period = 2.0 * PI / w;

    // Equal steps, halved with the cells: a short last one would show in the order of convergence.
    let steps = STEPS_A_CELL * cells as f64;
    for _ in 0..steps as u64 {
        body.step(exact_period / 8.0 / steps);
    }
    let state = body.state();
    let amplitude = speed / w;
    let exact = |x: f64| amplitude * libm::sin(b * x) * libm::sin(PI / 4.0);
    let displacement_error = rms(state.x.iter().zip(&start).map(|(x, s)| (x - s - exact(*s)) / amplitude));

    let (mut velocity, mut energy) = (Vec::new(), Vec::new());
    advance(&mut body, (PERIODS + 0.125) * exact_period, |body| {
        let state = body.state();
        velocity.push([body.time_s(), mean(&state.vx)]);
        let kinetic: f64 = state.vx.iter().map(|v| 0.5 * mass * v * v).sum();
        let squares = state.stress_xx.iter().zip(&state.volume);
        energy.push([body.time_s(), kinetic + squares.map(|(s, v)| 0.5 * s * s / E_PA * v).sum::<f64>()]);
    });
    Vibration { velocity, energy, displacement_error }
}

fn run(depth: Depth) -> Findings {
    let resolutions: &[usize] = match depth {
        Depth::Quick => &[25, 50],
        Depth::Full => &[25, 50, 100, 200],
    };
    let mut findings = Findings::default();
    let mut errors = Vec::new();
    for &cells in resolutions {
        let vibration = vibrate(cells, 1, SPEED_M_S);
        first_mode(cells, &vibration, &mut findings.checks);
        errors.push(vibrate(cells, 1, SMALL_SPEED_M_S).displacement_error);
        if cells == resolutions[0] {
            findings.figures.push(figure(cells, &vibration));
        }
    }
    for (pair, cells) in errors.windows(2).zip(resolutions) {
        let what = format!("order of the displacement's error in h, mode 1, {cells} to {} cells", 2 * cells);
        findings.checks.push(Check::at_least(what, "", 1.8, order(pair[0], pair[1])));
    }
    tenth_mode(resolutions, &mut findings.checks);
    findings
}

fn first_mode(cells: usize, vibration: &Vibration, checks: &mut Vec<Check>) {
    let exact = 2.0 * PI / frequency(1);
    let what = format!("period, mode 1, {cells} cells");
    checks.push(Check::relative(what, "s", exact, period(&vibration.velocity), 1.5e-3));

    let between = |from: f64, to: f64| vibration.velocity.iter().filter(move |v| v[0] > from && v[0] < to);
    let peak = |from: f64, to: f64| between(from * exact, to * exact).map(|v| v[1].abs()).fold(0.0, f64::max);
    let (first, last) = (peak(0.25, 1.25), peak(PERIODS - 1.0, PERIODS));
    let what = format!("velocity amplitude of the centre, mode 1, {cells} cells");
    let amplitude = SPEED_M_S / (wave_number(1) * LENGTH_M);
    checks.push(Check::relative(what, "m/s", amplitude, first, 5e-3));
    let what = format!("velocity amplitude after {PERIODS} periods over the first, mode 1, {cells} cells");
    checks.push(Check::relative(what, "", 1.0, last / first, 3e-3));

    // Stresses lag velocities by half a step, which shows as a ripple: means over a period are compared.
    let energy = |from: f64| {
        let of = vibration.energy.iter().filter(|e| e[0] > from * exact && e[0] < (from + 1.0) * exact);
        mean(&of.map(|e| e[1]).collect::<Vec<_>>())
    };
    let what = format!("total energy in the last period over the first, mode 1, {cells} cells");
    checks.push(Check::relative(what, "", 1.0, energy(PERIODS - 1.0) / energy(0.125), 5e-3));
}

/// Period of a mode on the grid (see the case's description), s.
fn period_on_grid(mode: u32, cells: usize, step_s: f64) -> f64 {
    let h = LENGTH_M / cells as f64;
    let turn = wave_number(mode) * h;
    let back_to_grid = ((5.0 + 3.0 * libm::cos(turn)) / 8.0).sqrt();
    let courant = (E_PA / DENSITY_KG_M3).sqrt() * step_s / h;
    PI * step_s / libm::asin(courant * back_to_grid * libm::sin(turn / 2.0))
}

fn tenth_mode(resolutions: &[usize], checks: &mut Vec<Check>) {
    let exact = 2.0 * PI / frequency(10);
    let mut errors = Vec::new();
    for &cells in resolutions {
        let found = period(&vibrate(cells, 10, SMALL_SPEED_M_S).velocity);
        let reference = period_on_grid(10, cells, bar(cells, 10, SMALL_SPEED_M_S).stable_step_s());
        let what = format!("period against the grid's, mode 10, {cells} cells");
        checks.push(Check::relative(what, "s", reference, found, 1e-3));
        let what = format!("period against the exact one, mode 10, {cells} cells");
        checks.push(Check::information(what, "s", exact, found));
        errors.push(found / exact - 1.0);
    }
    for (pair, cells) in errors.windows(2).zip(resolutions) {
        let what = format!("order of the period's error in h, mode 10, {cells} to {} cells", 2 * cells);
        checks.push(Check::at_least(what, "", 1.8, order(pair[0], pair[1])));
    }
}

fn figure(cells: usize, vibration: &Vibration) -> Figure {
    let amplitude = SPEED_M_S / (wave_number(1) * LENGTH_M);
    let exact = |t: f64| [t, 1e3 * amplitude * libm::cos(frequency(1) * t)];
    let found: Vec<[f64; 2]> = vibration.velocity.iter().map(|v| [v[0], 1e3 * v[1]]).collect();
    Figure {
        name: "velocity".to_owned(),
        title: format!("Velocity of the centre of mass, mode 1, {cells} cells, first three periods"),
        x: "time (s)".to_owned(),
        y: "velocity (mm/s)".to_owned(),
        equal_axes: false,
        series: vec![
            Series::line("d'Alembert", (0..=300).map(|k| exact(0.1 * f64::from(k))).collect()),
            Series::circles("found", every(&found, 30.0, 60)),
        ],
    }
}
