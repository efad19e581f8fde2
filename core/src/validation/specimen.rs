//! B8 and B9: compression tests on specimens of many cells, up to failure.

use super::measure::mean;
use super::set_up::{GRAINS_KG_M3, WATER_BULK_PA, WATER_KG_M3, body, elastic_body, filled};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::campaign::{Formulation, VolumetricStrain};
use crate::gimp::{Body, Grid, InitialPoints, Setup};

/// Drained.
pub(super) const DRAINED: Case = Case {
    name: "drained-compression",
    title: "Drained biaxial compression of a Mohr-Coulomb specimen",
    about: "A quarter of a specimen, 1 m by 2 m (E 20 MPa, Poisson's ratio 0.3, c 10 kPa, phi 25 degrees, no \
            dilation), between two rollers is compressed by forces on its topmost points, sideways under a \
            confining stress of 100 kPa. Stresses are counted from the isotropic confinement, which for \
            Mohr-Coulomb is the same as a cohesion larger by 100 kPa tan(phi), so that the sides are free. \
            Plane strain. Exact: elastic slope E / (1 - nu^2), lateral strain -nu / (1 - nu) of the axial \
            one, failure at s1 = s3 tan^2(45 + phi / 2) + 2 c tan(45 + phi / 2) = 277.785 kPa. The load \
            rises in steps, each let come to rest with local damping. Tolerances: 0.5 % of the elastic slope \
            and strains of the points at least two cells from loaded and free sides; the specimen carries \
            0.98 of the peak and fails under 1.02 of it. Slope, peak, dilation and single-point paths \
            themselves are checked to 1e-6 on the update alone (element tests).",
    run: drained,
};

/// Undrained.
pub(super) const UNDRAINED: Case = Case {
    name: "undrained-compression",
    title: "Undrained biaxial compression of a saturated specimen",
    about: "The specimen of the drained test, saturated (porosity 0.3, K_w 2.2 GPa) and sheared faster than \
            it drains (k = 1e-10 m/s), from an isotropic effective stress of 100 kPa. Exact: elastic with \
            the undrained Poisson's ratio nu_u of K + K_w / n, so that the slope is E_u / (1 - nu_u^2) and \
            the excess pressure 0.49869 of the sum of the total stresses; failure where the effective path \
            meets the envelope, q = 102.763 kPa with 51.247 kPa of excess pressure (incompressible limit s_u \
            = p0 sin(phi) + c cos(phi)). Volumetric strains averaged over cells and the pressure relaxed to \
            the cell's mean, as recommended for two phases. Tolerances: 0.5 % of slope and pressure, peak as \
            in the drained test; the element itself is checked to 0.5 % on the update alone.",
    run: undrained,
};

const WIDTH_M: f64 = 1.0;
const HEIGHT_M: f64 = 2.0;
const E_PA: f64 = 20e6;
const NU: f64 = 0.3;
const COHESION_PA: f64 = 10e3;
const FRICTION_DEG: f64 = 25.0;
const CONFINEMENT_PA: f64 = 100e3;
const POROSITY: f64 = 0.3;
const DENSITY_KG_M3: f64 = (1.0 - POROSITY) * GRAINS_KG_M3 + POROSITY * WATER_KG_M3;
/// Share of the peak in the elastic part, and what must be carried and what must not.
const ELASTIC: f64 = 0.2;
const CARRIED: f64 = 0.98;
const TOO_MUCH: f64 = 1.02;
/// Shares at which the drained test stops for its figure.
const DRAWN: [f64; 4] = [0.4, 0.6, 0.8, 0.9];
/// Speeds, over the scale of speeds, below which a specimen stands and above which it fails.
const STANDS: f64 = 1e-3;
const FAILS: f64 = 0.1;
/// Local damping, and time for each load to be put on and for it to come to rest, s: about 3 and 7 periods of the
/// specimen's slowest swing, 8 / sqrt(E / rho) s.
const DAMPING: f64 = 0.5;
const RISE_S: f64 = 0.25;
const REST_S: f64 = 0.6;

/// Material points with confinement as zero stress.
fn specimen(cells: usize, load_pa: f64) -> Setup {
    let h = WIDTH_M / cells as f64;
    let positions = filled([0.0, 0.0], [cells, 2 * cells], h);
    let mut points = InitialPoints::at_rest(&positions, 0.25 * h * h, DENSITY_KG_M3);
    let friction = FRICTION_DEG.to_radians();
    points.friction_angle.fill(friction);
    points.cohesion.fill(COHESION_PA + CONFINEMENT_PA * libm::tan(friction));
    let row = 2 * cells;
    let first = points.len() - row;
    for force in &mut points.force[first..] {
        *force = [0.0, -load_pa * WIDTH_M / row as f64];
    }
    let grid = Grid::enclosing(0.0, 0.0, [cells + 2, 2 * cells + 1], h);
    let mut setup = elastic_body(grid, E_PA, NU, points);
    setup.controls.local_damping = DAMPING;
    setup
}

