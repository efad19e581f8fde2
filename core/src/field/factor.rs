//! Cholesky factor of a one-dimensional correlation matrix, with the same bits on every host.
//!
//! Hand-written because a field must not depend on which instructions the processor has: the sums run in index
//! order and nothing is fused.

use super::FieldError;
use super::autocorrelation::correlation;
use crate::campaign::Autocorrelation;

/// Largest nugget, as a share of the variance, that may be added to make a correlation matrix factorable.
///
/// Smooth families on a grid much finer than their scale have correlation matrices whose smallest eigenvalues are
/// below rounding. A nugget e turns each correlation r off the diagonal into r / (1 + e), a change no soil test could
/// see at this size; rounding alone asks for about n times 1e-16.
pub const LARGEST_NUGGET: f64 = 1e-10;

/// Most places along one axis: the factor has that number squared of entries (32 MiB) and takes its cube over six
/// operations (a few seconds). The single-exponential family needs no factor and has no such limit.
pub const MOST_PLACES: usize = 2048;

/// Values of a row that are summed side by side, in registers.
const LANES: usize = 16;

/// First nugget tried after none; each further one is ten times the last.
const SMALLEST_NUGGET: f64 = 1e-14;

/// Lower-triangular factor L of the correlation matrix of equally spaced places: L L^T = (C + nugget I) / (1 + nugget).
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    size: usize,
    /// Row-major, `size` x `size`; zero above the diagonal.
    entries: Vec<f64>,
    /// First column of each row that is not zero: factors of banded matrices are banded.
    first: Vec<usize>,
    nugget: f64,
}

impl Factor {
    /// Factorises the correlation matrix of `size` places `spacing_m` apart.
    ///
    /// # Errors
    /// [`FieldError::LongSide`] beyond [`MOST_PLACES`]; [`FieldError::Singular`] if [`LARGEST_NUGGET`] does not make the
    /// matrix positive definite.
    pub fn new(
        family: Autocorrelation,
        scale_m: f64,
        spacing_m: f64,
        size: usize,
    ) -> Result<Factor, FieldError> {
        if size > MOST_PLACES {
            return Err(FieldError::LongSide { family, places: size, limit: MOST_PLACES });
        }
        let by_lag: Vec<f64> =
            (0..size).map(|lag| correlation(family, lag as f64 * spacing_m, scale_m)).collect();
        if by_lag.iter().all(|&r| r == 1.0) {
            return Ok(Factor::homogeneous(size));
        }
        let mut nugget = 0.0;
        loop {
            if let Some(entries) = cholesky(&by_lag, nugget) {
                return Ok(Factor { size, first: first_columns(&entries, size), entries, nugget });
            }
            nugget = if nugget == 0.0 { SMALLEST_NUGGET } else { nugget * 10.0 };
            // The factor 1.5 absorbs the rounding of repeated multiplication by ten.
            if nugget > 1.5 * LARGEST_NUGGET {
                return Err(FieldError::Singular { family, scale_m, spacing_m, nugget: LARGEST_NUGGET });
            }
        }
    }

    /// The nugget that was needed, as a share of the variance; zero for most families and scales.
    pub fn nugget(&self) -> f64 {
        self.nugget
    }

    /// Number of places.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Entry in row `i`, column `j`.
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.size + j]
    }

    /// Replaces the rows of `matrix` (row-major, `size` rows of `columns` values) by L times them, in place; of row i the
    /// first `widths[i]` values only, which must not grow from row to row.
    ///
    /// From the last row up, since row i of the product needs the rows up to i only. Each value is summed in the
    /// same order, from the diagonal to the left, whatever instructions the processor has.
    pub(super) fn multiply_rows(&self, matrix: &mut [f64], columns: usize, widths: &[usize]) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the feature.
            return unsafe { self.multiply_rows_avx2(matrix, columns, widths) };
        }
        self.multiply_rows_in_lanes(matrix, columns, widths);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn multiply_rows_avx2(&self, matrix: &mut [f64], columns: usize, widths: &[usize]) {
        self.multiply_rows_in_lanes(matrix, columns, widths);
    }

    /// As [`Factor::multiply_rows`], compiled for the caller's instructions. Nothing is fused, and the compiler reorders
    /// no sum: all give the same bits.
    #[inline(always)]
    fn multiply_rows_in_lanes(&self, matrix: &mut [f64], columns: usize, widths: &[usize]) {
        for i in (0..self.size).rev() {
            let (above, rest) = matrix.split_at_mut(i * columns);
            let weights = &self.entries[i * self.size..][..=i];
            let mut chunks = rest[..widths[i]].chunks_exact_mut(LANES);
            let mut start = 0;
            for chunk in &mut chunks {
                let mut sums: [f64; LANES] = std::array::from_fn(|lane| weights[i] * chunk[lane]);
                for k in (self.first[i]..i).rev() {
                    let source = &above[k * columns + start..][..LANES];
                    sums.iter_mut().zip(source).for_each(|(sum, s)| *sum += weights[k] * s);
                }
                chunk.copy_from_slice(&sums);
                start += LANES;
            }
            for (column, value) in chunks.into_remainder().iter_mut().enumerate() {
                let term = |sum: f64, k: usize| sum + weights[k] * above[k * columns + start + column];
                *value = (self.first[i]..i).rev().fold(weights[i] * *value, term);
            }
        }
    }

    /// An infinite scale: every place has the first one's value.
    fn homogeneous(size: usize) -> Factor {
        let mut entries = vec![0.0; size * size];
        entries.iter_mut().step_by(size.max(1)).for_each(|v| *v = 1.0);
        Factor { size, entries, first: vec![0; size], nugget: 0.0 }
    }
}

/// Row-major factor of the Toeplitz matrix, or `None` if a pivot is not positive.
fn cholesky(by_lag: &[f64], nugget: f64) -> Option<Vec<f64>> {
    let n = by_lag.len();
    let mut l = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let wanted = if i == j { 1.0 } else { by_lag[i - j] / (1.0 + nugget) };
            let (before, row_i) = l.split_at(i * n);
            let row_j = if i == j { row_i } else { &before[j * n..] };
            let rest = (0..j).fold(wanted, |rest, k| rest - row_i[k] * row_j[k]);
            l[i * n + j] = if i != j {
                rest / l[j * n + j]
            } else if rest > 0.0 {
                rest.sqrt()
            } else {
                return None;
            };
        }
    }
    Some(l)
}

fn first_columns(entries: &[f64], size: usize) -> Vec<usize> {
    (0..size).map(|i| entries[i * size..][..=i].iter().position(|v| *v != 0.0).unwrap_or(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_build_of_the_product_gives_the_same_bits() {
        let factor = Factor::new(Autocorrelation::SquaredExponential, 2.0, 0.2, 30).unwrap();
        let columns = 37;
        let matrix: Vec<f64> = (0..30 * columns).map(|i| libm::sin(i as f64)).collect();
        let widths: Vec<usize> = (0..30).map(|i| columns - i).collect();
        let (mut chosen, mut plain) = (matrix.clone(), matrix);
        factor.multiply_rows(&mut chosen, columns, &widths);
        factor.multiply_rows_in_lanes(&mut plain, columns, &widths);
        assert_eq!(chosen, plain);
    }
}
