//! Log-densities at many places: what does not depend on the place is worked out once.

use super::{Copula, CopulaError, frank, gaussian, matrix, no16, plackett, student_t};
use crate::special::StudentT;
use std::collections::BTreeMap;

/// Log-density of one copula at many places.
#[derive(Debug, Clone)]
pub struct LogDensity(Prepared);

#[derive(Debug, Clone)]
enum Prepared {
    Independent,
    Pair(fn(f64, f64, f64) -> f64, f64),
    Gaussian(gaussian::LogDensity),
    StudentT(student_t::LogDensity),
}

impl LogDensity {
    /// Prepares the density.
    ///
    /// # Errors
    /// Parameters outside the family's range.
    pub fn new(copula: &Copula) -> Result<LogDensity, CopulaError> {
        copula.check()?;
        Ok(LogDensity(match copula {
            Copula::Independent { .. } => Prepared::Independent,
            Copula::Plackett { theta } => Prepared::Pair(plackett::log_density, *theta),
            Copula::Frank { theta } => Prepared::Pair(frank::log_density, *theta),
            Copula::No16 { theta } => Prepared::Pair(no16::log_density, *theta),
            Copula::Gaussian { correlation } => {
                Prepared::Gaussian(gaussian::LogDensity::new(correlation).ok_or(CopulaError::Correlation)?)
            }
            Copula::StudentT { correlation, degrees_of_freedom } => Prepared::StudentT(
                student_t::LogDensity::new(correlation, *degrees_of_freedom)
                    .ok_or(CopulaError::Correlation)?,
            ),
        }))
    }

    /// Logarithm of the density at `u`, one coordinate in (0, 1) per property.
    pub fn at(&self, u: &[f64]) -> f64 {
        match &self.0 {
            Prepared::Independent => 0.0,
            Prepared::Pair(log_density, theta) => log_density(*theta, u[0], u[1]),
            Prepared::Gaussian(density) => density.at(u),
            Prepared::StudentT(density) => density.at(u),
        }
    }
}

/// Products are taken the logarithm of beyond this: far from overflow by one more share.
const LARGE_PRODUCT: f64 = 1e100;

/// Scores of pseudo-observations under an elliptical copula's marginals, for likelihoods of many matrices.
///
/// What does not depend on the matrix is summed once.
#[derive(Debug, Clone)]
pub(crate) struct Scores {
    /// Degrees of freedom; absent for normal scores.
    degrees_of_freedom: Option<f64>,
    /// Number of tests.
    tests: f64,
    /// One vector a property. For normal scores not the tests' but, where it exists, a factor of their
    /// second-moment matrix, which has the same likelihood.
    columns: Vec<Vec<f64>>,
    /// Log-density of the marginals but for constants, summed over all scores, with the sign it has in a copula's
    /// density.
    margins: f64,
}

impl Scores {
    /// Normal scores that are worked out already.
    pub(crate) fn normal(columns: &[Vec<f64>]) -> Scores {
        let moment = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let moments: Vec<Vec<f64>> =
            columns.iter().map(|a| columns.iter().map(|b| moment(a, b)).collect()).collect();
        Scores {
            degrees_of_freedom: None,
            tests: columns[0].len() as f64,
            margins: 0.5 * moments.iter().enumerate().map(|(i, row)| row[i]).sum::<f64>(),
            columns: matrix::cholesky(&moments).unwrap_or_else(|| columns.to_vec()),
        }
    }

    /// Student t scores of pseudo-observations. Each distinct one is inverted once: ranks repeat in every column.
    pub(crate) fn student_t(degrees_of_freedom: f64, uniforms: &[Vec<f64>]) -> Scores {
        let margin = StudentT::new(degrees_of_freedom);
        let mut known = BTreeMap::new();
        let mut score = |u: f64| *known.entry(u.to_bits()).or_insert_with(|| margin.quantile(u));
        let columns: Vec<Vec<f64>> =
            uniforms.iter().map(|column| column.iter().map(|&u| score(u)).collect()).collect();
        Scores {
            degrees_of_freedom: Some(degrees_of_freedom),
            tests: uniforms[0].len() as f64,
            margins: columns.iter().map(|column| student_t::margins(degrees_of_freedom, column)).sum(),
            columns,
        }
    }

    /// Log-likelihood of a correlation matrix; `None` if it is not positive definite.
    pub(crate) fn log_likelihood(&self, correlation: &[Vec<f64>]) -> Option<f64> {
        let joint = match self.degrees_of_freedom {
            None => {
                let factor = matrix::cholesky(correlation)?;
                let lengths = self.sum(|z| matrix::squared_length(&factor, z));
                -0.5 * (self.tests * matrix::log_determinant(&factor) + lengths)
            }
            Some(nu) => {
                let density = student_t::LogDensity::new(correlation, nu)?;
                // One logarithm for the product of several shares, which are at least one each.
                let (mut product, mut logarithms) = (1.0_f64, 0.0);
                self.each(|x| {
                    product *= density.share(x);
                    if product > LARGE_PRODUCT {
                        logarithms += libm::log(product);
                        product = 1.0;
                    }
                });
                density.joint(self.tests, self.columns.len(), logarithms + libm::log(product))
            }
        };
        Some(joint + self.margins)
    }

    fn sum(&self, of_row: impl Fn(&[f64]) -> f64) -> f64 {
        let mut total = 0.0;
        self.each(|row| total += of_row(row));
        total
    }

    fn each(&self, mut with_row: impl FnMut(&[f64])) {
        let mut row = [0.0; super::MOST_PROPERTIES];
        let row = &mut row[..self.columns.len()];
        for place in 0..self.columns[0].len() {
            row.iter_mut().zip(&self.columns).for_each(|(cell, column)| *cell = column[place]);
            with_row(row);
        }
    }
}
