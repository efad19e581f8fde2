//! B5, B6 and both ends drained: one-dimensional consolidation of a saturated column.

use super::closed_forms::{triangular_degree, triangular_excess, uniform_degree, uniform_excess};
use super::measure::{rms, row_centres, row_means};
use super::set_up::{
    GRAINS_KG_M3, GRAVITY_M_S2, WATER_BULK_PA, WATER_KG_M3, advance, body, column, elastic_body, filled,
};
use super::{Case, Check, Depth, Figure, Findings, Series};
use crate::campaign::Formulation;
use crate::gimp::{Body, Grid, InitialPoints, Setup, Support};

/// Step load on a drained top.
pub(super) const STEP_LOAD: Case = Case {
    name: "consolidation",
    title: "Consolidation under a step load (Terzaghi)",
    about: "A saturated column of 1 m (E_oed 10 MPa, Poisson's ratio 0, porosity 0.3, k 1e-3 m/s, K_w 2.2 \
            GPa) under a load of 10 kPa, drained at its top. The load is realised without a traction: \
            stresses are counted from the loaded state, so that the column starts with the undrained \
            response p0 = q Q / (Q + E_oed), Q = K_w / n, and the effective stress +p0, free of total \
            stress; for linear elasticity that is the same problem. Reference: Terzaghi's series with c_v = \
            k / gamma_w / (1 / E_oed + n / K_w). Tolerances: root mean square error of the cell means 1 % of \
            p0, degree of consolidation 0.01. The dynamic solution of the same equations differs from \
            Terzaghi's by up to 0.4 % of p0 at Tv = 0.05 and 0.2 % later (fine finite differences).",
    run: step_load,
};

/// Self-weight.
pub(super) const SELF_WEIGHT: Case = Case {
    name: "self-weight-consolidation",
    title: "Consolidation under self-weight",
    about: "The same column under gravity; at the start the water carries the whole weight, p = gamma_sat \
            times the depth. Reference: series solution for the triangular initial excess pressure; \
            settlement gamma' H^2 / (2 E_oed) at the end. Tolerances: root mean square error of the cell \
            means 0.005 of gamma' H (an independent GIMP program of the same scheme: 0.0008), degree of \
            consolidation 0.01.",
    run: self_weight,
};

/// Both ends drained.
pub(super) const BOTH_ENDS: Case = Case {
    name: "both-ends-drained",
    title: "Consolidation of a column drained at both ends",
    about: "A column of 2 m, as in the case with a step load, with a free surface at each end and no \
            gravity: by symmetry its middle is an impervious base, and each half follows Terzaghi's series \
            with the drainage path 1 m. Neither end touches a wall, so that both pore pressures vanish in \
            the natural way only; the column must also stay where it is. Tolerances as for one end; drift of \
            the centre of mass 1e-9 m.",
    run: both_ends,
};

const HEIGHT_M: f64 = 1.0;
const EOED_PA: f64 = 10e6;
const POROSITY: f64 = 0.3;
const PERMEABILITY_M_S: f64 = 1e-3;
const LOAD_PA: f64 = 10e3;
/// Total density, kg/m3.
const DENSITY_KG_M3: f64 = (1.0 - POROSITY) * GRAINS_KG_M3 + POROSITY * WATER_KG_M3;
/// Time factors of the isochrones.
const TIME_FACTORS: [f64; 5] = [0.05, 0.1, 0.2, 0.5, 1.0];

/// Coefficient of consolidation with compressible water, m2/s.
fn consolidation_coefficient() -> f64 {
    PERMEABILITY_M_S / (WATER_KG_M3 * GRAVITY_M_S2) / (1.0 / EOED_PA + POROSITY / WATER_BULK_PA)
}

/// Excess pressure right after the load, Pa.
fn undrained_pressure() -> f64 {
    let storage = WATER_BULK_PA / POROSITY;
    LOAD_PA * storage / (storage + EOED_PA)
}