/// What points at least two cells from loaded and free sides show at one load.
struct Stand {
    axial_strain: f64,
    lateral_strain: f64,
    /// Effective stresses along x and y, Pa.
    stress: [f64; 2],
    pressure: f64,
    /// Speed at which the top still sinks, m/s.
    sinking: f64,
}

/// Raises the share of the load to `share` and lets the specimen come to rest.
fn load_to(body: &mut Body, from: f64, share: f64) -> Stand {
    let begun = body.time_s();
    while body.time_s() < begun + RISE_S {
        let step = body.stable_step_s();
        body.set_load_share(from + (share - from) * (body.time_s() - begun) / RISE_S);
        body.step(step);
    }
    body.set_load_share(share);
    let settle = |body: &mut Body, until: f64| {
        while body.time_s() < until {
            let step = body.stable_step_s();
            body.step(step);
        }
    };
    settle(body, begun + RISE_S + 0.5 * REST_S);
    let top = |body: &Body| {
        let y = body.state().y;
        mean(&y[y.len() - 4..])
    };
    let (before, time) = (top(body), body.time_s());
    settle(body, begun + RISE_S + REST_S);
    let sinking = (before - top(body)) / (body.time_s() - time);
    stand(body, sinking)
}

fn stand(body: &Body, sinking: f64) -> Stand {
    let (start, state) = (&body.setup().points, body.state());
    let two_cells = 2.0 * body.setup().grid.cell_m;
    let inner: Vec<usize> = (0..start.len())
        .filter(|&i| start.x[i] < WIDTH_M - two_cells && start.y[i] < HEIGHT_M - two_cells)
        .collect();
    // Least squares of displacement over place: the strain, whatever the staircase.
    let slope = |place: &[f64], now: &[f64]| {
        let (mut products, mut squares) = (0.0, 0.0);
        for &i in &inner {
            products += place[i] * (now[i] - place[i]);
            squares += place[i] * place[i];
        }
        products / squares
    };
    let of = |values: &[f64]| mean(&inner.iter().map(|&i| values[i]).collect::<Vec<_>>());
    Stand {
        axial_strain: slope(&start.y, &state.y),
        lateral_strain: slope(&start.x, &state.x),
        stress: [of(&state.stress_xx), of(&state.stress_yy)],
        pressure: of(&state.pressure),
        sinking,
    }
}

/// Runs one test, by way of the loads in `shown`; checks slope and peak, returns what stood at the elastic load.
fn compress(
    setup: &Setup,
    peak: f64,
    modulus: f64,
    of: &str,
    shown: &[f64],
    findings: &mut Findings,
) -> Stand {
    let mut body = body(setup.clone());
    let mut curve = vec![[0.0, 0.0]];
    let elastic = load_to(&mut body, 0.0, ELASTIC);
    let mut from = ELASTIC;
    let mut last = 0.0;
    let mut sinking = Vec::new();
    curve.push([-100.0 * elastic.axial_strain, ELASTIC]);
    for &share in shown.iter().chain(&[CARRIED, TOO_MUCH]) {
        let stand = load_to(&mut body, from, share);
        curve.push([-100.0 * stand.axial_strain, share]);
        (from, last) = (share, stand.sinking);
        sinking.push(stand.sinking);
    }
    let what = format!("axial stress over axial strain at {ELASTIC} of the peak, {of}");
    let strain = elastic.axial_strain;
    findings.checks.push(Check::relative(what, "Pa", modulus, -ELASTIC * peak / strain, 5e-3));
    // Shortening at the peak over the time of rest: the scale of speeds.
    let scale = HEIGHT_M * peak / modulus / REST_S;
    let what = format!("speed of sinking under {CARRIED} of the peak, {of}");
    findings.checks.push(Check::at_most(what, "m/s", STANDS * scale, sinking[sinking.len() - 2]));
    let what = format!("speed of sinking under {TOO_MUCH} of the peak, {of}");
    findings.checks.push(Check::at_least(what, "m/s", FAILS * scale, last));
    let line = vec![[0.0, 0.0], [100.0 * peak / modulus, 1.0], [100.0 * 3.0 * peak / modulus, 1.0]];
    let curve = curve.into_iter().filter(|c| c[0] < 100.0 * 3.0 * peak / modulus).collect();
    findings.figures.push(Figure {
        name: "load".to_owned(),
        title: format!("Load over the peak and axial strain at rest, {of}"),
        x: "axial strain (%)".to_owned(),
        y: "load over the peak".to_owned(),
        equal_axes: false,
        series: vec![Series::line("exact", line), Series::circles("found", curve)],
    });
    elastic
}

