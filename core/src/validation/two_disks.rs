//! B10: two elastic disks collide and rebound.

use super::set_up::{body, elastic_body, filled};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::gimp::{Body, Grid, InitialPoints, State, Support};

/// The case.
pub(super) const CASE: Case = Case {
    name: "two-disks",
    title: "Collision of two elastic disks",
    about: "Two disks of radius 0.2 m (E 1000 Pa, Poisson's ratio 0.3, 1000 kg/m3, plane strain) approach \
            each other at (0.1, 0.1) and (-0.1, -0.1) m/s, after Sulsky, Chen & Schreyer (1994). Exact: \
            momentum 0; their surfaces meet at 1.586 s, on a grid earlier by the time they need for 2.5 \
            cells along each axis, the reach of two points' shape functions. Tolerances: momentum 1e-12 of \
            one disk's, at 3.5 s less than 5 % of kinetic plus stored energy lost, largest kinetic energy \
            after the rebound above 90 % (typical of published results for the undamped scheme). Stored \
            energy is that of small strains, so that the sum dips while the disks are flattened.",
    run,
};

const RADIUS_M: f64 = 0.2;
const E_PA: f64 = 1000.0;
const NU: f64 = 0.3;
const DENSITY_KG_M3: f64 = 1000.0;
const SPEED_M_S: f64 = 0.1;
const CENTRES_M: [f64; 2] = [0.2, 0.8];
const END_S: f64 = 3.5;

fn disks(cells: usize) -> Body {
    let h = 1.0 / cells as f64;
    let within =
        |p: &[f64; 2], c: f64| (p[0] - c) * (p[0] - c) + (p[1] - c) * (p[1] - c) < RADIUS_M * RADIUS_M;
    let all = filled([0.0, 0.0], [cells, cells], h);
    let mut positions: Vec<[f64; 2]> = Vec::new();
    for centre in CENTRES_M {
        positions.extend(all.iter().filter(|p| within(p, centre)));
    }
    let mut points = InitialPoints::at_rest(&positions, 0.25 * h * h, DENSITY_KG_M3);
    for i in 0..points.len() {
        let speed = if points.x[i] + points.y[i] < 1.0 { SPEED_M_S } else { -SPEED_M_S };
        points.velocity[i] = [speed; 2];
    }
    let mut setup = elastic_body(Grid::enclosing(0.0, 0.0, [cells, cells], h), E_PA, NU, points);
    setup.conditions.left = Support::Open;
    setup.conditions.bottom = Support::Open;
    body(setup)
}

/// Kinetic energy, and the energy stored in linear elasticity: (s:s - nu / (1 + nu) tr(s)^2) (1 + nu) / (2 E) per
/// volume.
fn energies(state: &State, mass: f64) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for i in 0..state.x.len() {
        let (xx, yy, zz, xy) =
            (state.stress_xx[i], state.stress_yy[i], state.stress_zz[i], state.stress_xy[i]);
        let squares = xx * xx + yy * yy + zz * zz + 2.0 * xy * xy;
        let trace = xx + yy + zz;
        sums[0] += 0.5 * mass * (state.vx[i] * state.vx[i] + state.vy[i] * state.vy[i]);
        sums[1] += state.volume[i] * ((1.0 + NU) * squares - NU * trace * trace) / (2.0 * E_PA);
    }
    sums
}

fn run(depth: Depth) -> Findings {
    let resolutions: &[usize] = match depth {
        Depth::Quick => &[20, 40],
        Depth::Full => &[20, 40, 80],
    };
    let mut findings = Findings::default();
    for &cells in resolutions {
        collide(cells, cells == resolutions[0], &mut findings);
    }
    findings
}

