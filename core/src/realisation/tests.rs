//! From the model to the solver's points: layers, profiles, in-situ stresses, water.

use super::insitu::InSitu;
use super::probe;
use super::{Prepared, Progress, Snapshot, Source};
use crate::campaign::{
    Contact, Formulation, InitialPorePressure, InitialStress, Layer, Mesh, Model, Obstacle, Polyline, Slope,
    Softening, Soil, Surface, WaterAboveTable, WaterTable,
};
use crate::copula::Copula;
use crate::gimp::{Kernel, Support};
use crate::marginal::{Family, Marginal};
use crate::outcome::Outcome;
use crate::points::Points;
use crate::profile::{LOOK_EVERY_S, Recorder, Stations};
use crate::site::Property;
use crate::slope;
use crate::spec::{RandomProperty, Spec};

/// The probe's slope (2 m, 45 degrees, 1 m cells) on a fixed base, of one perfectly plastic soil and with nothing in front
/// of it, and what is `change`d.
fn spec(change: impl Fn(&mut Model)) -> Spec {
    let mut spec = probe::spec();
    let model = &mut spec.model;
    model.slope.base = Contact::Fixed;
    model.obstacles.clear();
    model.layers.clear();
    model.soil.softening = None;
    model.water.free_water_level_m = None;
    change(&mut spec.model);
    spec
}

fn prepared(change: impl Fn(&mut Model)) -> Prepared {
    Prepared::new(spec(change), Kernel::best()).unwrap()
}

fn outcome(change: impl Fn(&mut Model)) -> Outcome {
    prepared(change).realise(0, &Progress::default()).unwrap()
}

fn layer(name: &str, bottom: Option<Polyline>, soil: Soil) -> Layer {
    Layer { name: name.to_owned(), bottom, soil }
}

/// Two layers of the same constants, one of which dips and pinches out, are no layers.
#[test]
fn layers_of_equal_constants_change_no_bit() {
    let dipping = Polyline::new(vec![[-4.0, 2.0], [0.0, -0.5]]).unwrap();
    let one = outcome(|_| {});
    let two = prepared(|model| {
        let soil = model.soil;
        model.layers = vec![layer("top", Some(dipping.clone()), soil), layer("rest", None, soil)];
    });
    let used: Vec<usize> =
        (0..2).map(|m| two.materials().iter().filter(|&&of| usize::from(of) == m).count()).collect();
    assert!(used.iter().all(|&points| points > 5), "{used:?}");
    assert_eq!(two.realise(0, &Progress::default()).unwrap(), one);
}

#[test]
fn a_softer_layer_moves_the_outcome() {
    let with = |modulus_pa: f64| {
        outcome(|model| {
            let soil = model.soil;
            let other = Soil { youngs_modulus_pa: modulus_pa, ..soil };
            model.layers = vec![layer("top", Some(Polyline::level(1.0)), soil), layer("rest", None, other)];
        })
    };
    assert_ne!(with(1e7).digest, with(2e6).digest);
}

/// A section of the probe's slope gives its points, and dry, where the ground's exact elevation does not enter, its bits.
#[test]
fn a_profile_of_the_uniform_slope_gives_its_outcome() {
    let dry = |model: &mut Model| model.water.initial_pore_pressure = InitialPorePressure::None;
    let uniform = outcome(dry);
    let profile = outcome(|model| {
        dry(model);
        let edge = slope::crest_edge_x(&model.slope);
        let line = Polyline::new(vec![[edge - 2.0, 2.0], [edge, 2.0], [0.0, 0.0]]).unwrap();
        model.slope.surface = Surface::Profile { line, crest_x_m: edge };
    });
    assert_eq!(profile, uniform);
}

