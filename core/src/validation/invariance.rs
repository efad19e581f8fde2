//! B16: what must not move the answer.

use super::collapse::Column;
use super::set_up::{GRAVITY_M_S2, advance, body};
use super::slopes::{EXAMPLE_I, Slide, runout_m};
use super::{Case, Check, Comparison, Depth, Findings};
use crate::copula::Copula;
use crate::gimp::{Grid, Kernel, Setup, Support};
use crate::marginal::{Family, Marginal};
use crate::outcome::Outcome;
use crate::realisation::{Prepared, Progress};
use crate::site::Property;
use crate::spec::{RandomProperty, Spec};

pub(super) const INVARIANCE: Case = Case {
    name: "invariance",
    title: "What must not move the answer (B16)",
    about: "Mirror: a lopsided heap of dry soil and its mirror image collapse alike, to 1e-9 of its height; they differ by \
round-off only, which plastic flow amplifies. Mass: a falling heap that deforms freely has the momentum m g t to 1e-12. \
Moving frame: a vibrating elastic block that flies across the grid at ten times its own speeds deforms as at rest, but \
for the interpolation's error, which must fall with the cell. Kernels: every build of the solver for this machine's \
processor gives the same bits. Vanishing variation: a random field whose standard deviation is below round-off gives the \
homogeneous slope bit for bit, and a field of 0.1 per cent variation the same runout within 1 per cent.",
    run,
};

fn run(depth: Depth) -> Findings {
    let mut findings = Findings::default();
    mirror(&mut findings);
    mass(&mut findings);
    moving_frame(&mut findings);
    let cell_m = if depth == Depth::Full { 0.8 } else { 1.6 };
    kernels(&mut findings, cell_m);
    vanishing_variation(&mut findings, cell_m);
    findings
}

fn check(
    findings: &mut Findings,
    what: &str,
    unit: &'static str,
    reference: f64,
    found: f64,
    by: Comparison,
) {
    findings.checks.push(Check { what: what.into(), unit, reference, found, comparison: by });
}

const HEAP_M: f64 = 1.0;
const CELL_M: f64 = 0.1;

/// A lopsided heap of dry soil: a square one metre wide, a quarter of a metre higher on the left, in the middle of a plane
/// nine metres wide.
fn heap() -> Setup {
    let column = |height_m: f64, width_m: f64| {
        let soil = Column {
            width_m,
            height_m,
            friction_angle_deg: 30.0,
            density_kg_m3: 1500.0,
            youngs_modulus_pa: 2e7,
            poissons_ratio: 0.3,
            cell_m: CELL_M,
            pic_rate_per_s: 1.0,
            room_widths: 9.0,
        };
        soil.setup()
    };
    let mut setup = column(HEAP_M, HEAP_M);
    let right = column(0.6 * HEAP_M, HEAP_M).points;
    let points = &mut setup.points;
    points.x.iter_mut().for_each(|x| *x -= HEAP_M);
    points.x.extend(right.x);
    points.y.extend(right.y);
    points.velocity.extend(right.velocity);
    points.volume.extend(right.volume);
    points.density.extend(right.density);
    points.stress.extend(right.stress);
    points.pressure.extend(right.pressure);
    points.cohesion.extend(right.cohesion);
    points.friction_angle.extend(right.friction_angle);
    points.material.extend(right.material);
    points.water_held.extend(right.water_held);
    points.force.extend(right.force);
    setup.grid = Grid::enclosing(-4.5 * HEAP_M, 0.0, [90, 14], CELL_M);
    setup.conditions.left = Support::Open;
    setup
}

fn mirror(findings: &mut Findings) {
    let setup = heap();
    let mut image = setup.clone();
    image.points.x.iter_mut().for_each(|x| *x = -*x);
    let [mut one, mut other] = [setup, image].map(body);
    // The last half of the fall: afterwards the heap only creeps.
    let duration_s = 3.0 * libm::sqrt(HEAP_M / GRAVITY_M_S2);
    advance(&mut one, duration_s, |_| {});
    advance(&mut other, duration_s, |_| {});
    let (left, right) = (one.positions(), other.positions());
    let largest = left
        .iter()
        .zip(&right)
        .map(|(a, b)| (a[0] + b[0]).abs().max((a[1] - b[1]).abs()))
        .fold(0.0, f64::max);
    let moved = left.iter().zip(&one.setup().points.x).map(|(a, x)| (a[0] - x).abs()).fold(0.0, f64::max);
    check(
        findings,
        "largest difference to the mirror image",
        "m",
        1e-9 * HEAP_M,
        largest,
        Comparison::AtMost,
    );
    check(findings, "largest horizontal displacement meanwhile", "m", 0.5, moved, Comparison::AtLeast);
}

fn mass(findings: &mut Findings) {
    let mut setup = heap();
    setup.conditions.bottom = Support::Open;
    // Upwards first, so that it stays on the grid.
    setup.points.y.iter_mut().for_each(|y| *y += 0.2 * HEAP_M);
    let mut body = body(setup);
    let duration_s = 0.15;
    advance(&mut body, duration_s, |_| {});
    let state = body.state();
    let points = &body.setup().points;
    let momentum: f64 =
        state.vy.iter().zip(&points.density).zip(&points.volume).map(|((v, d), volume)| v * d * volume).sum();
    let weight = GRAVITY_M_S2 * body.total_mass();
    let what = "momentum of a falling heap over m g t";
    check(findings, what, "", -1.0, momentum / (weight * duration_s), Comparison::Absolute(1e-12));
}