fn collide(cells: usize, draw: bool, findings: &mut Findings) {
    let h = 1.0 / cells as f64;
    let mut body = disks(cells);
    let mass = DENSITY_KG_M3 * body.setup().points.volume[0];
    let [kinetic_0, _] = energies(&body.state(), mass);
    let one_disk = 0.5 * mass * body.setup().points.len() as f64 * SPEED_M_S;
    let (mut history, mut drift, mut contact) = (Vec::new(), 0.0_f64, f64::NAN);
    let mut pictures = vec![outline(&body.state())];
    while body.time_s() < END_S {
        let step = body.stable_step_s();
        body.step(step);
        let state = body.state();
        let [kinetic, stored] = energies(&state, mass);
        history.push([body.time_s(), kinetic, stored]);
        for velocity in [&state.vx, &state.vy] {
            drift = drift.max((mass * velocity.iter().sum::<f64>()).abs() / one_disk);
        }
        if contact.is_nan() && kinetic < 0.999 * kinetic_0 {
            contact = body.time_s();
        }
        if pictures.len() == 1 && body.time_s() > 1.8 {
            pictures.push(outline(&state));
        }
    }
    pictures.push(outline(&body.state()));
    let end = history[history.len() - 1];

    let what = format!("kinetic energy at the start, h = {h} m");
    let exact = std::f64::consts::PI * RADIUS_M * RADIUS_M * DENSITY_KG_M3 * 2.0 * SPEED_M_S * SPEED_M_S;
    findings.checks.push(Check::information(what, "J/m", exact, kinetic_0));
    let what = format!("largest momentum over one disk's, h = {h} m");
    findings.checks.push(Check::at_most(what, "", 1e-12, drift));
    let what = format!("kinetic and stored energy at the end over the start, h = {h} m");
    findings.checks.push(Check::at_least(what, "", 0.95, (end[1] + end[2]) / kinetic_0));
    // Half way through contact the energy is stored; what is left after the rebound swings between the disks'
    // motion and vibration.
    let turn =
        history.iter().map(|e| e[2]).enumerate().fold((0, 0.0), |a, e| if e.1 > a.1 { e } else { a }).0;
    let rebound = history[turn..].iter().map(|e| e[1]).fold(0.0, f64::max);
    let what = format!("largest kinetic energy after the rebound, h = {h} m");
    findings.checks.push(Check::at_least(what, "", 0.9, rebound / kinetic_0));
    let gap = std::f64::consts::SQRT_2 * (CENTRES_M[1] - CENTRES_M[0]) - 2.0 * RADIUS_M;
    let exact = gap / (2.0 * std::f64::consts::SQRT_2 * SPEED_M_S);
    // Along each axis the disks approach at twice their speed.
    let reach = 2.5 * h / (2.0 * SPEED_M_S);
    let what = format!(
        "first 0.1 % of the kinetic energy stored, no sooner than the shape functions' reach, h = {h} m"
    );
    findings.checks.push(Check::at_least(what, "s", exact - reach, contact));
    if draw {
        figures(h, kinetic_0, &history, pictures, findings);
    }
}

fn outline(state: &State) -> Vec<[f64; 2]> {
    state.x.iter().zip(&state.y).map(|(x, y)| [*x, *y]).collect()
}

fn figures(
    h: f64,
    kinetic_0: f64,
    history: &[[f64; 3]],
    pictures: Vec<Vec<[f64; 2]>>,
    findings: &mut Findings,
) {
    let every = (history.len() / 60).max(1);
    let series = |get: &dyn Fn(&[f64; 3]) -> f64| {
        history.iter().step_by(every).map(|e| [e[0], get(e) / kinetic_0]).collect::<Vec<[f64; 2]>>()
    };
    findings.figures.push(Figure {
        name: "energy".to_owned(),
        title: format!("Energies over the kinetic energy at the start, h = {h} m"),
        x: "time (s)".to_owned(),
        y: "energy".to_owned(),
        equal_axes: false,
        series: vec![
            Series::line("conserved", vec![[0.0, 1.0], [END_S, 1.0]]),
            Series::circles("kinetic", series(&|e| e[1])),
            Series::circles("stored", series(&|e| e[2])),
            Series::circles("sum", series(&|e| e[1] + e[2])),
        ],
    });
    let names = ["0 s", "1.8 s", "3.5 s"];
    findings.figures.push(Figure {
        name: "disks".to_owned(),
        title: format!("The disks' points, h = {h} m"),
        x: "x (m)".to_owned(),
        y: "y (m)".to_owned(),
        equal_axes: true,
        series: pictures.into_iter().zip(names).map(|(points, name)| Series::dots(name, points)).collect(),
    });
}
