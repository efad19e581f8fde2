//! Claims about generated fields: the marginals, the rank correlation and the autocorrelation are those asked for, the
//! bedding turns, and the same (seed, index) gives the same bits.
//!
//! Every statistic comes from a fixed seed, so that a test passes always or never; the tolerances are what a right
//! generator would exceed with a chance below 1e-4 for an arbitrary seed. They are derived where they are used.

use runout_core::campaign::{Autocorrelation, Field};
use runout_core::copula::Copula;
use runout_core::field::autocorrelation::correlation;
use runout_core::field::{FieldError, FieldPlan, FieldSample, Scratch};
use runout_core::marginal::{Family, Marginal};
use runout_core::site::Property;
use runout_core::spec::RandomProperty;
use statrs::distribution::{ContinuousCDF, Normal};

const FAMILIES: [Autocorrelation; 5] = [
    Autocorrelation::SingleExponential,
    Autocorrelation::SquaredExponential,
    Autocorrelation::SecondOrderMarkov,
    Autocorrelation::CosineExponential,
    Autocorrelation::BinaryNoise,
];

/// Standard errors allowed: a normal statistic is further off once in 150,000 times.
const SIGMAS: f64 = 4.5;

fn field(autocorrelation: Autocorrelation, scale_horizontal_m: f64, scale_vertical_m: f64) -> Field {
    Field { autocorrelation, scale_horizontal_m, scale_vertical_m, rotation_rad: 0.0 }
}

fn random(marginals: &[(Property, Family, f64, f64)]) -> Vec<RandomProperty> {
    marginals
        .iter()
        .map(|&(property, family, p, q)| RandomProperty { property, marginal: Marginal { family, p, q } })
        .collect()
}

/// Cohesion and friction angle, near the paper's Table 4.
fn two_properties() -> Vec<RandomProperty> {
    random(&[
        (Property::Cohesion, Family::TruncNormal, 11.412, 6.1915),
        (Property::FrictionAngle, Family::Weibull, 29.37, 5.75),
    ])
}

/// Near the paper's Table 7.
fn three_properties() -> Vec<RandomProperty> {
    random(&[
        (Property::Cohesion, Family::TruncGumbel, 7.1357, 0.152_28),
        (Property::FrictionAngle, Family::Weibull, 29.4327, 3.9145),
        (Property::UnitWeight, Family::Lognormal, 2.83, 0.08),
    ])
}

/// The paper's Table 8.
fn gaussian_three() -> Copula {
    Copula::Gaussian { correlation: table_8() }
}

fn table_8() -> Vec<Vec<f64>> {
    vec![
        vec![1.0, -0.332_118, -0.013_818],
        vec![-0.332_118, 1.0, -0.260_933],
        vec![-0.013_818, -0.260_933, 1.0],
    ]
}

/// Points of a rectangle, row by row.
fn rectangle(columns: usize, rows: usize, spacing_m: f64) -> (Vec<f64>, Vec<f64>) {
    (0..columns * rows).map(|i| ((i % columns) as f64 * spacing_m, (i / columns) as f64 * spacing_m)).unzip()
}

fn plan(
    field: &Field,
    random: &[RandomProperty],
    copula: &Copula,
    columns: usize,
    rows: usize,
    spacing_m: f64,
) -> FieldPlan {
    let (x, y) = rectangle(columns, rows, spacing_m);
    FieldPlan::new(field, random, copula, spacing_m, &x, &y).unwrap()
}

/// Largest distance between the empirical distribution of `values` and `cdf`, times sqrt(n).
fn kolmogorov_smirnov(mut values: Vec<f64>, cdf: impl Fn(f64) -> f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let distance = |(i, x): (usize, &f64)| {
        let probability = cdf(*x);
        (probability - i as f64 / n).max((i + 1) as f64 / n - probability)
    };
    values.iter().enumerate().map(distance).fold(0.0, f64::max) * n.sqrt()
}

/// Distribution functions of the paper's Table 1, written out anew.
fn cdf(marginal: &Marginal, x: f64) -> f64 {
    let normal = |z: f64| Normal::new(0.0, 1.0).unwrap().cdf(z);
    let Marginal { family, p, q } = *marginal;
    let truncated = |f: &dyn Fn(f64) -> f64| (f(x) - f(0.0)) / (1.0 - f(0.0));
    match family {
        Family::TruncNormal => truncated(&|x| normal((x - p) / q)),
        Family::TruncGumbel => truncated(&|x| libm::exp(-libm::exp(-q * (x - p)))),
        Family::Lognormal => normal((libm::log(x) - p) / q),
        Family::Weibull => 1.0 - libm::exp(-libm::pow(x / p, q)),
    }
}

