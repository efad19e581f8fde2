//! Single-exponential fields by two first-order autoregressive sweeps: exact, in place, O(N).
//!
//! In one dimension the paper's Eq. 16 makes a Markov chain: z_i = r z_{i-1} + sqrt(1 - r^2) w_i with
//! r = exp(-2 spacing / delta) and z_0 = w_0 has exactly that autocorrelation, and the map from w to z is the Cholesky
//! factor of its matrix. The product of both directions is a Kronecker product (see [`super::kronecker`]), so that
//! sweeping all rows and then all columns gives dense Cholesky of the whole lattice, draw for draw, cells being
//! numbered row by row with x fastest. In this order every cell depends on cells to its left and in earlier rows only,
//! so that each row is finished before the next one is drawn.

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
        let mut last = vec![0.0; self.columns];
        for (number, row) in noise.chunks_exact_mut(self.columns).enumerate() {
            self.row(number, row, &mut last);
            row.copy_from_slice(&last);
        }
    }

    /// Sweeps the noise of row `number`, which is used up, and turns `field`, the row before, into this row. Both may hold
    /// fewer cells than the lattice has columns, but no more than the row before: none depends on those to its right.
    pub(super) fn row(&self, number: usize, noise: &mut [f64], field: &mut [f64]) {
        self.x.along(noise);
        if number == 0 {
            field.copy_from_slice(noise);
        } else {
            self.y.across(noise, field);
        }
    }
}

impl Step {
    /// Sweeps a row from its first value.
    fn along(self, row: &mut [f64]) {
        let Some((mut last, rest)) = row.split_first().map(|(first, _)| *first).zip(row.get_mut(1..)) else {
            return;
        };
        for value in rest {
            last = self.keep * last + self.fresh * *value;
            *value = last;
        }
    }

    /// Sweeps from the row before, `field`, to the next.
    fn across(self, noise: &[f64], field: &mut [f64]) {
        for (value, &fresh) in field.iter_mut().zip(noise) {
            *value = self.keep * *value + self.fresh * fresh;
        }
    }
}
