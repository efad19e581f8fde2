//! The solver against the readable reference version of its step (`reference`): small bodies of some 300 points, random
//! velocities, stresses and strengths, every stage of the step at work.
//!
//! The two add up in different orders and write the same formulas differently, so that they agree to rounding, never to
//! the bit. One step multiplies the round-off of its sums (some ten units of 1.1e-16) with at most the Courant number, the
//! ratio of the moduli of water and skeleton, and the like: 1e-13 of a quantity's scale is ample. How rounding then grows is
//! a property of the body, not of either program: each case carries copies of the reference that start one unit in the last
//! place elsewhere, and solver and reference must not differ by more than [`ROOM`] times what such a copy differs from the
//! reference, of which there must be little. A dropped term or a wrong sign in one program moves the
//! kinetic energy alone by 1e-7 of itself and more, within a few steps.

mod bodies;
mod reference;

use bodies::{filled, setup};
use reference::{Reference, Return};
use runout_core::campaign::{Formulation, PointDomain, VelocityFilter, VolumetricStrain};
use runout_core::gimp::{Body, Grid, InitialPoints, Kernel, Setup, Softening, State, Support};

/// Largest difference after one step, over the quantity's scale.
const ONE_STEP: f64 = 1e-13;

/// Largest difference after many steps, over that of a reference that starts one unit in the last place elsewhere: the
/// solver rounds at every step, such a copy but once.
const ROOM: f64 = 30.0;

/// Largest difference that one unit in the last place may have grown to, over the quantity's scale: beyond, a test would
/// tell little.
const LARGEST_GROWTH: f64 = 1e-10;

/// Side of a cell, m.
const CELL: f64 = 0.5;

/// Uniform numbers in [0, 1): the points' randomness (Knuth's multiplier; only its being spread out matters).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Points a quarter of a metre apart where `inside` says so, each moved at random by up to a tenth of that, moving at
/// random by up to 0.5 m/s, with random stresses about those of their own weight under `height`, soft in places.
fn random_points(height: f64, seed: u64, inside: impl Fn(f64, f64) -> bool) -> InitialPoints {
    let mut random = Random(seed);
    let side = 0.5 * CELL;
    let mut positions = filled(0.0, 0.0, 20, (height / CELL) as usize, CELL);
    positions.retain(|&[x, y]| inside(x, y));
    for coordinate in positions.iter_mut().flatten() {
        *coordinate += random.between(-0.1, 0.1) * side;
    }
    let mut points = InitialPoints::at_rest(&positions, side * side, 2000.0);
    for i in 0..points.len() {
        let vertical = -1e4 * (height - points.y[i]);
        points.density[i] = random.between(1800.0, 2200.0);
        points.velocity[i] = [random.between(-0.5, 0.5), random.between(-0.5, 0.5)];
        points.stress[i] = [
            vertical * random.between(0.4, 0.8),
            vertical * random.between(0.9, 1.1),
            vertical * random.between(0.4, 0.8),
            random.between(-2e3, 2e3),
        ];
        points.cohesion[i] = random.between(500.0, 5e3);
        points.friction_angle[i] = if i % 7 == 0 { 0.0 } else { random.between(0.1, 0.5) };
    }
    points
}

/// A slope of 3.75 m at 45 degrees behind a crest of 3.25 m, on a fixed base.
fn slope() -> Setup {
    let points = random_points(4.0, 1, |x, y| y < 3.75 && x + y < 7.1);
    let mut setup = setup(Grid::enclosing(0.0, 0.0, [24, 10], CELL), 5e6, 0.3, points);
    setup.conditions.right = Support::Roller;
    setup.conditions.bottom = Support::Fixed;
    setup.conditions.gravity_m_s2 = [0.0, -9.81];
    setup.controls.volumetric_strain = VolumetricStrain::CellAverage;
    setup.controls.pic_rate_per_s = 4.4;
    setup.controls.courant_number = 0.8;
    setup
}

/// The same, saturated, with water that pulls little before it cavitates.
fn two_phase_slope() -> Setup {
    let mut setup = slope();
    setup.controls.formulation = Formulation::TwoPhase;
    setup.controls.pressure_relaxation_rate_per_s = 300.0;
    setup.fluid.bulk_modulus_pa = 2e7;
    setup.fluid.cavitation_suction_pa = 5e3;
    setup.materials[0].permeability_m_s = 1e-2;
    setup
}

/// The same, moving forward, so that points change their cells early.
fn thrown_out(mut setup: Setup) -> Setup {
    for velocity in &mut setup.points.velocity {
        velocity[0] += 1.5;
    }
    setup
}