/// Kolmogorov's distribution gives P(D sqrt(n) > 2.4) = 2 exp(-2 * 2.4^2) = 2e-5. Cells 10 m apart correlate by
/// exp(-10) = 5e-5 at a scale of 2 m: independent for 10,000 values.
#[test]
fn marginals_pass_kolmogorov_smirnov_on_decorrelated_cells() {
    let cases = [
        (two_properties(), Copula::No16 { theta: 0.017_395_3 }),
        (two_properties(), Copula::Frank { theta: -5.17 }),
        (two_properties(), Copula::Plackett { theta: 0.1055 }),
        (three_properties(), gaussian_three()),
        (three_properties(), Copula::Independent { dimension: 3 }),
    ];
    let field = field(Autocorrelation::SingleExponential, 2.0, 2.0);
    for (random, copula) in cases {
        let plan = plan(&field, &random, &copula, 101, 41, 1.0);
        let apart: Vec<usize> = (0..101 * 41).filter(|i| i % 101 % 10 == 0 && i / 101 % 10 == 0).collect();
        let mut pooled = vec![Vec::new(); random.len()];
        for index in 0..182 {
            let sample = plan.sample(11, index);
            for (values, pooled) in sample.values.iter().zip(&mut pooled) {
                pooled.extend(apart.iter().map(|&i| values[i]));
            }
        }
        for (values, random) in pooled.into_iter().zip(&random) {
            assert_eq!(values.len(), 10_010);
            let statistic = kolmogorov_smirnov(values, |x| cdf(&random.marginal, x));
            assert!(statistic < 2.4, "{} under {copula:?}: {statistic}", random.property.name());
        }
    }
}

/// Kendall's tau of n independent pairs has variance at most 2 (1 - tau^2) / n (Kendall & Gibbons 1990, Section 5.8).
/// One cell a realisation, since a Student t copula's cells share their mixing variable.
#[test]
fn rank_correlations_are_the_copulas() {
    const PAIRS: u64 = 8000;
    let of_pearson = |r: f64| std::f64::consts::FRAC_2_PI * libm::asin(r);
    let field = field(Autocorrelation::SingleExponential, 2.0, 2.0);
    let matrix = table_8();
    let student = Copula::StudentT { correlation: matrix.clone(), degrees_of_freedom: 5.0 };
    let elliptical = [
        (0, 1, of_pearson(matrix[0][1])),
        (0, 2, of_pearson(matrix[0][2])),
        (1, 2, of_pearson(matrix[1][2])),
    ];
    // The three thetas are the paper's, by inversion of the tau -.467228 of its Table 2.
    let cases = [
        (two_properties(), Copula::No16 { theta: 0.017_395_307_2 }, vec![(0, 1, -0.467_228)]),
        (two_properties(), Copula::Frank { theta: -5.170_310_443 }, vec![(0, 1, -0.467_228)]),
        (two_properties(), Copula::Plackett { theta: 0.105_528_25 }, vec![(0, 1, -0.467_228)]),
        (three_properties(), gaussian_three(), elliptical.to_vec()),
        (three_properties(), student, elliptical.to_vec()),
    ];
    for (random, copula, wanted) in cases {
        let plan = plan(&field, &random, &copula, 1, 1, 1.0);
        let mut columns = vec![Vec::new(); random.len()];
        for index in 0..PAIRS {
            let sample = plan.sample(12, index);
            columns.iter_mut().zip(&sample.values).for_each(|(column, values)| column.push(values[0]));
        }
        for (i, j, tau) in wanted {
            let found = kendall_tau(&columns[i], &columns[j]);
            let allowed = SIGMAS * (2.0 * (1.0 - tau * tau) / PAIRS as f64).sqrt();
            assert!((found - tau).abs() < allowed, "{copula:?} {i} {j}: {found}, wanted {tau} +- {allowed}");
        }
    }
}

fn kendall_tau(a: &[f64], b: &[f64]) -> f64 {
    let mut balance = 0_i64;
    for i in 0..a.len() {
        for j in 0..i {
            balance += if (a[i] > a[j]) == (b[i] > b[j]) { 1 } else { -1 };
        }
    }
    balance as f64 / (a.len() * (a.len() - 1) / 2) as f64
}