/// Random layers take the fields, others their constants.
#[test]
fn properties_follow_the_layers() {
    let whole = prepared(|_| {}).properties(Source::Index(3));
    let layered = prepared(|model| {
        let rock = Soil {
            cohesion_pa: Some(5e4),
            friction_angle_rad: Some(0.6),
            unit_weight_n_m3: Some(22e3),
            ..model.soil
        };
        model.layers = vec![layer("soil", Some(Polyline::level(1.0)), model.soil), layer("rock", None, rock)];
    });
    let properties = layered.properties(Source::Index(3));
    for (i, &y) in layered.layout().y.iter().enumerate() {
        let expected = if y > 1.0 {
            (whole.cohesion_pa[i], whole.friction_angle_rad[i], 20e3)
        } else {
            (5e4, 0.6, 22e3)
        };
        let found =
            (properties.cohesion_pa[i], properties.friction_angle_rad[i], properties.unit_weight_n_m3[i]);
        assert_eq!(found, expected, "point {i} at {y} m");
    }
}

/// A crest of two layers, 18 over 21 kN/m3, with the table inside the lower one: the column at the left wall by hand.
#[test]
fn k0_stresses_are_those_of_the_column_above() {
    let layered = prepared(|model| {
        model.slope.surface = uniform(4.0);
        let upper = Soil { unit_weight_n_m3: Some(18e3), ..model.soil };
        let lower = Soil { unit_weight_n_m3: Some(21e3), ..model.soil };
        model.layers = vec![layer("upper", Some(Polyline::level(2.5)), upper), layer("lower", None, lower)];
        model.water.initial_pore_pressure = InitialPorePressure::Hydrostatic(WaterTable::ElevationM(2.0));
        model.analysis.initial_stress = InitialStress::K0(0.6);
    });
    let properties = layered.properties(Source::Deterministic);
    let Ok(state) = layered.in_situ(&properties, &Progress::default()) else {
        panic!("it needs no analysis")
    };
    let mut seen = 0;
    for i in 0..layered.points() {
        let (x, y) = (state.x[i], state.y[i]);
        if x > -4.0 {
            continue;
        }
        // Elevation of the crest 4 m.
        let total = if y > 2.5 { 18e3 * (4.0 - y) } else { 18e3 * 1.5 + 21e3 * (2.5 - y) };
        let pressure = 9810.0 * (2.0 - y).max(0.0);
        let vertical = pressure - total;
        let [xx, yy, zz, xy] = state.stress[i];
        assert!((state.pressure[i] - pressure).abs() < 1e-9, "pore pressure at {y} m");
        assert!((yy - vertical).abs() < 1e-6, "at {y} m: {yy} Pa, by hand {vertical}");
        assert!((xx - 0.6 * vertical).abs() < 1e-6 && zz == xx && xy == 0.0, "at {y} m");
        seen += 1;
    }
    assert!(seen >= 16, "only {seen} points behind the crest's edge");
}

fn uniform(height_m: f64) -> Surface {
    Surface::Uniform { height_m, angle_rad: std::f64::consts::FRAC_PI_4, crest_width_m: 4.0 }
}

/// Ground under 5 m of water, strong: a slope of 2 m with 2 m below its toe. Its in-situ stresses are those of its
/// buoyant weight whatever the water's depth, and it stays where it is.
fn submerged(model: &mut Model, stress: InitialStress, level_m: f64) {
    model.slope = Slope { foundation_depth_m: 2.0, ..model.slope.clone() };
    model.soil.cohesion_pa = Some(50e3);
    model.soil.friction_angle_rad = Some(0.6);
    model.water.initial_pore_pressure = InitialPorePressure::Hydrostatic(WaterTable::ElevationM(level_m));
    model.water.free_water_level_m = Some(level_m);
    model.analysis.initial_stress = stress;
    model.analysis.gravity_stage_s = 1.0;
    model.analysis.duration_s = 2.0;
    model.maximum_steps = 100_000;
}