/// A square elastic block that vibrates, without gravity, while it flies at `velocity_m_s`; displacements relative
/// to the flight.
fn vibration(cell_m: f64, velocity_m_s: f64) -> Vec<[f64; 2]> {
    let column = Column {
        width_m: HEAP_M,
        height_m: HEAP_M,
        friction_angle_deg: 0.0,
        density_kg_m3: 1000.0,
        youngs_modulus_pa: 1e6,
        poissons_ratio: 0.3,
        cell_m,
        pic_rate_per_s: 0.0,
        room_widths: 1.0,
    };
    let mut setup = column.setup();
    let cells = |length: f64| (length / cell_m).round() as usize;
    setup.grid = Grid::enclosing(-HEAP_M, -HEAP_M, [cells(5.0 * HEAP_M), cells(3.0 * HEAP_M)], cell_m);
    setup.conditions.left = Support::Open;
    setup.conditions.bottom = Support::Open;
    setup.conditions.gravity_m_s2 = [0.0, 0.0];
    let points = &mut setup.points;
    for i in 0..points.len() {
        points.stress[i] = [0.0; 4];
        points.cohesion[i] = f64::INFINITY;
        // Stretch along x and squeeze along y about the middle: at most 0.1 m/s.
        let out = |x: f64| libm::sin(std::f64::consts::PI * (x / HEAP_M - 0.5));
        points.velocity[i] = [velocity_m_s + 0.1 * out(points.x[i]), -0.1 * out(points.y[i])];
    }
    let mut body = body(setup);
    // The same steps in both frames, for 0.05 s: about one period across the block.
    let dt = 0.2 * cell_m / libm::sqrt(1.35e6 / 1000.0);
    while body.time_s() < 0.05 {
        body.step(dt);
    }
    let flown = velocity_m_s * body.time_s();
    let points = &body.setup().points;
    let relative = |(place, i): ([f64; 2], usize)| [place[0] - points.x[i] - flown, place[1] - points.y[i]];
    body.positions().into_iter().zip(0..).map(relative).collect()
}

fn moving_frame(findings: &mut Findings) {
    let error = |cell_m: f64| {
        let (rest, flying) = (vibration(cell_m, 0.0), vibration(cell_m, 1.0));
        let square = |d: [f64; 2]| d[0] * d[0] + d[1] * d[1];
        let differences = rest.iter().zip(&flying).map(|(a, b)| square([a[0] - b[0], a[1] - b[1]]));
        libm::sqrt(differences.sum::<f64>() / rest.iter().map(|d| square(*d)).sum::<f64>())
    };
    let (coarse, fine) = (error(0.1), error(0.05));
    let what = "moving frame: difference of displacements over displacements";
    check(findings, &format!("{what}, 10 cells"), "", 0.05, coarse, Comparison::AtMost);
    check(findings, &format!("{what}, 20 cells over 10 cells"), "", 0.75, fine / coarse, Comparison::AtMost);
}

fn kernels(findings: &mut Findings, cell_m: f64) {
    for (two_phase, phases) in [(false, "one phase"), (true, "two phases")] {
        let slide = Slide { cell_m, two_phase, duration_s: 1.0, ..EXAMPLE_I };
        let kernels = Kernel::available();
        let mut digests: Vec<String> = kernels.iter().map(|k| slide.run_with(*k).digest).collect();
        digests.dedup();
        let names: Vec<&str> = kernels.iter().map(|k| k.name()).collect();
        let what = format!("different outcomes of the kernels {}, {phases}", names.join(", "));
        check(findings, &what, "", 1.0, digests.len() as f64, Comparison::AtMost);
    }
}

/// The slope with c, phi and unit weight as normal random fields of this coefficient of variation.
fn random(slide: &Slide, variation: f64) -> Spec {
    let mut spec = slide.spec();
    let soil = &mut spec.model.soil;
    (soil.cohesion_pa, soil.friction_angle_rad, soil.unit_weight_n_m3) = (None, None, None);
    spec.random = [
        (Property::Cohesion, slide.cohesion_kpa),
        (Property::FrictionAngle, slide.friction_angle_deg),
        (Property::UnitWeight, slide.unit_weight_kn_m3),
    ]
    .map(|(property, p)| RandomProperty {
        property,
        marginal: Marginal { family: Family::TruncNormal, p, q: variation * p },
    })
    .to_vec();
    spec.copula = Copula::Independent { dimension: 3 };
    spec
}

fn vanishing_variation(findings: &mut Findings, cell_m: f64) {
    let slide = Slide { cell_m, ..EXAMPLE_I };
    let realise = |spec: Spec| -> Outcome {
        let prepared = Prepared::new(spec, Kernel::best()).expect("the fields can be planned");
        prepared.realise(0, &Progress::default()).expect("nobody cancels a validation case")
    };
    let homogeneous = realise(slide.spec());
    let same = realise(random(&slide, 1e-18)).digest == homogeneous.digest;
    let what = "variation below round-off: the same bits as the homogeneous slope (1: yes)";
    check(findings, what, "", 1.0, f64::from(u8::from(same)), Comparison::AtLeast);
    let nearly = realise(random(&slide, 1e-3));
    let what = "displacement, coefficient of variation 0.001";
    check(findings, what, "m", runout_m(&homogeneous), runout_m(&nearly), Comparison::Relative(0.01));
}
