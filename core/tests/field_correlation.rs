//! Claim: the autoregressive sweeps and the Kronecker factors give the same field as dense Cholesky decomposition of the
//! whole lattice's correlation matrix, draw for draw.
//!
//! Tolerance 1e-12: the correlation matrices used here have condition numbers of at most 3.5e3 (from their eigenvalues;
//! the grids are chosen so), which magnify the rounding of 1.1e-16 to 4e-13 of a factor's entries, all below one.

use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use runout_core::campaign::{Autocorrelation, Field};
use runout_core::field::dense::Dense;
use runout_core::field::factor::{Factor, LARGEST_NUGGET, MOST_PLACES};
use runout_core::field::kronecker::Kronecker;
use runout_core::field::sweep::Sweeps;

const FAMILIES: [Autocorrelation; 5] = [
    Autocorrelation::SingleExponential,
    Autocorrelation::SquaredExponential,
    Autocorrelation::SecondOrderMarkov,
    Autocorrelation::CosineExponential,
    Autocorrelation::BinaryNoise,
];

const COLUMNS: usize = 13;
const ROWS: usize = 9;

fn field(autocorrelation: Autocorrelation, scale_horizontal_m: f64, scale_vertical_m: f64) -> Field {
    Field { autocorrelation, scale_horizontal_m, scale_vertical_m, rotation_rad: 0.0 }
}

/// Numbers in (-2, 2): draw for draw equality needs no normal distribution.
fn noise(seed: u64, cells: usize) -> Vec<f64> {
    let mut stream = ChaCha12Rng::seed_from_u64(seed);
    (0..cells).map(|_| (stream.next_u64() >> 11) as f64 / (1_u64 << 51) as f64 - 2.0).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn sweeps_equal_dense_cholesky_draw_for_draw() {
    for (horizontal, vertical) in [(2.0, 2.0), (10.0, 0.5), (0.1, 40.0)] {
        let field = field(Autocorrelation::SingleExponential, horizontal, vertical);
        let dense = Dense::new(&field, 0.2, COLUMNS, ROWS).unwrap();
        let mut swept = noise(1, COLUMNS * ROWS);
        let wanted = dense.correlate(&swept);
        Sweeps::new(&field, 0.2, COLUMNS).correlate(&mut swept);
        let difference = largest_difference(&swept, &wanted);
        assert!(difference < 1e-12, "{horizontal} {vertical}: {difference:e}");
    }
}

#[test]
fn kronecker_factors_equal_dense_cholesky_draw_for_draw() {
    for family in FAMILIES {
        let field = field(family, 0.6, 0.4);
        let dense = Dense::new(&field, 0.2, COLUMNS, ROWS).unwrap();
        let factors = Kronecker::new(&field, 0.2, COLUMNS, ROWS).unwrap();
        assert_eq!(factors.nugget(), 0.0);
        let mut values = noise(2, COLUMNS * ROWS);
        let wanted = dense.correlate(&values);
        factors.correlate(&mut values, &mut Vec::new());
        let difference = largest_difference(&values, &wanted);
        assert!(difference < 1e-12, "{family:?}: {difference:e}");
    }
}

#[test]
fn a_nearly_singular_matrix_is_reproduced_within_its_nugget() {
    // Scales of 10 to 1000 cells. L L^T must be the correlation matrix: an error of the nugget, plus the rounding of 172
    // sums of products below one (172 * 1.1e-16 = 1.9e-14).
    for family in FAMILIES {
        for scale in [2.0, 20.0, 200.0] {
            let factor = Factor::new(family, scale, 0.2, 172).unwrap();
            assert!(factor.nugget() <= LARGEST_NUGGET);
            let mut worst = 0.0_f64;
            for i in 0..172 {
                for j in 0..=i {
                    let product: f64 = (0..=j).map(|k| factor.entry(i, k) * factor.entry(j, k)).sum();
                    let wanted =
                        runout_core::field::autocorrelation::correlation(family, (i - j) as f64 * 0.2, scale);
                    worst = worst.max((product - wanted).abs());
                }
            }
            let allowed = factor.nugget() + 1e-13;
            assert!(worst <= allowed, "{family:?} {scale}: {worst:e} > {allowed:e}");
        }
    }
}

#[test]
fn an_infinite_scale_is_homogeneous_and_a_tiny_one_is_white() {
    for family in FAMILIES {
        let mut values = noise(3, COLUMNS * ROWS);
        let first = values[0];
        let infinite = field(family, f64::INFINITY, f64::INFINITY);
        Kronecker::new(&infinite, 0.2, COLUMNS, ROWS).unwrap().correlate(&mut values, &mut Vec::new());
        assert!(values.iter().all(|v| *v == first), "{family:?}");

        let mut values = noise(3, COLUMNS * ROWS);
        let tiny = field(family, 1e-4, 1e-4);
        Kronecker::new(&tiny, 0.2, COLUMNS, ROWS).unwrap().correlate(&mut values, &mut Vec::new());
        assert_eq!(values, noise(3, COLUMNS * ROWS), "{family:?}");
    }
    let mut values = noise(3, COLUMNS * ROWS);
    let first = values[0];
    let infinite = field(Autocorrelation::SingleExponential, f64::INFINITY, f64::INFINITY);
    Sweeps::new(&infinite, 0.2, COLUMNS).correlate(&mut values);
    assert!(values.iter().all(|v| *v == first));
}

#[test]
fn a_factor_of_absurd_size_is_refused() {
    let refused = Factor::new(Autocorrelation::BinaryNoise, 2.0, 0.2, MOST_PLACES + 1).unwrap_err();
    assert!(
        refused.to_string().starts_with("a lattice of 2049 cells along one axis is too long"),
        "{refused}"
    );
}
