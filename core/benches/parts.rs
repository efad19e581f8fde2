//! Time of each part of a realisation, in the data's order: copula inverse, marginal quantiles, field, time step,
//! preparation and a small realisation. Run with `cargo bench -p runout-core --bench parts [-- FILTER]`.
//!
//! Wall time, by criterion; `solver` gives the solver's headline figure in processor time, `field` the fields of other
//! kinds and sizes, `instructions` counts that a busy machine does not move.

mod common;

use common::{CELL_M, flowing_slope, random_properties, spec};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use runout_core::campaign::Formulation;
use runout_core::copula::{Copula, Sampler};
use runout_core::field::{FieldPlan, FieldSample, Scratch};
use runout_core::gimp::{Body, Kernel};
use runout_core::marginal::{Family, Marginal, Quantile};
use runout_core::realisation::{Prepared, Progress, probe};
use runout_core::spec::Spec;
use std::hint::black_box;
use std::time::Duration;

/// Cells of a field that copulas and marginals are timed on: a slope's.
const CELLS: usize = 10_125;
/// Steps in a row, so that sorting has its share; both formulations sort at least once in them.
const STEPS: u32 = 60;

criterion_group! {
    name = parts;
    // The whole file within a minute: spreads of some per cent are enough here.
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    targets = copulas, marginals, field, steps, realisation
}
criterion_main!(parts);

/// Normal numbers to dependent uniform ones, two properties.
fn copulas(criterion: &mut Criterion) {
    let pair = vec![vec![1.0, -0.67], vec![-0.67, 1.0]];
    let families = [
        Copula::Independent { dimension: 2 },
        Copula::Gaussian { correlation: pair.clone() },
        Copula::StudentT { correlation: pair, degrees_of_freedom: 10.0 },
        Copula::Plackett { theta: 0.1 },
        Copula::Frank { theta: -5.5 },
        random_properties().1,
    ];
    let mut group = criterion.benchmark_group("copula");
    group.throughput(Throughput::Elements(CELLS as u64));
    for copula in families {
        let sampler = Sampler::new(&copula).expect("a sound copula");
        group.bench_function(copula.family().name(), |bencher| {
            let normal = [normals(0.618_034), normals(0.754_878)];
            bencher.iter_batched_ref(
                || normal.clone(),
                |[a, b]| sampler.uniforms(&mut [a, b], 1.0),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

/// Uniform numbers to a property's values.
fn marginals(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("marginal");
    group.throughput(Throughput::Elements(CELLS as u64));
    for (family, p, q) in [
        (Family::TruncNormal, 11.412, 6.1915),
        (Family::Lognormal, 2.3, 0.5),
        (Family::TruncGumbel, 16.27, 0.8849),
        (Family::Weibull, 29.37, 5.75),
    ] {
        let quantile = Quantile::new(&Marginal::new(family, p, q).expect("a sound marginal"));
        group.bench_function(family.name(), |bencher| {
            let uniform: Vec<f64> = (0..CELLS).map(|i| weyl(i, 0.618_034)).collect();
            bencher.iter_batched_ref(
                || uniform.clone(),
                |values| quantile.apply(values),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

/// Both properties at all points: white noise, autocorrelation, copula and marginals.
fn field(criterion: &mut Criterion) {
    let spec = random_spec(Formulation::OnePhase);
    let prepared = Prepared::new(spec.clone(), Kernel::best()).expect("a sound model");
    let layout = prepared.layout();
    let plan =
        FieldPlan::new(&spec.model.field, &spec.random, &spec.copula, layout.spacing_m, &layout.x, &layout.y)
            .expect("a sound plan");
    let (mut scratch, mut sample) = (Scratch::default(), FieldSample::default());
    let mut index = 0;
    criterion.bench_function("field/two properties", |bencher| {
        bencher.iter(|| {
            index += 1;
            plan.sample_into(1, index, &mut scratch, black_box(&mut sample));
        });
    });
}

/// Steps of a developed flow, each formulation on each kernel.
fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("steps");
    for formulation in [Formulation::OnePhase, Formulation::TwoPhase] {
        let setup = flowing_slope(formulation, CELL_M);
        group.throughput(Throughput::Elements(setup.points.len() as u64 * u64::from(STEPS)));
        for kernel in Kernel::available().into_iter().filter(|&k| k != Kernel::Baseline) {
            let mut body = Body::new(setup.clone(), kernel).expect("a sound model");
            run(&mut body, STEPS);
            let name = format!("{} {}", common::name(formulation), kernel.name());
            group.bench_function(name, |bencher| {
                bencher.iter_batched_ref(|| body.clone(), |body| run(body, STEPS), BatchSize::PerIteration);
            });
        }
    }
    group.finish();
}

/// What a worker does once, and a realisation of a few milliseconds (two phases, 26 points, both stages), whose steps
/// weigh little against the rest. The slow baseline is timed here only.
fn realisation(criterion: &mut Criterion) {
    let spec = random_spec(Formulation::TwoPhase);
    criterion.bench_function("realisation/preparation", |bencher| {
        bencher.iter(|| Prepared::new(black_box(spec.clone()), Kernel::best()));
    });
    for kernel in Kernel::available() {
        criterion.bench_function(&format!("realisation/probe {}", kernel.name()), |bencher| {
            bencher.iter(|| probe(kernel));
        });
    }
    let mut stable = random_spec(Formulation::OnePhase);
    stable.model.maximum_steps = 1;
    let prepared = Prepared::new(stable, Kernel::best()).expect("a sound model");
    let mut index = 0;
    criterion.bench_function("realisation/one step, with fields and measures", |bencher| {
        bencher.iter(|| {
            index += 1;
            prepared.realise(index, &Progress::default())
        });
    });
}

fn random_spec(formulation: Formulation) -> Spec {
    let mut spec = spec(formulation);
    (spec.random, spec.copula) = random_properties();
    spec.model.soil.cohesion_pa = None;
    spec.model.soil.friction_angle_rad = None;
    spec
}

fn run(body: &mut Body, steps: u32) {
    for _ in 0..steps {
        black_box(body.step(body.stable_step_s()));
    }
}

/// Number `i` of a sequence in (0, 1) that fills it evenly.
fn weyl(i: usize, step: f64) -> f64 {
    ((i as f64 + 0.5) * step).fract()
}

/// Standard normal numbers, evenly spread.
fn normals(step: f64) -> Vec<f64> {
    let uniform = |i| weyl(i, step);
    (0..CELLS).map(|i| runout_core::special::normal_quantile(uniform(i))).collect()
}
