//! Any separable family: the factor of the whole lattice is the Kronecker product of two one-dimensional ones.
//!
//! With cells numbered row by row (x fastest) the lattice's correlation matrix is Cy (x) Cx, and the Cholesky factor of
//! a Kronecker product is the Kronecker product of the Cholesky factors, Ly (x) Lx (Van Loan 2000, Journal of
//! Computational and Applied Mathematics 123, 85-100). So the field is Ly W Lx^T with the white noise W in lattice
//! order: what dense Cholesky of the whole matrix gives, draw for draw, at the cost of N (nx + ny) / 2 products.

use super::FieldError;
use super::factor::Factor;
use crate::campaign::Field;

/// The two factors of a lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct Kronecker {
    x: Factor,
    y: Factor,
}

impl Kronecker {
    /// Factors for a lattice of `columns` x `rows` cells of side `spacing_m`.
    ///
    /// # Errors
    /// As [`Factor::new`].
    pub fn new(field: &Field, spacing_m: f64, columns: usize, rows: usize) -> Result<Kronecker, FieldError> {
        Ok(Kronecker {
            x: Factor::new(field.autocorrelation, field.scale_horizontal_m, spacing_m, columns)?,
            y: Factor::new(field.autocorrelation, field.scale_vertical_m, spacing_m, rows)?,
        })
    }

    /// The larger nugget of the two factors.
    pub fn nugget(&self) -> f64 {
        self.x.nugget().max(self.y.nugget())
    }

    /// Turns white noise in lattice order into a field, in place; `scratch` is resized to the lattice.
    pub fn correlate(&self, noise: &mut [f64], scratch: &mut Vec<f64>) {
        let reach = vec![self.x.size(); self.y.size()];
        self.correlate_with(noise, scratch, &reach);
    }

    /// As [`Kronecker::correlate`], for the first `reach[i]` cells of each row i only, which must not grow from row to
    /// row: they depend on no others.
    pub(super) fn correlate_with(&self, cells: &mut [f64], scratch: &mut Vec<f64>, reach: &[usize]) {
        let (columns, rows) = (self.x.size(), self.y.size());
        // Rows that reach into each column: the widths of the transpose's rows.
        let heights: Vec<usize> = (0..columns).map(|j| reach.partition_point(|r| *r > j)).collect();
        scratch.resize(cells.len(), 0.0);
        transpose(cells, scratch, columns, reach);
        self.x.multiply_rows(scratch, rows, &heights);
        transpose(scratch, cells, rows, &heights);
        self.y.multiply_rows(cells, columns, reach);
    }
}

/// Writes the transpose of `from` (rows of `columns` values, of which the first `widths[i]` count in row i) to `to`.
fn transpose(from: &[f64], to: &mut [f64], columns: usize, widths: &[usize]) {
    let rows = from.len() / columns;
    for (i, (row, width)) in from.chunks_exact(columns).zip(widths).enumerate() {
        for (j, &value) in row[..*width].iter().enumerate() {
            to[j * rows + i] = value;
        }
    }
}
