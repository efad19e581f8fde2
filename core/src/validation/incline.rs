//! B4: a block on an incline, with and without Coulomb friction at its base.

use super::measure::mean;
use super::set_up::{GRAVITY_M_S2, advance, body, elastic_body, filled};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::gimp::{Grid, InitialPoints, Setup, Support};

/// The case.
pub(super) const CASE: Case = Case {
    name: "block-on-incline",
    title: "Block on an incline with Coulomb friction",
    about: "An elastic block of 1 m (E 10 MPa, 2000 kg/m3, in equilibrium across the base) is let go on a base inclined \
            by 30 or 45 degrees (gravity is turned, the grid lies along the incline). Exact: acceleration g (sin t - mu cos t) if positive, else \
            rest. Tolerances: 1 % of the acceleration between 0.2 s and 1 s; a block that sticks must not creep faster than 0.1 mm/s \
            between 0.5 s and 1 s.",
    run,
};

const DENSITY_KG_M3: f64 = 2000.0;
const SIDE_M: f64 = 1.0;

fn run(depth: Depth) -> Findings {
    let resolutions: &[usize] = match depth {
        Depth::Quick => &[4],
        Depth::Full => &[4, 8],
    };
    let mut findings = Findings::default();
    let mut series = Vec::new();
    for &cells in resolutions {
        for degrees in [30.0, 45.0] {
            for friction in [0.0, 0.3, 0.6] {
                let (exact, speed) = slide(cells, degrees, friction, &mut findings.checks);
                if cells == resolutions[0] {
                    series.push(Series::line("", vec![[0.0, 0.0], [1.0, exact]]));
                    series.push(Series::circles(format!("{degrees} degrees, friction {friction}"), speed));
                }
            }
        }
    }
    findings.figures.push(Figure {
        name: "speed".to_owned(),
        title: "Speed of the block; lines: g (sin t - mu cos t) times time".to_owned(),
        x: "time (s)".to_owned(),
        y: "speed (m/s)".to_owned(),
        equal_axes: false,
        series,
    });
    findings.notes.push(
        "The block that sticks is hit by gravity and rocks about its foot, whose rear nodes lose and find the base \
         in turn; undamped, each such step lets it slip by about g sin t times the square of the step. It is damped (local damping 0.5, \
         PIC rate 1000 1/s) so that the rocking dies away; the sliding blocks are not."
            .to_owned(),
    );
    findings
}

/// The block along the incline, in equilibrium across it.
fn block(cells: usize, degrees: f64, friction: f64) -> Setup {
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let h = SIDE_M / cells as f64;
    let run_out = (5.0 * SIDE_M / h) as usize;
    let grid = Grid::enclosing(0.0, 0.0, [2 * cells + run_out, cells + 2], h);
    let positions = filled([2.0 * h, 0.0], [cells, cells], h);
    let mut points = InitialPoints::at_rest(&positions, 0.25 * h * h, DENSITY_KG_M3);
    for i in 0..points.len() {
        let across = -DENSITY_KG_M3 * GRAVITY_M_S2 * cos * (SIDE_M - points.y[i]);
        points.stress[i] = [0.0, across, 0.0, 0.0];
    }
    let mut setup = elastic_body(grid, 1e7, 0.0, points);
    setup.conditions.left = Support::Open;
    setup.conditions.bottom = if friction > 0.0 { Support::Friction(friction) } else { Support::Roller };
    setup.conditions.gravity_m_s2 = [GRAVITY_M_S2 * sin, -GRAVITY_M_S2 * cos];
    setup
}

/// Checks one block; the exact acceleration and some of its speeds over time.
fn slide(cells: usize, degrees: f64, friction: f64, checks: &mut Vec<Check>) -> (f64, Vec<[f64; 2]>) {
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let exact = (GRAVITY_M_S2 * (sin - friction * cos)).max(0.0);
    let mut setup = block(cells, degrees, friction);
    if exact == 0.0 {
        setup.controls.local_damping = 0.5;
        setup.controls.pic_rate_per_s = 1000.0;
    }
    let mut body = body(setup);
    let start = mean(&body.setup().points.x);
    let (mut speeds, mut travelled) = (vec![[0.0, 0.0]], vec![0.0]);
    for tenth in 1..=10 {
        advance(&mut body, 0.1 * f64::from(tenth), |_| {});
        let state = body.state();
        speeds.push([body.time_s(), mean(&state.vx)]);
        travelled.push(mean(&state.x) - start);
    }
    let of = format!("{degrees} degrees, friction {friction}, {cells} cells a side");
    let ([t0, v0], [t1, v1]) = (speeds[2], speeds[10]);
    checks.push(if exact > 0.0 {
        Check::relative(format!("acceleration, {of}"), "m/s2", exact, (v1 - v0) / (t1 - t0), 0.01)
    } else {
        let creep = (travelled[10] - travelled[5]) / (speeds[10][0] - speeds[5][0]);
        Check::absolute(format!("rate of creep, {of}"), "m/s", 0.0, creep, 1e-4)
    });
    (exact, speeds)
}