/// The product of two standard normals that correlate by r has variance 1 + r^2: over R realisations of one pair the
/// mean product has standard error sqrt((1 + r^2) / R). Six pairs a field are looked at one by one.
#[test]
fn autocorrelation_is_as_asked_in_both_directions() {
    const FIELDS: u64 = 20_000;
    const COLUMNS: usize = 13;
    let pairs = [(0, 1), (0, 3), (0, 12), (0, COLUMNS), (0, 4 * COLUMNS), (2, 3 * COLUMNS + 7)];
    for family in FAMILIES {
        let field = field(family, 4.0, 1.0);
        let plan = plan(&field, &two_properties(), &Copula::Independent { dimension: 2 }, COLUMNS, 5, 0.25);
        let mut sums = [0.0; 6];
        let mut across = 0.0;
        let mut squares = 0.0;
        for index in 0..FIELDS {
            let latent = plan.latent(13, index);
            for (sum, (a, b)) in sums.iter_mut().zip(pairs) {
                *sum += latent[0][a] * latent[0][b];
            }
            across += latent[0][20] * latent[1][20];
            squares += latent[1][20] * latent[1][20];
        }
        let count = FIELDS as f64;
        for (sum, (a, b)) in sums.into_iter().zip(pairs) {
            let lag = |a: usize, b: usize| a.abs_diff(b) as f64 * 0.25;
            let wanted = correlation(family, lag(a % COLUMNS, b % COLUMNS), 4.0)
                * correlation(family, lag(a / COLUMNS, b / COLUMNS), 1.0);
            let allowed = SIGMAS * ((1.0 + wanted * wanted) / count).sqrt();
            let found = sum / count;
            assert!((found - wanted).abs() < allowed, "{family:?} {a} {b}: {found}, wanted {wanted}");
        }
        // Latent fields of two properties are independent, each of unit variance (variance of a square: 2).
        assert!((across / count).abs() < SIGMAS / count.sqrt(), "{family:?}: {across}");
        assert!((squares / count - 1.0).abs() < SIGMAS * (2.0 / count).sqrt(), "{family:?}: {squares}");
    }
}

/// Bedding that dips by 45 degrees: points along it keep the long scale, points across it the short one. What is wanted
/// follows from the cells the points were given, which must be the turned points to half a cell.
#[test]
fn rotation_turns_the_bedding() {
    const FIELDS: u64 = 20_000;
    const SIDE: usize = 9;
    let turned = Field {
        rotation_rad: std::f64::consts::FRAC_PI_4,
        ..field(Autocorrelation::SingleExponential, 8.0, 1.0)
    };
    let plan = plan(&turned, &two_properties(), &Copula::Independent { dimension: 2 }, SIDE, SIDE, 0.5);
    let lattice = plan.lattice();
    let cells = lattice.cells();
    let place = |point: usize| {
        let cell = cells[point];
        ((cell % lattice.columns) as f64 * 0.25, (cell / lattice.columns) as f64 * 0.25)
    };
    let centre = 4 * SIDE + 4;
    // (column, row) steps, along the bedding (up to the right) and across it.
    for (point, along_m, across_m) in [
        (centre + SIDE + 1, 0.5_f64.sqrt(), 0.0),
        (centre + 4 * SIDE + 4, 8.0_f64.sqrt(), 0.0),
        (centre + SIDE - 1, 0.0, 0.5_f64.sqrt()),
        (centre + 2 * SIDE - 2, 0.0, 2.0_f64.sqrt()),
    ] {
        let (dx, dy) = ((place(point).0 - place(centre).0).abs(), (place(point).1 - place(centre).1).abs());
        // Half a cell for either point.
        assert!((dx - along_m).abs() <= 0.25 + 1e-12 && (dy - across_m).abs() <= 0.25 + 1e-12, "{dx} {dy}");
        let wanted = libm::exp(-2.0 * (dx / 8.0 + dy / 1.0));
        let product = |index| {
            let latent = plan.latent(14, index);
            latent[0][centre] * latent[0][point]
        };
        let found = (0..FIELDS).map(product).sum::<f64>() / FIELDS as f64;
        let allowed = SIGMAS * ((1.0 + wanted * wanted) / FIELDS as f64).sqrt();
        assert!((found - wanted).abs() < allowed, "{along_m} {across_m}: {found}, wanted {wanted}");
    }
}