/// The quantities of a state that have a scale of their own, with their components.
fn quantities(state: &State) -> [(&'static str, Vec<&[f64]>); 7] {
    let s = state;
    [
        ("position", vec![&s.x, &s.y]),
        ("velocity", vec![&s.vx, &s.vy, &s.wx, &s.wy]),
        ("stress", vec![&s.stress_xx, &s.stress_yy, &s.stress_zz, &s.stress_xy]),
        ("pressure", vec![&s.pressure]),
        ("porosity", vec![&s.porosity]),
        ("volume", vec![&s.volume]),
        ("plastic strain", vec![&s.plastic_strain]),
    ]
}

/// Largest difference of each quantity between two states, over the quantity's scale in `expected`.
fn differences(found: &State, expected: &State) -> Vec<(&'static str, f64)> {
    let pairs = quantities(found).into_iter().zip(quantities(expected));
    pairs
        .map(|((name, found), (_, expected))| {
            let (found, expected) = (found.concat(), expected.concat());
            let scale = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs())).max(f64::MIN_POSITIVE);
            let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs() / scale);
            // A NaN is off by more than any number.
            (name, off.fold(0.0, |m, d| if d.is_nan() { f64::INFINITY } else { d.max(m) }))
        })
        .collect()
}

/// What a case must have met, lest it test less than it seems to.
struct Met {
    returns: &'static [Return],
    crossings: bool,
    cavitation: bool,
    closed_surface: bool,
}

const EVERY_RETURN_BUT_TENSION: &[Return] =
    &[Return::Elastic, Return::Plane, Return::RightEdge, Return::LeftEdge, Return::Apex];

/// Some of its points changed their cell.
const MOVES: Met = Met { returns: &[], crossings: true, cavitation: false, closed_surface: false };

/// A copy of `setup` in which every position, velocity and stress is one unit in the last place off, at random up or down.
fn nudged(setup: &Setup, seed: u64) -> Setup {
    let mut random = Random(seed);
    let mut nudge = |value: &mut f64| {
        *value = if random.next() < 0.5 { value.next_up() } else { value.next_down() };
    };
    let mut setup = setup.clone();
    let InitialPoints { x, y, velocity, stress, .. } = &mut setup.points;
    x.iter_mut().chain(y).for_each(&mut nudge);
    velocity.iter_mut().flatten().for_each(&mut nudge);
    stress.iter_mut().flatten().for_each(&mut nudge);
    setup
}

/// Follows the solver with every kernel that runs here and the reference for `steps`; compares after the first and the last.
fn compare(setup: &Setup, steps: usize, met: &Met) {
    let kernels = Kernel::available();
    let mut bodies: Vec<Body> =
        kernels.iter().map(|&kernel| Body::new(setup.clone(), kernel).unwrap()).collect();
    let mut reference = Reference::new(setup.clone());
    let mut copies = [2, 3].map(|seed| Reference::new(nudged(setup, seed)));
    for step in 1..=steps {
        let dt = bodies[0].stable_step_s();
        let energy = reference.step(dt);
        for body in &mut bodies {
            let found = body.step(dt).kinetic_energy_j;
            assert!((found / energy - 1.0).abs() < 1e-10, "step {step}: kinetic energy {found} {energy} J");
        }
        for copy in &mut copies {
            copy.step(dt);
        }
        if step == 1 || step == steps {
            let expected = reference.state();
            let limits = limits(step, &expected, &copies);
            for (body, kernel) in bodies.iter().zip(&kernels) {
                for ((name, off), limit) in differences(&body.state(), &expected).into_iter().zip(&limits) {
                    assert!(off < *limit, "{}, step {step}, {name}: off by {off:e}", kernel.name());
                }
            }
        }
    }
    check_that_it_met(&reference, met);
}

/// How far each quantity may be off after `step` steps, from how far the copies are.
fn limits(step: usize, expected: &State, copies: &[Reference]) -> Vec<f64> {
    let mut growth = vec![0.0_f64; 7];
    for copy in copies {
        for (growth, (name, off)) in growth.iter_mut().zip(differences(&copy.state(), expected)) {
            assert!(off < LARGEST_GROWTH, "step {step}, {name}: one unit grew to {off:e}");
            *growth = growth.max(off);
        }
    }
    growth.into_iter().map(|growth| if step == 1 { ONE_STEP } else { ONE_STEP.max(ROOM * growth) }).collect()
}

