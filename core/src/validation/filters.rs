//! What the velocity filters take from a vibrating bar.

use super::axial_bar::{DENSITY_KG_M3, E_PA, LENGTH_M, bar, wave_number};
use super::set_up::{advance, body};
use super::{Case, Check, Depth, Figure, Findings, Marks, Series};
use crate::campaign::VelocityFilter;
use std::f64::consts::PI;

/// The case.
pub(super) const CASE: Case = Case {
    name: "velocity-filters",
    title: "What PIC and XPIC take from a wave",
    about: "The bar of the axial vibration, 25 cells, modes 1 to 12 at 0.1 mm/s, with the PIC rate r = 5 1/s. \
            Sending the points' velocities to the grid and back keeps the share q = (5 + 3 cos a) / 8 of a \
            wave that turns by a in a cell (points at the quarters of cells; a = b h). With the share s = 1 - \
            exp(-r dt) of a step, PIC leaves 1 - s (1 - q) of the velocity, XPIC(2) 1 - s (1 - q)^2 (Hammerquist \
            & Nairn 2017); half of the energy is kinetic, so that it falls by that factor a step: at the rate \
            -ln(1 - s (1 - q)) / dt, near r (1 - q) if s is small. Tolerance 8 %, where the wave loses more than a \
            thousandth: in the cells at the two ends, 2 of 25, the points' neighbours are not those of the formula. \
            Smooth motion loses far less with XPIC than with PIC, noise as much.",
    run,
};

const CELLS: usize = 25;
const SPEED_M_S: f64 = 1e-4;
const RATE_PER_S: f64 = 5.0;
/// Losses smaller than this are not told from those of the scheme without a filter.
const SMALLEST_LOSS: f64 = 1e-3;

/// Share of a wave's velocity that the way to the grid and back takes.
fn taken(mode: u32) -> f64 {
    let turn = wave_number(mode) * LENGTH_M / CELLS as f64;
    3.0 * (1.0 - libm::cos(turn)) / 8.0
}

/// Rate at which a filter takes energy if it leaves 1 - `share` x `taken` of the velocity in a step of `dt`, 1/s.
fn loss_rate(taken: f64, dt: f64) -> f64 {
    let share = -libm::expm1(-RATE_PER_S * dt);
    -libm::log1p(-share * taken) / dt
}

/// After whole periods of about two seconds.
struct Left {
    /// Energy over that at the start.
    energy: f64,
    time_s: f64,
    /// Mean time step, s.
    step_s: f64,
}

fn vibrate(mode: u32, filter: VelocityFilter, rate_per_s: f64) -> Left {
    let mut setup = bar(CELLS, mode, SPEED_M_S).setup().clone();
    setup.controls.velocity_filter = filter;
    setup.controls.pic_rate_per_s = rate_per_s;
    let mut body = body(setup);
    let at_start = body.energy().available_j;
    let period = 2.0 * PI / (wave_number(mode) * (E_PA / DENSITY_KG_M3).sqrt());
    let time = period * (2.0 / period).ceil();
    advance(&mut body, time, |_| {});
    let energy = body.energy();
    Left {
        energy: 1.0 + (energy.kinetic_j + energy.elastic_j) / at_start,
        time_s: time,
        step_s: time / body.steps() as f64,
    }
}

fn run(depth: Depth) -> Findings {
    let modes: &[u32] = match depth {
        Depth::Quick => &[1, 4, 8, 12],
        Depth::Full => &[1, 2, 3, 4, 6, 8, 10, 12],
    };
    let mut findings = Findings::default();
    let mut series = Vec::new();
    for (filter, name, power) in [(VelocityFilter::Pic, "PIC", 1), (VelocityFilter::Xpic, "XPIC(2)", 2)] {
        let (mut found, mut step_s) = (Vec::new(), 0.0);
        for &mode in modes {
            let left = vibrate(mode, filter, RATE_PER_S);
            let without = vibrate(mode, filter, 0.0);
            let once = taken(mode);
            let rate = loss_rate(if power == 1 { once } else { once * once }, left.step_s);
            let measured = -libm::log(left.energy / without.energy) / left.time_s;
            step_s = left.step_s;
            let what = format!("rate at which the energy falls, {name}, mode {mode}");
            let check = if rate * left.time_s > SMALLEST_LOSS {
                Check::relative(what, "1/s", rate, measured, 2.0 / CELLS as f64)
            } else {
                Check::information(what, "1/s", rate, measured)
            };
            findings.checks.push(check);
            found.push([f64::from(mode), measured]);
        }
        series.push(Series { label: name.to_owned(), points: found, marks: Marks::Circles });
        let exact = (10..=120).map(|k| {
            let mode = f64::from(k) / 10.0;
            let turn = (2.0 * mode - 1.0) * PI / (2.0 * CELLS as f64);
            let taken = 3.0 * (1.0 - libm::cos(turn)) / 8.0;
            [mode, loss_rate(if power == 1 { taken } else { taken * taken }, step_s)]
        });
        let label = format!("{name}, closed form");
        series.push(Series { label, points: exact.collect(), marks: Marks::Line });
    }
    findings.figures.push(Figure {
        name: "rates".to_owned(),
        title: format!("Loss of energy at a PIC rate of {RATE_PER_S} per second"),
        x: "mode".to_owned(),
        y: "rate at which the energy falls, 1/s".to_owned(),
        equal_axes: false,
        series,
    });
    findings
}