fn saturate(setup: &mut Setup) {
    setup.controls.formulation = Formulation::TwoPhase;
    setup.materials[0].porosity = POROSITY;
    setup.materials[0].permeability_m_s = PERMEABILITY_M_S;
}

/// Starts with the undrained response to a load, counted from the loaded state.
fn shift_by_load(setup: &mut Setup) {
    let p0 = undrained_pressure();
    setup.points.pressure.fill(p0);
    setup.points.stress.fill([0.0, p0, 0.0, 0.0]);
}

fn resolutions(depth: Depth) -> &'static [usize] {
    match depth {
        Depth::Quick => &[10, 20],
        Depth::Full => &[10, 20, 40],
    }
}

/// What is compared at each time factor.
struct Reference<'a> {
    /// Excess pressure over its scale, by depth over the drainage path.
    excess: fn(f64, f64) -> f64,
    degree: fn(f64) -> f64,
    /// Scale of the excess pressure, Pa.
    scale: f64,
    /// Pressure that is no excess, by elevation, Pa.
    steady: &'a dyn Fn(f64) -> f64,
    /// Elevation of the drained top and of the impervious base, m.
    top: f64,
    base: f64,
    /// Settlement of the top against the base at the end, m.
    settlement: f64,
    tolerance: f64,
}

/// Follows the isochrones of the rows of cells from `first` on; adds checks, and figures for the finest mesh.
fn follow(body: &mut Body, cells: usize, reference: &Reference<'_>, draw: bool, findings: &mut Findings) {
    let setup = body.setup();
    let h = setup.grid.cell_m;
    let start = setup.points.y.clone();
    let rows = (start[start.len() - 1] / h).ceil() as usize;
    let centres = row_centres(rows, h);
    let path = reference.top - reference.base;
    let mut series = Vec::new();
    for time_factor in TIME_FACTORS {
        advance(body, time_factor * path * path / consolidation_coefficient(), |_| {});
        let state = body.state();
        let means = row_means(&start, &state.pressure, rows, h);
        let found: Vec<[f64; 2]> = means
            .iter()
            .zip(&centres)
            .filter(|(mean, y)| mean.is_finite() && **y > reference.base)
            .map(|(mean, y)| [(mean - (reference.steady)(*y)) / reference.scale, (reference.top - y) / path])
            .collect();
        let error = rms(found.iter().map(|[p, z]| p - (reference.excess)(*z, time_factor)));
        let what = format!("rms error of the isochrone, Tv = {time_factor}, {cells} cells");
        findings.checks.push(Check::at_most(what, "", reference.tolerance, error));
        let degree = shortening(&start, &state.y, reference) / reference.settlement;
        let what = format!("degree of consolidation, Tv = {time_factor}, {cells} cells");
        findings.checks.push(Check::absolute(what, "", (reference.degree)(time_factor), degree, 0.01));
        let exact = (0..=50).map(|k| 0.02 * f64::from(k));
        series.push(Series::line("", exact.map(|z| [(reference.excess)(z, time_factor), -z]).collect()));
        let marks = found.iter().map(|[p, z]| [*p, -z]).collect();
        series.push(Series::circles(format!("Tv = {time_factor}"), marks));
    }
    if draw {
        findings.figures.push(Figure {
            name: "isochrones".to_owned(),
            title: format!("Excess pore pressure; lines: closed form, circles: means of {cells} cells"),
            x: "excess pore pressure over its scale".to_owned(),
            y: "elevation over the drainage path, from the top".to_owned(),
            equal_axes: false,
            series,
        });
    }
}