fn resolutions(depth: Depth) -> &'static [usize] {
    match depth {
        Depth::Quick => &[8],
        Depth::Full => &[8, 16],
    }
}

/// Load over the confinement at failure, Pa.
fn drained_peak() -> f64 {
    let tangent = libm::tan((45.0 + 0.5 * FRICTION_DEG).to_radians());
    CONFINEMENT_PA * (tangent * tangent - 1.0) + 2.0 * COHESION_PA * tangent
}

/// The undrained specimen in closed form.
struct Undrained {
    /// Axial stress over axial strain, Pa.
    modulus: f64,
    /// Excess pressure over the load.
    pressure_a_load: f64,
    /// Load at failure, Pa.
    peak: f64,
}

fn closed_form() -> Undrained {
    let (bulk, shear) = (E_PA / (3.0 * (1.0 - 2.0 * NU)), E_PA / (2.0 * (1.0 + NU)));
    let whole = bulk + WATER_BULK_PA / POROSITY;
    let nu_u = (3.0 * whole - 2.0 * shear) / (2.0 * (3.0 * whole + shear));
    // The pressure rises by K_w / n over the undrained bulk modulus times the mean stress (1 + nu_u) q / 3.
    let pressure_a_load = WATER_BULK_PA / POROSITY / whole * (1.0 + nu_u) / 3.0;
    // Failure: s1' - s3' = q with s3' = s0 - p(q) on the envelope; sigma_zz stays between the two.
    let (sin, cos) = libm::sincos(FRICTION_DEG.to_radians());
    let peak = 2.0 * (CONFINEMENT_PA * sin + COHESION_PA * cos) / (1.0 - sin + 2.0 * pressure_a_load * sin);
    Undrained { modulus: 2.0 * shear / (1.0 - nu_u), pressure_a_load, peak }
}

fn drained(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    let peak = drained_peak();
    for &cells in resolutions(depth) {
        let of = format!("{cells} cells across");
        let modulus = E_PA / (1.0 - NU * NU);
        let elastic = compress(&specimen(cells, peak), peak, modulus, &of, &DRAWN, &mut findings);
        let what = format!("axial stress at {ELASTIC} of the peak, {of}");
        findings.checks.push(Check::relative(what, "Pa", -ELASTIC * peak, elastic.stress[1], 5e-3));
        let what = format!("lateral over axial strain, {of}");
        let ratio = elastic.lateral_strain / elastic.axial_strain;
        findings.checks.push(Check::relative(what, "", -NU / (1.0 - NU), ratio, 5e-3));
    }
    findings.figures.truncate(1);
    findings
}

fn undrained(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    let Undrained { modulus, pressure_a_load, peak } = closed_form();
    for &cells in resolutions(depth) {
        let of = format!("{cells} cells across");
        let mut setup = specimen(cells, peak);
        setup.controls.formulation = Formulation::TwoPhase;
        setup.controls.volumetric_strain = VolumetricStrain::CellAverage;
        setup.controls.pressure_relaxation_rate_per_s = 0.1 / 4e-5;
        setup.materials[0].porosity = POROSITY;
        setup.materials[0].permeability_m_s = 1e-10;
        let elastic = compress(&setup, peak, modulus, &of, &[], &mut findings);
        // Inside, as an element sees it, and against the load, which free sides spread unevenly.
        let total = 2.0 * elastic.pressure - elastic.stress[0] - elastic.stress[1];
        let what = format!("excess pressure over the sum of total stresses, {of}");
        findings.checks.push(Check::relative(what, "", pressure_a_load, elastic.pressure / total, 5e-3));
        let what = format!("excess pressure over the load, {of}");
        let found = elastic.pressure / (ELASTIC * peak);
        findings.checks.push(Check::information(what, "", pressure_a_load, found));
    }
    findings.figures.truncate(1);
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// Against values computed elsewhere.
    #[test]
    fn closed_forms_meet_the_tabulated_ones() {
        let tables: Value = serde_json::from_str(include_str!("../../tests/data/physics.json")).unwrap();
        let value = |table: &str, name: &str| tables[table][name].as_f64().unwrap();
        let close =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        close(CONFINEMENT_PA + drained_peak(), value("biaxial", "sigma1_peak"));
        let undrained = closed_form();
        close(undrained.peak, value("undrained_biaxial", "q_fail"));
        close(undrained.peak * undrained.pressure_a_load, value("undrained_biaxial", "excess_pw_at_fail"));
        let nu_u = value("undrained_biaxial", "nu_u");
        close(undrained.modulus, value("undrained_biaxial", "E_u") / (1.0 - nu_u * nu_u));
    }
}
