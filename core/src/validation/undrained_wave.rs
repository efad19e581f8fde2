//! B7: a compression wave through a saturated column.

use super::measure::{mean, rms, row_means, zero_crossings};
use super::set_up::{GRAINS_KG_M3, GRAVITY_M_S2, WATER_BULK_PA, WATER_KG_M3, body, column as body_of_column};
use super::two_phase_column::{Column, between, pressures};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::campaign::Formulation;

/// The case.
pub(super) const CASE: Case = Case {
    name: "undrained-wave",
    title: "Compression wave through a saturated column",
    about: "A saturated column of 2 m (E_oed 10 MPa, porosity 0.4, K_w 2.2 GPa) is loaded at its drained top \
            by 10 kPa within 0.1 T, T = H / c_u = 1.2 ms the travel time of the undrained wave, c_u = \
            sqrt((E_oed + K_w / n) / rho) = 1664 m/s (after Verruijt 2010, An introduction to soil \
            dynamics). The load acts on the points of the topmost row. Reference: finite differences for the \
            same v-w equations on 800 cells, themselves checked against a table for 2000 cells. With k = \
            1e-5 m/s skeleton and water move as one: a plateau of Q / (Q + E_oed) of the load behind the \
            front, twice that after the reflection at the base. Tolerances at 100 cells: 2 % for plateaus \
            and the front's arrival (half of the plateau), overshoot below 10 %. With k = 1e-3 m/s the front \
            is spread by drag: root mean square difference at five depths and all times 2 % of the load.",
    run,
};

const HEIGHT_M: f64 = 2.0;
const LOAD_PA: f64 = 10e3;
const REFERENCE_CELLS: usize = 800;
/// Depths of the probes, m.
const DEPTHS_M: [f64; 5] = [0.25, 0.5, 1.0, 1.5, 1.9];
/// Samples a travel time.
const SAMPLES: usize = 40;
/// The load's rise over the travel time.
const RAMP: f64 = 0.1;

/// The column with a hydraulic conductivity, m/s.
pub(super) fn column(permeability: f64) -> Column {
    Column {
        height: HEIGHT_M,
        porosity: 0.4,
        grains: GRAINS_KG_M3,
        water: WATER_KG_M3,
        water_bulk: WATER_BULK_PA,
        constrained: 10e6,
        permeability,
        gravity: GRAVITY_M_S2,
    }
}

/// Pressures over the load at the probes: one row a time.
type History = Vec<Vec<f64>>;

fn load_share(column: &Column, time: f64) -> f64 {
    (time * column.undrained_wave() / HEIGHT_M / RAMP).min(1.0)
}

fn reference(column: &Column, times: &[f64]) -> History {
    let load = |time: f64| load_share(column, time);
    pressures(column, REFERENCE_CELLS, &load, times, &DEPTHS_M)
}

/// The same with material points.
fn found(column: &Column, cells: usize, times: &[f64]) -> History {
    let h = HEIGHT_M / cells as f64;
    let mut setup = body_of_column(cells, HEIGHT_M, column.density(), column.constrained, 0.0);
    setup.controls.formulation = Formulation::TwoPhase;
    setup.materials[0].porosity = column.porosity;
    setup.materials[0].permeability_m_s = column.permeability;
    let count = setup.points.len();
    for force in &mut setup.points.force[count - 2..] {
        *force = [0.0, -0.5 * LOAD_PA * h];
    }
    let start = setup.points.y.clone();
    let mut body = body(setup);
    let mut rows = Vec::new();
    for &end in times {
        while body.time_s() < end {
            let left = end - body.time_s();
            let step = body.stable_step_s();
            let step = if left < 1.000_001 * step { left } else { step };
            // The load at the start of a step acts during it, as in the reference.
            body.set_load_share(load_share(column, body.time_s()));
            body.step(step);
        }
        let means = row_means(&start, &body.state().pressure, cells, h);
        rows.push(DEPTHS_M.iter().map(|depth| between(&means, h, HEIGHT_M - depth) / LOAD_PA).collect());
    }
    rows
}