#[test]
fn an_infinite_scale_gives_a_homogeneous_slope() {
    for family in FAMILIES {
        let infinite = field(family, f64::INFINITY, f64::INFINITY);
        let sample =
            plan(&infinite, &two_properties(), &Copula::No16 { theta: 0.0174 }, 20, 10, 0.2).sample(1, 0);
        for values in &sample.values {
            assert!(values.iter().all(|v| *v == values[0]), "{family:?}");
        }
    }
}

/// Neighbours of white noise: 200 * 99 products, of variance one each and uncorrelated.
#[test]
fn a_tiny_scale_gives_independent_cells() {
    for family in FAMILIES {
        let tiny = field(family, 1e-3, 1e-3);
        let latent =
            plan(&tiny, &two_properties(), &Copula::Independent { dimension: 2 }, 100, 200, 0.2).latent(2, 0);
        let neighbours = latent[0].chunks(100).flat_map(|row| row.windows(2).map(|w| w[0] * w[1]));
        let mean = neighbours.sum::<f64>() / 19_800.0;
        assert!(mean.abs() < SIGMAS / 19_800.0_f64.sqrt(), "{family:?}: {mean}");
    }
}

#[test]
fn a_property_more_leaves_the_noise_of_the_others() {
    let field = field(Autocorrelation::SecondOrderMarkov, 2.0, 1.0);
    let all = three_properties();
    let three = plan(&field, &all, &gaussian_three(), 8, 6, 0.2).latent(3, 4);
    let two = plan(&field, &all[1..], &Copula::Frank { theta: 2.0 }, 8, 6, 0.2).latent(3, 4);
    assert_eq!(three[1..], two[..]);
}

#[test]
fn the_same_seed_and_index_give_the_same_bits() {
    let digest = |sample: &FieldSample| {
        let mut hasher = blake3::Hasher::new();
        sample.values.iter().flatten().for_each(|v| {
            hasher.update(&v.to_le_bytes());
        });
        hasher.finalize().to_hex()[..32].to_owned()
    };
    let swept = plan(
        &field(Autocorrelation::SingleExponential, 2.0, 1.0),
        &two_properties(),
        &Copula::No16 { theta: 0.017_395_307_2 },
        40,
        20,
        0.2,
    );
    let factored = plan(
        &field(Autocorrelation::SquaredExponential, 2.0, 1.0),
        &three_properties(),
        &gaussian_three(),
        40,
        20,
        0.2,
    );
    // Golden digests: whatever changes them makes old campaigns irreproducible and must raise the spec's format.
    assert_eq!(digest(&swept.sample(20_260_101, 7)), "b954aa0b39a0e2104dc13d037215d09e");
    assert_eq!(digest(&factored.sample(20_260_101, 7)), "94be6014933a88ad36dc11155ebbbcdb");

    // Neither the buffers nor what was sampled before leave a trace.
    let (mut scratch, mut sample) = (Scratch::default(), FieldSample::default());
    factored.sample_into(1, 1, &mut scratch, &mut sample);
    swept.sample_into(20_260_101, 7, &mut scratch, &mut sample);
    assert_eq!(sample, swept.sample(20_260_101, 7));
    assert_ne!(sample, swept.sample(20_260_101, 8));
    assert_ne!(sample, swept.sample(20_260_102, 7));
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_values() {
    let (x, y) = rectangle(4, 3, 0.2);
    let error = |field: &Field, random: &[RandomProperty], copula: &Copula| {
        FieldPlan::new(field, random, copula, 0.2, &x, &y).unwrap_err()
    };
    let good = field(Autocorrelation::SingleExponential, 2.0, 2.0);
    let frank = Copula::Frank { theta: 2.0 };
    let bad = Field { scale_vertical_m: -1.0, ..good };
    let refused = error(&bad, &two_properties(), &frank);
    assert_eq!(refused.to_string(), "scale_vertical_m = -1 is not allowed in a random field");
    assert_eq!(
        error(&good, &three_properties(), &frank),
        FieldError::Dimension { dimension: 2, properties: 3 }
    );
    let refused = error(&good, &two_properties(), &Copula::No16 { theta: -1.0 });
    assert!(matches!(refused, FieldError::Copula(_)));
    let nonsense = random(&[
        (Property::Cohesion, Family::Weibull, -1.0, 2.0),
        (Property::FrictionAngle, Family::Weibull, 30.0, 2.0),
    ]);
    let refused = error(&good, &nonsense, &frank);
    assert!(matches!(refused, FieldError::Marginal { property: "cohesion_kpa", .. }));
}
