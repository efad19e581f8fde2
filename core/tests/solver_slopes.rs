//! Whole slopes: the onset of failure against limit analysis (B12), invariance of the outcome's bits, and what ends an
//! analysis.

#[path = "../benches/common/mod.rs"]
mod common;

use runout_core::campaign::{
    Formulation, GroundSurface, InitialPorePressure, Model, Surface, VolumetricStrain, WaterAboveTable,
    WaterTable,
};
use runout_core::copula::Copula;
use runout_core::gimp::Kernel;
use runout_core::marginal::{Family, Marginal};
use runout_core::outcome::{Outcome, OutcomeKind, Reason};
use runout_core::realisation::{Prepared, Progress, Source};
use runout_core::site::Property;
use runout_core::spec::{RandomProperty, Spec};

/// A 45 degree slope of the paper's constants without random properties: one phase, B-bar, a little PIC.
fn model(height_m: f64, cell_size_m: f64, cohesion_kpa: f64, friction_angle_deg: f64) -> Model {
    let mut model = common::spec(Formulation::OnePhase).model;
    model.slope.surface =
        Surface::Uniform { height_m, angle_rad: std::f64::consts::FRAC_PI_4, crest_width_m: 1.3 * height_m };
    model.slope.runout_plain_m = 2.0 * height_m;
    model.mesh.cell_size_m = cell_size_m;
    model.soil.cohesion_pa = Some(cohesion_kpa * 1e3);
    model.soil.friction_angle_rad = Some(friction_angle_deg.to_radians());
    model.water.above_table = WaterAboveTable::Held;
    model.analysis.duration_s = 10.0;
    model.analysis.stop_at_rest = true;
    model
}

fn homogeneous(model: Model) -> Spec {
    Spec { model, ..common::spec(Formulation::OnePhase) }
}

fn run(spec: Spec, kernel: Kernel) -> Outcome {
    Prepared::new(spec, kernel).unwrap().deterministic(&Progress::default()).unwrap()
}

/// A coarse slope (4 m, 1 m cells) that fails, for tests of everything but numbers.
fn small() -> Model {
    let mut model = model(4.0, 1.0, 1.0, 15.0);
    model.analysis.duration_s = 0.2;
    model.analysis.gravity_stage_s = 0.2;
    model
}

/// The paper's slope at 0.2 m points with the strength of one factor of safety of the family with friction angle
/// 20 degrees at 1.00 (log-spiral limit analysis, which agrees with Chen 1975).
fn family_member(factor: &str) -> Outcome {
    let reference: serde_json::Value = serde_json::from_str(include_str!("data/physics.json")).unwrap();
    let pair = &reference["fs_family_H15_beta45_gamma20"]["20"][factor];
    let mut model = model(15.0, 0.4, pair[0].as_f64().unwrap(), pair[1].as_f64().unwrap());
    model.slope.surface =
        Surface::Uniform { height_m: 15.0, angle_rad: std::f64::consts::FRAC_PI_4, crest_width_m: 19.4 };
    run(homogeneous(model), Kernel::best())
}

/// B12: 10 % below limit equilibrium the slope must run more than 1 m. The gap of 10 % covers the spread between limit
/// analysis and a discretised, non-associated dynamic solution.
#[test]
fn a_slope_ten_percent_short_of_equilibrium_runs() {
    let outcome = family_member("0.9");
    let measures = outcome.measures.unwrap();
    assert_eq!(outcome.outcome, OutcomeKind::Runout);
    assert!(measures.max_displacement_m > 1.0, "{outcome:?}");
}

/// B12: 10 % above limit equilibrium it must move less than 5 cm, and be seen to rest.
#[test]
fn a_slope_with_ten_percent_reserve_stays() {
    let outcome = family_member("1.1");
    assert!(outcome.measures.unwrap().max_displacement_m < 0.05, "{outcome:?}");
    assert_eq!((outcome.outcome, outcome.reason), (OutcomeKind::Stable, Reason::AtRest));
    assert!(outcome.simulated_s < 5.0, "the absolute rule stops it early: {}", outcome.simulated_s);
}

/// All kernels of this machine give the same bits, one-phase and two-phase, plain and averaged, open and closed.
#[test]
fn every_kernel_gives_the_same_bits() {
    for (formulation, strain, surface) in [
        (Formulation::OnePhase, VolumetricStrain::Point, GroundSurface::Drained),
        (Formulation::OnePhase, VolumetricStrain::CellAverage, GroundSurface::Drained),
        (Formulation::TwoPhase, VolumetricStrain::CellAverage, GroundSurface::Drained),
        (Formulation::TwoPhase, VolumetricStrain::CellAverage, GroundSurface::Closed),
    ] {
        let mut model = small();
        model.analysis.formulation = formulation;
        model.analysis.volumetric_strain = strain;
        model.water.ground_surface = surface;
        model.water.initial_pore_pressure = InitialPorePressure::Hydrostatic(WaterTable::ElevationM(2.0));
        model.analysis.local_damping = 0.01;
        model.soil.tension_cutoff_pa = Some(500.0);
        let outcomes: Vec<Outcome> =
            Kernel::available().into_iter().map(|k| run(homogeneous(model.clone()), k)).collect();
        assert!(outcomes[0].measures.is_some(), "{:?}", outcomes[0]);
        assert!(outcomes.iter().all(|o| *o == outcomes[0]), "{outcomes:?}");
    }
}