/// Settlement of the surface against the base, m: both ends extrapolated by half a point.
fn shortening(start: &[f64], y: &[f64], reference: &Reference<'_>) -> f64 {
    let moved = |place: f64, towards: f64| {
        let nearest = |wanted: f64| {
            (0..start.len())
                .min_by(|a, b| (start[*a] - wanted).abs().total_cmp(&(start[*b] - wanted).abs()))
                .expect("there are points")
        };
        // Rows of points stand at 1/4 and 3/4 of a cell.
        let spacing = start[2] - start[0];
        let (first, second) =
            (nearest(place + 0.5 * spacing * towards), nearest(place + 1.5 * spacing * towards));
        let change = |k: usize| start[k] - y[k];
        change(first) + 0.5 * (change(first) - change(second))
    };
    moved(reference.top, -1.0) - moved(reference.base, 1.0)
}

fn step_load(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    let all = resolutions(depth);
    for &cells in all {
        let mut setup = column(cells, HEIGHT_M, DENSITY_KG_M3, EOED_PA, 0.0);
        saturate(&mut setup);
        shift_by_load(&mut setup);
        let reference = Reference {
            excess: uniform_excess,
            degree: uniform_degree,
            scale: undrained_pressure(),
            steady: &|_| 0.0,
            top: HEIGHT_M,
            base: 0.0,
            settlement: undrained_pressure() * HEIGHT_M / EOED_PA,
            tolerance: 0.01,
        };
        follow(&mut body(setup), cells, &reference, cells == all[all.len() - 1], &mut findings);
    }
    findings
}

fn self_weight(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    let all = resolutions(depth);
    let (total, water) = (DENSITY_KG_M3 * GRAVITY_M_S2, WATER_KG_M3 * GRAVITY_M_S2);
    for &cells in all {
        let mut setup = column(cells, HEIGHT_M, DENSITY_KG_M3, EOED_PA, 0.0);
        saturate(&mut setup);
        setup.conditions.gravity_m_s2 = [0.0, -GRAVITY_M_S2];
        for i in 0..setup.points.len() {
            setup.points.pressure[i] = total * (HEIGHT_M - setup.points.y[i]);
        }
        let reference = Reference {
            excess: triangular_excess,
            degree: triangular_degree,
            scale: (total - water) * HEIGHT_M,
            steady: &|y| water * (HEIGHT_M - y),
            top: HEIGHT_M,
            base: 0.0,
            settlement: (total - water) * HEIGHT_M * HEIGHT_M / (2.0 * EOED_PA),
            tolerance: 0.005,
        };
        follow(&mut body(setup), cells, &reference, cells == all[all.len() - 1], &mut findings);
    }
    findings
}

fn both_ends(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    let all = resolutions(depth);
    for &cells in all {
        let h = HEIGHT_M / cells as f64;
        let positions = filled([0.0, 2.0 * h], [1, 2 * cells], h);
        let points = InitialPoints::at_rest(&positions, 0.25 * h * h, DENSITY_KG_M3);
        let grid = Grid::enclosing(0.0, 0.0, [1, 2 * cells + 4], h);
        let mut setup = elastic_body(grid, EOED_PA, 0.0, points);
        setup.conditions.right = Support::Roller;
        setup.conditions.bottom = Support::Open;
        saturate(&mut setup);
        shift_by_load(&mut setup);
        let start = setup.points.y.clone();
        let base = 2.0 * h + HEIGHT_M;
        let reference = Reference {
            excess: uniform_excess,
            degree: uniform_degree,
            scale: undrained_pressure(),
            steady: &|_| 0.0,
            top: base + HEIGHT_M,
            base,
            settlement: undrained_pressure() * HEIGHT_M / EOED_PA,
            tolerance: 0.01,
        };
        let mut body = body(setup);
        follow(&mut body, cells, &reference, cells == all[all.len() - 1], &mut findings);
        let drift = body.state().y.iter().zip(&start).map(|(y, s)| y - s).sum::<f64>() / start.len() as f64;
        let what = format!("drift of the centre of mass, {cells} cells a half");
        findings.checks.push(Check::absolute(what, "m", 0.0, drift, 1e-9));
    }
    findings
}
