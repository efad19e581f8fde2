//! Single-exponential fields by two first-order autoregressive sweeps: exact, in place, O(N).
//!
//! In one dimension the paper's Eq. 16 makes a Markov chain: z_i = r z_{i-1} + sqrt(1 - r^2) w_i with
//! r = exp(-2 spacing / delta) and z_0 = w_0 has exactly that autocorrelation, and the map from w to z is the Cholesky
//! factor of its matrix. The product of both directions is a Kronecker product (see [`super::kronecker`]), so that
//! sweeping all rows and then all columns gives dense Cholesky of the whole lattice, draw for draw, cells being
//! numbered row by row with x fastest.

use crate::campaign::Field;

/// Coefficients of the two sweeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweeps {
    columns: usize,
    x: Step,
    y: Step,
}

/// One step of a sweep: the share kept and the weight of new noise.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    keep: f64,
    fresh: f64,
}

impl Step {
    fn new(scale_m: f64, spacing_m: f64) -> Step {
        let d = spacing_m / scale_m;
        // expm1 keeps 1 - r^2 exact where the scale is much longer than the spacing.
        Step { keep: libm::exp(-2.0 * d), fresh: (-libm::expm1(-4.0 * d)).sqrt() }
    }
}

impl Sweeps {
    /// Coefficients for a lattice of cells of side `spacing_m`, `columns` to a row.
    pub fn new(field: &Field, spacing_m: f64, columns: usize) -> Sweeps {
        Sweeps {
            columns,
            x: Step::new(field.scale_horizontal_m, spacing_m),
            y: Step::new(field.scale_vertical_m, spacing_m),
        }
    }

    /// Turns white noise in lattice order into a field, in place.
    pub fn correlate(&self, noise: &mut [f64]) {
        for row in noise.chunks_exact_mut(self.columns) {
            let mut last = row[0];
            for value in &mut row[1..] {
                last = self.x.keep * last + self.x.fresh * *value;
                *value = last;
            }
        }
        for start in (self.columns..noise.len()).step_by(self.columns) {
            let (above, row) = noise.split_at_mut(start);
            let previous = &above[start - self.columns..];
            for (value, &last) in row[..self.columns].iter_mut().zip(previous) {
                *value = self.y.keep * last + self.y.fresh * *value;
            }
        }
    }
}
