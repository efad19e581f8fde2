//! Milliseconds a field: a 15 m slope at 45 degrees with points 0.2 m apart, cohesion and friction angle tied by the
//! No.16 copula, as fitted to the paper's Table 2. Run with `cargo bench -p runout-core --bench field`.
//!
//! A plain loop and a clock: the median of a hundred fields says what is needed here.

use runout_core::campaign::{Autocorrelation, Field};
use runout_core::copula::Copula;
use runout_core::field::{FieldPlan, FieldSample, Scratch};
use runout_core::marginal::{Family, Marginal};
use runout_core::site::Property;
use runout_core::spec::RandomProperty;
use std::hint::black_box;
use std::time::Instant;

const FIELDS: u64 = 100;

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
        time(name, &random, copula, Autocorrelation::SingleExponential, 0.0);
    }
    for (autocorrelation, rotation_rad) in [
        (Autocorrelation::SquaredExponential, 0.0),
        (Autocorrelation::BinaryNoise, 0.0),
        (Autocorrelation::SingleExponential, 0.5),
    ] {
        time("no16", &random, &copulas[0].1, autocorrelation, rotation_rad);
    }
}

fn time(
    name: &str,
    random: &[RandomProperty],
    copula: &Copula,
    autocorrelation: Autocorrelation,
    rotation_rad: f64,
) {
    let (x, y) = slope_points();
    let field = Field { autocorrelation, scale_horizontal_m: 2.0, scale_vertical_m: 2.0, rotation_rad };
    let start = Instant::now();
    let plan = FieldPlan::new(&field, random, copula, 0.2, &x, &y).expect("a valid plan");
    let set_up_ms = start.elapsed().as_secs_f64() * 1e3;
    let (mut scratch, mut sample) = (Scratch::default(), FieldSample::default());
    let mut times_ms: Vec<f64> = (0..FIELDS)
        .map(|index| {
            let start = Instant::now();
            plan.sample_into(1, index, &mut scratch, black_box(&mut sample));
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times_ms.sort_by(f64::total_cmp);
    println!(
        "{name}, {autocorrelation:?}, rotation {rotation_rad}: {} points, {} cells, set-up {set_up_ms:.2} ms, \
         median {:.3} ms, least {:.3} ms",
        x.len(),
        plan.lattice().size(),
        times_ms[times_ms.len() / 2],
        times_ms[0],
    );
}

/// Points of a bank 15 m high with a crest of 19.5 m: 75 rows, the lowest of 172 points; 10,125 in all.
fn slope_points() -> (Vec<f64>, Vec<f64>) {
    let row = |row: u32| (0..172 - row).map(move |column| (f64::from(column) * 0.2, f64::from(row) * 0.2));
    (0..75).flat_map(row).unzip()
}