#[test]
fn under_free_water_the_ground_is_stressed_by_its_buoyant_weight_and_stays() {
    let stresses = |stress, level| {
        let slope = prepared(|model| submerged(model, stress, level));
        let properties = slope.properties(Source::Deterministic);
        let Ok(state) = slope.in_situ(&properties, &Progress::default()) else {
            panic!("it can be analysed")
        };
        let rest = slope.deterministic(&Progress::default()).unwrap();
        let moved = rest.measures.expect("it ends").max_displacement_m;
        (state, moved)
    };
    let (shallow, moved) = stresses(InitialStress::Gravity, 5.0);
    // Elastic ground of 4 m under 10 kN/m3 settles by millimetres; what is in equilibrium moves by far less.
    assert!(moved < 2e-5, "moved by {moved} m after the gravity stage");
    let (deep, _) = stresses(InitialStress::Gravity, 25.0);
    let buoyant = 20e3 - 9810.0;
    for (a, b) in shallow.stress.iter().zip(&deep.stress) {
        assert!((a[1] - b[1]).abs() < 1e-3 * buoyant, "{a:?} {b:?}");
    }
    // The lowest row's mean vertical stress is the weight above it over the base's 7 m: exactly above its middle by K0;
    // above the middle of its cell, two rows high, in the gravity stage, whose stresses are those of whole cells.
    let (k0, _) = stresses(InitialStress::K0(0.5), 5.0);
    let base = k0.y.iter().copied().fold(f64::INFINITY, f64::min);
    let lowest: Vec<usize> = (0..k0.y.len()).filter(|&i| k0.y[i] == base).collect();
    let mean = |state: &InSitu| lowest.iter().map(|&i| state.stress[i][1]).sum::<f64>() / lowest.len() as f64;
    let area = 0.25 * k0.y.len() as f64;
    let row = 0.5 * 7.0;
    assert!((mean(&k0) / (-buoyant * (area - 0.5 * row) / 7.0) - 1.0).abs() < 1e-12);
    let found = mean(&shallow) / (-buoyant * (area - row) / 7.0);
    assert!((found - 1.0).abs() < 0.005, "{found} of the weight");
}

#[test]
fn water_above_the_table_is_held_and_that_below_is_not() {
    let wet = prepared(|model| {
        model.water.initial_pore_pressure = InitialPorePressure::Hydrostatic(WaterTable::ElevationM(1.0));
    });
    let held = held_water(&wet);
    let (Points { x, y, .. }, ground) = (wet.layout(), &wet.spec().model.slope);
    for i in 0..held.len() {
        // On the face the table ends at the ground.
        let table = slope::ground_surface_y(ground, x[i]).min(1.0);
        assert_eq!(held[i], y[i] >= table, "at ({}, {}) m", x[i], y[i]);
    }
    assert!(held.iter().any(|held| *held) && held.iter().any(|held| !held));
    let dry = prepared(|model| model.water.initial_pore_pressure = InitialPorePressure::None);
    assert!(held_water(&dry).iter().all(|held| *held));
    let sinking = prepared(|model| model.water.above_table = WaterAboveTable::Sinks);
    assert!(held_water(&sinking).iter().all(|held| !held));
    let one_phase = prepared(|model| {
        model.water.initial_pore_pressure = InitialPorePressure::None;
        model.analysis.formulation = Formulation::OnePhase;
    });
    assert!(held_water(&one_phase).iter().all(|held| !held));
}

fn held_water(slope: &Prepared) -> Vec<bool> {
    let properties = slope.properties(Source::Deterministic);
    let Ok(state) = slope.in_situ(&properties, &Progress::default()) else { panic!("it can be analysed") };
    slope.failure_points(&state, &properties).water_held
}