fn run(depth: Depth) -> Findings {
    let (resolutions, travels): (&[usize], usize) = match depth {
        Depth::Quick => (&[100], 4),
        Depth::Full => (&[100, 200], 8),
    };
    let mut findings = Findings::default();
    for permeability in [1e-5, 1e-3] {
        let column = column(permeability);
        let travel = HEIGHT_M / column.undrained_wave();
        let times: Vec<f64> = (1..=travels * SAMPLES).map(|k| k as f64 / SAMPLES as f64 * travel).collect();
        let reference = reference(&column, &times);
        for &cells in resolutions {
            let found = found(&column, cells, &times);
            if permeability < 1e-4 {
                sharp_front(&column, cells, [&reference, &found], &mut findings.checks);
            } else {
                let differences = found.iter().flatten().zip(reference.iter().flatten()).map(|(f, r)| f - r);
                let what =
                    format!("rms difference at five depths up to {travels} T, k = 1e-3 m/s, {cells} cells");
                findings.checks.push(Check::at_most(what, "", 0.02, rms(differences)));
            }
            if cells == resolutions[0] {
                findings.figures.push(figure(permeability, cells, [&reference, &found]));
            }
        }
    }
    findings
}

/// Samples of the probe at `DEPTHS_M[2]`, the middle, between two times over the travel time.
fn middle(history: &History, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
    let times = history.iter().enumerate().map(|(k, row)| ((k + 1) as f64 / SAMPLES as f64, row[2]));
    times.filter(move |(t, _)| *t > from && *t <= to)
}

fn sharp_front(column: &Column, cells: usize, [reference, found]: [&History; 2], checks: &mut Vec<Check>) {
    let storage = column.water_bulk / column.porosity;
    let plateau = storage / (storage + column.constrained);
    let mean_of = |history: &History, from: f64, to: f64| {
        let values: Vec<f64> = middle(history, from, to).map(|s| s.1).collect();
        mean(&values)
    };
    let what = format!("first plateau over the load, mid-height, k = 1e-5 m/s, {cells} cells");
    checks.push(Check::relative(what, "", plateau, mean_of(found, 0.8, 1.3), 0.02));
    let what =
        format!("plateau behind the reflected wave over the load, mid-height, k = 1e-5 m/s, {cells} cells");
    checks.push(Check::relative(what, "", 2.0 * plateau, mean_of(found, 1.8, 2.3), 0.02));

    let arrival = |history: &History| {
        let series: Vec<[f64; 2]> = middle(history, 0.0, 1.0).map(|(t, p)| [t, p - 0.5 * plateau]).collect();
        zero_crossings(&series).first().copied().unwrap_or(f64::NAN)
    };
    let what = format!("arrival at mid-height over T, k = 1e-5 m/s, {cells} cells");
    checks.push(Check::relative(what, "", arrival(reference), arrival(found), 0.02));
    let highest = middle(found, 0.0, 1.3).map(|s| s.1).fold(0.0, f64::max);
    let what = format!("overshoot of the first plateau, mid-height, k = 1e-5 m/s, {cells} cells");
    checks.push(Check::at_most(what, "", 0.1, highest / plateau - 1.0));
}

fn figure(permeability: f64, cells: usize, [reference, found]: [&History; 2]) -> Figure {
    let series_of = |history: &History, probe: usize, every: usize| {
        let all = history.iter().enumerate().map(|(k, row)| [(k + 1) as f64 / SAMPLES as f64, row[probe]]);
        all.filter(|s| s[0] <= 4.0).step_by(every).collect::<Vec<[f64; 2]>>()
    };
    let mut series = Vec::new();
    for (probe, name) in [(0, "depth 0.25 m"), (2, "1 m"), (4, "1.9 m")] {
        series.push(Series::line("", series_of(reference, probe, 1)));
        series.push(Series::circles(name, series_of(found, probe, 2)));
    }
    Figure {
        name: if permeability < 1e-4 { "sharp" } else { "spread" }.to_owned(),
        title: format!(
            "Pore pressure, k = {permeability:e} m/s; lines: finite differences, circles: {cells} cells"
        ),
        x: "time over T".to_owned(),
        y: "pore pressure over the load".to_owned(),
        equal_axes: false,
        series,
    }
}
