//! Order of convergence in two dimensions, by a manufactured solution.

use super::measure::{order, rms};
use super::set_up::{body, elastic_body, filled};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::gimp::{Grid, InitialPoints, Support};
use std::f64::consts::PI;

/// The case.
pub(super) const CASE: Case = Case {
    name: "manufactured",
    title: "Order of convergence: a manufactured solution in two dimensions",
    about: "A square of 1 m between rollers (E 10 MPa, Poisson's ratio 0.3, 1000 kg/m3) is made to move as \
            u_x = A sin(pi x) cos(pi y) sin(w t), u_y = B cos(pi x) sin(pi y) sin(w t) by forces on its \
            points that follow from Navier's equations, f = rho u'' - G lap(u) - (lambda + G) grad(div u); \
            normal displacements and shear stresses vanish at the rollers by themselves. w is 1.3 times the \
            frequency of the shear wave of that length, so that inertia counts. Displacements are 1e-6 m: no \
            point leaves its cell. Checked: root mean square error of the displacements at w t = pi / 2, \
            second order in h (at least 1.8).",
    run,
};

const E_PA: f64 = 10e6;
const NU: f64 = 0.3;
const DENSITY_KG_M3: f64 = 1000.0;
/// Amplitudes along x and y, m.
const AMPLITUDE_M: [f64; 2] = [1e-6, -0.5e-6];
/// Steps in a quarter of the period, a cell across the square: Courant number 0.34.
const STEPS_A_CELL: f64 = 3.0;

/// Shape of the motion along x and y at a place, over its amplitudes.
fn shape(x: f64, y: f64) -> [f64; 2] {
    let ((sx, cx), (sy, cy)) = (libm::sincos(PI * x), libm::sincos(PI * y));
    [sx * cy, cx * sy]
}

/// Frequency, rad/s.
fn frequency() -> f64 {
    let shear = E_PA / (2.0 * (1.0 + NU));
    1.3 * PI * (2.0 * shear / DENSITY_KG_M3).sqrt()
}

/// Force per volume at a place at w t = pi / 2, N/m3.
fn force(x: f64, y: f64) -> [f64; 2] {
    let shear = E_PA / (2.0 * (1.0 + NU));
    let lame = E_PA * NU / ((1.0 + NU) * (1.0 - 2.0 * NU));
    let [a, b] = AMPLITUDE_M;
    let inertia = DENSITY_KG_M3 * frequency() * frequency();
    // lap(u) = -2 pi^2 u and grad(div u) = -pi^2 (A + B) (sin cos, cos sin).
    let along = |own: f64| (2.0 * PI * PI * shear - inertia) * own + (lame + shear) * PI * PI * (a + b);
    let [sx, sy] = shape(x, y);
    [along(a) * sx, along(b) * sy]
}

/// Root mean square error of the displacements over the amplitude A.
fn error(cells: usize) -> f64 {
    let h = 1.0 / cells as f64;
    let mut points =
        InitialPoints::at_rest(&filled([0.0, 0.0], [cells, cells], h), 0.25 * h * h, DENSITY_KG_M3);
    let w = frequency();
    for i in 0..points.len() {
        let (x, y) = (points.x[i], points.y[i]);
        let ([sx, sy], [fx, fy]) = (shape(x, y), force(x, y));
        points.velocity[i] = [w * AMPLITUDE_M[0] * sx, w * AMPLITUDE_M[1] * sy];
        points.force[i] = [fx * points.volume[i], fy * points.volume[i]];
    }
    let start: Vec<[f64; 2]> = points.x.iter().zip(&points.y).map(|(x, y)| [*x, *y]).collect();
    let mut setup = elastic_body(Grid::enclosing(0.0, 0.0, [cells, cells], h), E_PA, NU, points);
    setup.conditions.right = Support::Roller;
    setup.conditions.top = Support::Roller;
    let mut body = body(setup);
    let steps = STEPS_A_CELL * cells as f64;
    let step = 0.5 * PI / w / steps;
    assert!(step <= body.stable_step_s(), "{step} s is too long a step");
    for k in 0..steps as u64 {
        // Leapfrog: velocities are half a step behind.
        body.set_load_share(libm::sin(w * k as f64 * step));
        body.step(step);
    }
    let state = body.state();
    rms(start.iter().enumerate().flat_map(|(i, [x, y])| {
        let [sx, sy] = shape(*x, *y);
        [state.x[i] - x - AMPLITUDE_M[0] * sx, state.y[i] - y - AMPLITUDE_M[1] * sy]
    })) / AMPLITUDE_M[0]
}

fn run(depth: Depth) -> Findings {
    let resolutions: &[usize] = match depth {
        Depth::Quick => &[8, 16, 32],
        Depth::Full => &[8, 16, 32, 64],
    };
    let errors: Vec<f64> = resolutions.iter().map(|cells| error(*cells)).collect();
    let mut checks = Vec::new();
    for (cells, error) in resolutions.iter().zip(&errors) {
        let what = format!("rms error of the displacements over A, {cells} cells a side");
        checks.push(Check::information(what, "", 0.0, *error));
    }
    for (pair, cells) in errors.windows(2).zip(resolutions) {
        let what = format!("order of convergence, {cells} to {} cells a side", 2 * cells);
        checks.push(Check::at_least(what, "", 1.8, order(pair[0], pair[1])));
    }
    let log = |cells: usize, error: f64| [libm::log10(1.0 / cells as f64), libm::log10(error)];
    let found: Vec<[f64; 2]> = resolutions.iter().zip(&errors).map(|(c, e)| log(*c, *e)).collect();
    let last = found[found.len() - 1];
    let slope = found.iter().map(|p| [p[0], last[1] + 2.0 * (p[0] - last[0])]).collect();
    Findings {
        checks,
        figures: vec![Figure {
            name: "order".to_owned(),
            title: "Error of the displacements".to_owned(),
            x: "log10 of the cell's size over the side".to_owned(),
            y: "log10 of the error over A".to_owned(),
            equal_axes: false,
            series: vec![Series::line("second order", slope), Series::circles("found", found)],
        }],
        notes: Vec::new(),
    }
}