fn check_that_it_met(reference: &Reference, met: &Met) {
    assert_ne!(reference.state().x.len() % 8, 0, "the solver's last block is full");
    for &kind in met.returns {
        assert!(reference.returns[kind as usize] > 50, "{kind:?}: {:?}", reference.returns);
    }
    assert_eq!(reference.crossings > 50, met.crossings, "{} points changed their cell", reference.crossings);
    assert_eq!(reference.cavitated > 50, met.cavitation, "{} cavitated", reference.cavitated);
    assert_eq!(reference.closed > 50, met.closed_surface, "{} closed", reference.closed);
}

#[test]
fn a_slope_of_one_phase() {
    let met = Met { returns: EVERY_RETURN_BUT_TENSION, ..MOVES };
    compare(&slope(), 200, &met);
}

/// Tension cut-off, dilation, strains of the points themselves, local damping and decay.
#[test]
fn a_damped_slope_that_dilates_and_opens() {
    let mut setup = slope();
    setup.materials[0].dilation_angle_rad = 0.1;
    setup.materials[0].tension_cutoff_pa = Some(300.0);
    setup.controls.volumetric_strain = VolumetricStrain::Point;
    setup.controls.local_damping = 0.1;
    setup.controls.damping_rate_per_s = 0.5;
    let returns = &[Return::Plane, Return::RightEdge, Return::LeftEdge, Return::Tension];
    compare(&setup, 200, &Met { returns, ..MOVES });
}

#[test]
fn a_slope_of_two_phases_whose_water_cavitates() {
    let met = Met { returns: EVERY_RETURN_BUT_TENSION, cavitation: true, ..MOVES };
    compare(&two_phase_slope(), 400, &met);
}

/// Water that the skeleton holds, under a closed ground surface, thrown out and damped, with dilation and a tension cut-off.
#[test]
fn a_closed_slope_that_holds_its_water() {
    let mut setup = thrown_out(two_phase_slope());
    setup.points.water_held.fill(true);
    setup.conditions.closed_surface = true;
    setup.controls.local_damping = 0.1;
    setup.controls.damping_rate_per_s = 0.5;
    setup.materials[0].dilation_angle_rad = 0.1;
    setup.materials[0].tension_cutoff_pa = Some(300.0);
    let returns = &[Return::Plane, Return::RightEdge, Return::LeftEdge, Return::Tension];
    compare(&setup, 200, &Met { returns, cavitation: true, closed_surface: true, crossings: true });
}

/// What is compiled into the step's second form only: softening, the XPIC filter, stretched domains.
fn with_options(mut setup: Setup) -> Setup {
    setup.materials[0].softening = Some(Softening {
        residual_cohesion: 0.2,
        residual_friction_angle: 0.7,
        residual_dilation_angle: 0.1,
        displacement_m: 2.0,
    });
    setup.materials[0].dilation_angle_rad = 0.1;
    setup.materials[0].tension_cutoff_pa = Some(2e3);
    setup.controls.velocity_filter = VelocityFilter::Xpic;
    setup.controls.point_domain = PointDomain::Stretched;
    setup
}

const SOFT: Met = Met { returns: &[Return::Plane, Return::RightEdge, Return::LeftEdge], ..MOVES };

#[test]
fn a_softening_slope_of_one_phase_with_stretched_points_and_a_filter_that_acts_twice() {
    compare(&with_options(slope()), 200, &SOFT);
}

#[test]
fn a_softening_slope_of_two_phases_with_stretched_points_and_a_filter_that_acts_twice() {
    compare(&with_options(thrown_out(two_phase_slope())), 200, &Met { cavitation: true, ..SOFT });
}

/// A column between rollers, a corner of it missing, whose water sinks: of little permeability, its pressures relaxing, each point its own strain.
#[test]
fn a_column_that_consolidates() {
    let mut points = random_points(8.0, 5, |x, y| x < 2.0 && y < 7.75 && x + y < 9.4);
    for i in 0..points.len() {
        points.pressure[i] = 1.5e4 * (8.0 - points.y[i]);
        points.velocity[i][1] -= 1.0;
    }
    let mut setup = setup(Grid::enclosing(0.0, 0.0, [4, 18], CELL), 5e6, 0.3, points);
    setup.conditions.right = Support::Roller;
    setup.conditions.gravity_m_s2 = [1.0, -9.81];
    setup.controls.formulation = Formulation::TwoPhase;
    setup.controls.pressure_relaxation_rate_per_s = 100.0;
    setup.fluid.bulk_modulus_pa = 2e7;
    setup.materials[0].permeability_m_s = 1e-4;
    let met = Met { returns: EVERY_RETURN_BUT_TENSION, crossings: false, ..MOVES };
    compare(&setup, 300, &met);
}