#[test]
fn base_obstacles_and_softening_reach_the_failure_stage_only() {
    let slope = prepared(|model| {
        model.slope.base = Contact::Friction(0.4);
        model.obstacles = vec![Obstacle { x_m: [1.0, 2.0], y_m: [0.0, 1.0], contact: Contact::Fixed }];
        model.water.free_water_level_m = Some(0.5);
        model.mesh = Mesh { cell_size_m: 0.5, points_per_cell_side: 2 };
        model.soil.softening = Some(Softening {
            residual_cohesion_ratio: 0.1,
            residual_friction_ratio: 0.8,
            residual_dilation_ratio: 0.0,
            displacement_m: 0.5,
        });
    });
    let points = crate::gimp::InitialPoints::at_rest(&[[0.0, 0.0]], 1.0, 2000.0);
    let failure = slope.failure_setup(points.clone());
    assert_eq!(failure.conditions.bottom, Support::Friction(0.4));
    assert_eq!(failure.conditions.free_water_level_m, Some(0.5));
    assert_eq!(failure.obstacles.len(), 1);
    assert_eq!(failure.obstacles[0].support, Support::Fixed);
    let softening = failure.materials[0].softening.expect("the soil softens");
    assert_eq!([softening.residual_cohesion, softening.residual_friction_angle], [0.1, 0.8]);
    let gravity = slope.gravity_setup(points);
    assert_eq!(gravity.conditions.bottom, Support::Fixed);
    assert_eq!(gravity.conditions.free_water_level_m, None);
    assert!(gravity.obstacles.is_empty());
}

/// Mud on the probe's slope for 2 s, on a plain of 6 m; how far its front comes.
fn mud(change: impl Fn(&mut Model)) -> f64 {
    let slid = outcome(|model| {
        model.slope.runout_plain_m = 6.0;
        model.mesh.cell_size_m = 0.5;
        model.soil.cohesion_pa = Some(100.0);
        model.soil.friction_angle_rad = Some(0.1);
        model.water.initial_pore_pressure = InitialPorePressure::None;
        model.analysis.formulation = Formulation::OnePhase;
        model.analysis.duration_s = 2.0;
        model.maximum_steps = 100_000;
        change(model);
    });
    slid.measures.expect("it ends").toe_advance_m
}

/// A point's half-length may reach into a wall by its share of the shape functions' overlap: less than a quarter of a cell.
#[test]
fn a_wall_stops_what_would_run_past_it() {
    let smooth = |model: &mut Model| model.slope.base = Contact::Friction(0.02);
    let free = mud(smooth);
    assert!(free > 2.5, "the mud runs {free} m only");
    for contact in [Contact::Fixed, Contact::Friction(0.2)] {
        let wall = Obstacle { x_m: [2.0, 3.0], y_m: [0.0, 3.0], contact };
        let stopped = mud(|model| {
            smooth(model);
            model.obstacles = vec![wall];
        });
        assert!((1.5..2.25).contains(&stopped), "{contact:?}: front at {stopped} m, the wall stands at 2 m");
    }
}

#[test]
fn on_a_smooth_base_mud_runs_farther() {
    let fixed = mud(|_| {});
    let smooth = mud(|model| model.slope.base = Contact::Friction(0.02));
    assert!(smooth > fixed + 0.3, "{smooth} m on a smooth base, {fixed} m on a fixed one");
}

/// The probe's slope in finer cells, its unit weight lognormal about 20 kN/m3 with a coefficient of variation of 10 %.
fn of_random_weight() -> Prepared {
    let mut spec = spec(|model| {
        model.mesh.cell_size_m = 0.5;
        model.soil.cohesion_pa = Some(2e3);
        model.soil.friction_angle_rad = Some(0.4);
        model.soil.unit_weight_n_m3 = None;
        model.analysis.gravity_stage_s = 1.0;
    });
    let marginal = Marginal { family: Family::Lognormal, p: 3.0, q: 0.1 };
    spec.random = vec![RandomProperty { property: Property::UnitWeight, marginal }];
    spec.copula = Copula::Independent { dimension: 1 };
    Prepared::new(spec, Kernel::best()).unwrap()
}

