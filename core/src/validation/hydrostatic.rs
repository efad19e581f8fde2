//! A saturated column in equilibrium stays at rest.

use super::set_up::{GRAINS_KG_M3, GRAVITY_M_S2, WATER_KG_M3, advance, body, column};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::campaign::Formulation;

/// The case.
pub(super) const CASE: Case = Case {
    name: "hydrostatic-column",
    title: "Saturated column at rest",
    about: "A saturated column of 2 m (E_oed 10 MPa, porosity 0.3, k 1e-3 m/s) under gravity with \
            hydrostatic pore pressure gamma_w z and effective stress -(gamma_sat - gamma_w) z, local damping \
            0.05. Equilibrium is exact for linear profiles at the quarters of cells, surface included: in \
            the discrete equations nothing may move. Tolerances: 1e-6 m and 1e-6 of gamma_w H.",
    run,
};

const HEIGHT_M: f64 = 2.0;
const DENSITY_KG_M3: f64 = 0.7 * GRAINS_KG_M3 + 0.3 * WATER_KG_M3;
const CELLS: usize = 20;

fn run(depth: Depth) -> Findings {
    let duration_s = match depth {
        Depth::Quick => 0.5,
        Depth::Full => 5.0,
    };
    let mut setup = column(CELLS, HEIGHT_M, DENSITY_KG_M3, 10e6, 0.0);
    setup.conditions.gravity_m_s2 = [0.0, -GRAVITY_M_S2];
    setup.controls.formulation = Formulation::TwoPhase;
    setup.controls.local_damping = 0.05;
    let water = WATER_KG_M3 * GRAVITY_M_S2;
    for i in 0..setup.points.len() {
        let below = HEIGHT_M - setup.points.y[i];
        setup.points.pressure[i] = water * below;
        setup.points.stress[i] = [0.0, -(DENSITY_KG_M3 * GRAVITY_M_S2 - water) * below, 0.0, 0.0];
    }
    let start = setup.points.y.clone();
    let mut body = body(setup);
    advance(&mut body, duration_s, |_| {});
    let state = body.state();
    let moved = state.y.iter().zip(&start).map(|(y, s)| (y - s).abs()).fold(0.0, f64::max);
    let error = state.pressure.iter().zip(&start).map(|(p, y)| (p / water - (HEIGHT_M - y)).abs() / HEIGHT_M);
    let what = format!("{duration_s} s, {CELLS} cells");
    Findings {
        checks: vec![
            Check::at_most(format!("largest displacement, {what}"), "m", 1e-6, moved),
            Check::at_most(
                format!("largest error of the pore pressure over gamma_w H, {what}"),
                "",
                1e-6,
                error.fold(0.0, f64::max),
            ),
        ],
        figures: vec![Figure {
            name: "pressure".to_owned(),
            title: format!("Pore pressure of the points after {duration_s} s"),
            x: "pore pressure (kPa)".to_owned(),
            y: "elevation (m)".to_owned(),
            equal_axes: false,
            series: vec![
                Series::line("gamma_w z", vec![[0.0, HEIGHT_M], [1e-3 * water * HEIGHT_M, 0.0]]),
                Series::circles(
                    "points",
                    state.pressure.iter().zip(&state.y).map(|(p, y)| [1e-3 * p, *y]).collect(),
                ),
            ],
        }],
        notes: Vec::new(),
    }
}
