//! Milliseconds a field: a 15 m slope at 45 degrees with points 0.2 m apart (10,125) and 0.02 m apart (1,009,125), cohesion
//! and friction angle tied by the No.16 copula, as fitted to the paper's Table 2. Run with
//! `cargo bench -p runout-core --bench field`.
//!
//! A plain loop and the thread's processor time (wall time where the system does not tell), which is counted in ticks:
//! fields are timed in batches, of which the median says what is needed here, and the least what the processor can do
//! when nothing else runs on it.

use runout_core::campaign::{Autocorrelation, Field};
use runout_core::copula::Copula;
use runout_core::field::{FieldPlan, FieldSample, Scratch};
use runout_core::marginal::{Family, Marginal};
use runout_core::site::Property;
use runout_core::spec::RandomProperty;
use std::hint::black_box;
use std::time::Instant;

const BATCHES: u64 = 10;

/// Fields of a batch; a large field is a batch of its own.
const FIELDS: u64 = 100;

/// Points of the large slope along one spacing of the small one.
const REFINEMENT: u32 = 10;

const MIB: f64 = (1_u32 << 20) as f64;

fn main() {
    let random = [
        RandomProperty {
            property: Property::Cohesion,
            marginal: Marginal::new(Family::TruncNormal, 11.412, 6.1915).expect("the paper's fit"),
        },
        RandomProperty {
            property: Property::FrictionAngle,
            marginal: Marginal::new(Family::Weibull, 29.37, 5.75).expect("near the paper's fit"),
        },
    ];
    let pair = vec![vec![1.0, -0.67], vec![-0.67, 1.0]];
    let copulas = [
        ("no16", Copula::No16 { theta: 0.017_395_307_2 }),
        ("gaussian", Copula::Gaussian { correlation: pair.clone() }),
        ("student-t", Copula::StudentT { correlation: pair, degrees_of_freedom: 10.0 }),
    ];
    for (name, copula) in &copulas {
        time(name, &random, copula, Autocorrelation::SingleExponential, 0.0, 1);
    }
    for (name, copula) in [
        ("frank", Copula::Frank { theta: -5.170_310_443 }),
        ("plackett", Copula::Plackett { theta: 0.105_528_25 }),
    ] {
        time(name, &random, &copula, Autocorrelation::SingleExponential, 0.0, 1);
    }
    for (autocorrelation, rotation_rad) in [
        (Autocorrelation::SquaredExponential, 0.0),
        (Autocorrelation::BinaryNoise, 0.0),
        (Autocorrelation::SingleExponential, 0.5),
    ] {
        time("no16", &random, &copulas[0].1, autocorrelation, rotation_rad, 1);
    }
    for (name, copula) in &copulas {
        time(name, &random, copula, Autocorrelation::SingleExponential, 0.0, REFINEMENT);
    }
}

fn time(
    name: &str,
    random: &[RandomProperty],
    copula: &Copula,
    autocorrelation: Autocorrelation,
    rotation_rad: f64,
    refinement: u32,
) {
    let (x, y) = slope_points(refinement);
    let field = Field { autocorrelation, scale_horizontal_m: 2.0, scale_vertical_m: 2.0, rotation_rad };
    let start = Instant::now();
    let spacing_m = 0.2 / f64::from(refinement);
    let plan = FieldPlan::new(&field, random, copula, spacing_m, &x, &y).expect("a valid plan");
    let set_up_ms = start.elapsed().as_secs_f64() * 1e3;
    let (mut scratch, mut sample) = (Scratch::default(), FieldSample::default());
    let fields = if refinement == 1 { FIELDS } else { 1 };
    let mut batch_ms = |batch: u64| {
        let start = (Instant::now(), processor_ms());
        for index in batch * fields..(batch + 1) * fields {
            plan.sample_into(1, index, &mut scratch, black_box(&mut sample));
        }
        let wall_ms = start.0.elapsed().as_secs_f64() * 1e3;
        processor_ms().zip(start.1).map_or(wall_ms, |(end, start)| end - start) / fields as f64
    };
    let mut times_ms: Vec<f64> = (0..BATCHES).map(&mut batch_ms).collect();
    times_ms.sort_by(f64::total_cmp);
    println!(
        "{name}, {autocorrelation:?}, rotation {rotation_rad}: {} points, {} cells, {:.1} MiB, set-up {set_up_ms:.2} ms, \
         median {:.3} ms, least {:.3} ms",
        x.len(),
        plan.lattice().size(),
        memory_bytes(&plan, random.len(), autocorrelation) / MIB,
        times_ms[times_ms.len() / 2],
        times_ms[0],
    );
}

/// Processor time of this thread, ms: the first number of Linux's schedstat, in ns.
fn processor_ms() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-6)
}

/// Each point's place in the plan, one value a point and property in the sample, and a row's buffers; with factors two
/// values a cell instead of these (their entries are not counted).
fn memory_bytes(plan: &FieldPlan, properties: usize, autocorrelation: Autocorrelation) -> f64 {
    let lattice = plan.lattice();
    let buffers = match autocorrelation {
        Autocorrelation::SingleExponential => lattice.columns * (2 * properties + 1),
        _ => lattice.size() * (properties + 1),
    };
    (size_of::<f64>() * (lattice.points() * (1 + properties) + buffers)) as f64
}

/// Points of a bank 15 m high with a crest of 19.5 m: 75 rows times `refinement`, the lowest of 172 points times it.
fn slope_points(refinement: u32) -> (Vec<f64>, Vec<f64>) {
    let spacing_m = 0.2 / f64::from(refinement);
    let row = move |row: u32| {
        (0..172 * refinement - row).map(move |i| (f64::from(i) * spacing_m, f64::from(row) * spacing_m))
    };
    (0..75 * refinement).flat_map(row).unzip()
}