/// Stresses settled from those of the mean weights are those of a whole gravity stage: to 1e-3 of the largest stress, a
/// hundredth of what separates the realisation from the mean.
#[test]
fn random_weights_settle_to_the_stresses_of_a_whole_gravity_stage() {
    let (slope, progress) = (of_random_weight(), Progress::default());
    let properties = slope.properties(Source::Index(1));
    let mean = slope.properties(Source::Deterministic);
    let whole = slope.gravity_stage(slope.gravity_points(&properties), 1.0, &progress);
    let (Ok(whole), Ok(settled), Ok(mean)) =
        (whole, slope.in_situ(&properties, &progress), slope.in_situ(&mean, &progress))
    else {
        panic!("it can be analysed")
    };
    let scale = whole.stress.iter().flatten().fold(0.0_f64, |m, s| m.max(s.abs()));
    let off = |state: &InSitu| {
        let pairs = state.stress.iter().flatten().zip(whole.stress.iter().flatten());
        pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / scale
    };
    let (settled, mean) = (off(&settled), off(&mean));
    assert!(settled < 1e-3, "{settled} of the largest stress");
    assert!(mean > 0.05, "the realisation differs from the mean by {mean} only");
}

/// What is kept for all realisations depends on the spec alone: neither on which realisation comes first nor on whether
/// the slope of mean properties does.
#[test]
fn with_random_weight_an_outcome_does_not_depend_on_what_ran_before() {
    let progress = Progress::default();
    let fresh = of_random_weight().realise(2, &progress).unwrap();
    let used = of_random_weight();
    let mean = used.deterministic(&progress).unwrap();
    used.realise(5, &progress).unwrap();
    assert_eq!(used.realise(2, &progress).unwrap(), fresh);
    assert_eq!(used.deterministic(&progress).unwrap(), mean);
    assert_ne!(fresh.digest, mean.digest);
}

/// Recording moves nothing but the digest, which it is part of; it is the same on every kernel, and what an observer of
/// the same moments counts.
#[test]
fn a_recorded_profile_is_that_of_the_moments_and_moves_nothing() {
    let longer = |model: &mut Model| {
        model.slope.base = Contact::Friction(0.1);
        model.analysis.duration_s = 1.5;
        model.maximum_steps = 100_000;
    };
    let recorded = |model: &mut Model| {
        longer(model);
        model.sample.profile = true;
    };
    let without = outcome(longer);
    let with = outcome(recorded);
    assert_ne!(with.digest, without.digest);
    let digest = without.digest.clone();
    assert_eq!(Outcome { profile: None, digest, ..with.clone() }, without);
    for kernel in Kernel::available() {
        let prepared = Prepared::new(spec(recorded), kernel).unwrap();
        assert_eq!(prepared.realise(0, &Progress::default()).unwrap(), with, "{}", kernel.name());
    }

    let prepared = prepared(longer);
    let model = &prepared.spec().model;
    let mut recorder = Recorder::new(Stations::of(&model.slope, &model.mesh));
    let mut observe = |snapshot: &Snapshot<'_>| recorder.look(snapshot.state.motion());
    prepared.analyse(Source::Index(0), LOOK_EVERY_S, &mut observe, &Progress::default()).unwrap();
    let counted = recorder.finish();
    assert!(
        counted.depth_mm.first().is_some_and(|depth| *depth > 0),
        "nothing reaches the plain: {counted:?}"
    );
    assert_eq!(with.profile, Some(counted));
}

/// Specs and outcomes as they were written before profiles could be asked for are read, and written the same.
#[test]
fn what_was_written_without_profiles_is_read_and_written_again() {
    let spec = probe::spec();
    let text = spec.to_json();
    assert!(!text.contains("profile"), "{text}");
    assert_eq!(Spec::from_json(&text).unwrap(), spec);
    let line = r#"{"index":3,"outcome":"failed","reason":"left-grid","measures":null,"energy":null,"energy_drifted":false,"simulated_s":0.5,"steps":7,"points":26,"digest":"00"}"#;
    let outcome: Outcome = serde_json::from_str(line).unwrap();
    assert_eq!(outcome.profile, None);
    assert_eq!(serde_json::to_string(&outcome).unwrap(), line);
}
