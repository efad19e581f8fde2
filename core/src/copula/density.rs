//! Log-densities at many places: what does not depend on the place is worked out once.

use super::{Copula, CopulaError, frank, gaussian, no16, plackett, student_t};
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

/// Scores of pseudo-observations under an elliptical copula's marginals, for likelihoods of many matrices.
#[derive(Debug, Clone)]
pub(crate) struct Scores {
    /// Degrees of freedom; absent for normal scores.
    degrees_of_freedom: Option<f64>,
    /// One vector a property.
    columns: Vec<Vec<f64>>,
}

impl Scores {
    /// Normal scores that are worked out already.
    pub(crate) fn normal(columns: &[Vec<f64>]) -> Scores {
        Scores { degrees_of_freedom: None, columns: columns.to_vec() }
    }

    /// Student t scores of pseudo-observations. Each distinct one is inverted once: ranks repeat in every column.
    pub(crate) fn student_t(degrees_of_freedom: f64, uniforms: &[Vec<f64>]) -> Scores {
        let margin = StudentT::new(degrees_of_freedom);
        let mut known = BTreeMap::new();
        let mut score = |u: f64| *known.entry(u.to_bits()).or_insert_with(|| margin.quantile(u));
        let columns = uniforms.iter().map(|column| column.iter().map(|&u| score(u)).collect()).collect();
        Scores { degrees_of_freedom: Some(degrees_of_freedom), columns }
    }

    /// Log-likelihood of a correlation matrix; `None` if it is not positive definite.
    pub(crate) fn log_likelihood(&self, correlation: &[Vec<f64>]) -> Option<f64> {
        match self.degrees_of_freedom {
            None => {
                let density = gaussian::LogDensity::new(correlation)?;
                Some(self.sum(|z| density.at_scores(z)))
            }
            Some(nu) => {
                let density = student_t::LogDensity::new(correlation, nu)?;
                Some(self.sum(|x| density.at_scores(x)))
            }
        }
    }

    fn sum(&self, log_density: impl Fn(&[f64]) -> f64) -> f64 {
        let mut row = [0.0; super::MOST_PROPERTIES];
        let row = &mut row[..self.columns.len()];
        let mut total = 0.0;
        for test in 0..self.columns[0].len() {
            row.iter_mut().zip(&self.columns).for_each(|(cell, column)| *cell = column[test]);
            total += log_density(row);
        }
        total
    }
}