fn random_spec() -> Spec {
    let marginal = |p, q| Marginal { family: Family::Lognormal, p, q };
    let mut spec = homogeneous(small());
    spec.model.soil.cohesion_pa = None;
    spec.model.soil.unit_weight_n_m3 = None;
    spec.model.analysis.formulation = Formulation::TwoPhase;
    spec.random = vec![
        RandomProperty { property: Property::Cohesion, marginal: marginal(0.0, 0.5) },
        RandomProperty { property: Property::UnitWeight, marginal: marginal(3.0, 0.1) },
    ];
    spec.copula = Copula::Gaussian { correlation: vec![vec![1.0, -0.4], vec![-0.4, 1.0]] };
    spec
}

/// (spec, index) decides the bits: not the order, not what ran before, not being watched, not the thread.
#[test]
fn an_outcome_depends_on_spec_and_index_only() {
    let prepared = Prepared::new(random_spec(), Kernel::best()).unwrap();
    let realise = |index| prepared.realise(index, &Progress::default()).unwrap();
    let forward: Vec<Outcome> = (0..3).map(realise).collect();
    let backward: Vec<Outcome> = (0..3).rev().map(realise).collect();
    assert!(forward.iter().eq(backward.iter().rev()));
    assert_ne!(forward[0].digest, forward[1].digest);
    let mut seen = 0;
    let watched = prepared
        .analyse(
            Source::Index(1),
            0.05,
            &mut |s| seen += usize::from(s.ux.len() == prepared.points()),
            &Progress::default(),
        )
        .unwrap();
    assert_eq!(watched, forward[1]);
    assert!(seen >= 5, "{seen} snapshots of {} points", prepared.points());
    let threads: Vec<Outcome> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..3).map(|i| scope.spawn(move || realise_in(&random_spec(), i))).collect();
        handles.into_iter().map(|h| h.join().unwrap()).collect()
    });
    assert_eq!(threads, forward);
}

fn realise_in(spec: &Spec, index: u64) -> Outcome {
    Prepared::new(spec.clone(), Kernel::best()).unwrap().realise(index, &Progress::default()).unwrap()
}

/// What cannot be analysed, blows up or goes on too long is an outcome with its reason, never a panic.
#[test]
fn failures_are_outcomes() {
    let failure = |change: &dyn Fn(&mut Model)| {
        let mut model = small();
        change(&mut model);
        let outcome = run(homogeneous(model), Kernel::best());
        assert_eq!(outcome.outcome, OutcomeKind::Failed);
        assert_eq!(outcome.measures, None);
        assert_eq!(outcome.digest.len(), 32);
        outcome.reason
    };
    assert_eq!(failure(&|m| m.maximum_steps = 3), Reason::StepLimit);
    assert_eq!(failure(&|m| m.soil.friction_angle_rad = Some(1.5)), Reason::BadMaterial);
    assert_eq!(
        failure(&|m| {
            m.analysis.formulation = Formulation::TwoPhase;
            m.soil.unit_weight_n_m3 = Some(2.9e3);
        }),
        Reason::BadMaterial
    );
    // Thirty times the critical time step: the explicit scheme blows up.
    let wild = failure(&|m| {
        m.analysis.courant_number = 30.0;
        m.analysis.duration_s = 60.0;
    });
    assert!(matches!(wild, Reason::NonFinite | Reason::LeftGrid), "{wild:?}");
}

/// A cancelled realisation has no outcome.
#[test]
fn cancelling_ends_without_an_outcome() {
    let progress = Progress::default();
    progress.cancel();
    assert!(Prepared::new(homogeneous(small()), Kernel::best()).unwrap().deterministic(&progress).is_err());
}

/// Without water the initial pore pressure and the ground surface's condition do not matter.
#[test]
fn one_phase_knows_no_water() {
    let dry = run(homogeneous(small()), Kernel::best());
    let mut model = small();
    model.water.initial_pore_pressure = InitialPorePressure::Hydrostatic(WaterTable::GroundSurface);
    model.water.ground_surface = GroundSurface::Closed;
    assert_eq!(run(homogeneous(model), Kernel::best()), dry);
}
