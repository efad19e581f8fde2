//! Dense Cholesky factorisation of the whole lattice's correlation matrix: the paper's method (its step 1), kept as
//! the reference that the sweeps and the Kronecker product are tested against.
//!
//! A campaign never uses it: 10,000 cells would need 800 MB and a third of 10^12 operations, and its bits would depend
//! on the host's vector instructions.

use super::FieldError;
use super::autocorrelation::correlation;
use crate::campaign::Field;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The factor of a small lattice.
#[derive(Debug, Clone)]
pub struct Dense {
    factor: DMatrix<f64>,
}

impl Dense {
    /// Factorises the correlation matrix of a lattice of `columns` x `rows` cells of side `spacing_m`, numbered row by
    /// row with x fastest. Rotation plays no part: the lattice lies along the bedding.
    ///
    /// # Errors
    /// [`FieldError::Singular`] if the matrix is not positive definite in f64; no nugget is added here.
    pub fn new(field: &Field, spacing_m: f64, columns: usize, rows: usize) -> Result<Dense, FieldError> {
        let along = |count: usize, scale_m: f64| -> Vec<f64> {
            let lag = |lag: usize| correlation(field.autocorrelation, lag as f64 * spacing_m, scale_m);
            (0..count).map(lag).collect()
        };
        let by_x = along(columns, field.scale_horizontal_m);
        let by_y = along(rows, field.scale_vertical_m);
        let matrix = DMatrix::from_fn(columns * rows, columns * rows, |a, b| {
            by_x[(a % columns).abs_diff(b % columns)] * by_y[(a / columns).abs_diff(b / columns)]
        });
        let factor = Cholesky::<f64, Dyn>::new(matrix).ok_or(FieldError::Singular {
            family: field.autocorrelation,
            scale_m: field.scale_horizontal_m.max(field.scale_vertical_m),
            spacing_m,
            nugget: 0.0,
        })?;
        Ok(Dense { factor: factor.unpack() })
    }

    /// The field that white noise in lattice order gives.
    pub fn correlate(&self, noise: &[f64]) -> Vec<f64> {
        (&self.factor * DVector::from_column_slice(noise)).as_slice().to_vec()
    }
}
