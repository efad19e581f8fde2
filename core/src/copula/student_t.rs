//! Student t copula (the paper, Eqs. 7 and 8), any number of properties.

use super::matrix::{cholesky, log_determinant, squared_length};
use crate::numeric::integrate;
use crate::special::StudentT;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Beyond this the copula is Gaussian to 1 part in 1e5, and its gamma functions start to cancel.
pub(super) const MOST_DEGREES_OF_FREEDOM: f64 = 1e5;

/// The log-density with its factorised matrix and its constants (the paper, Eq. 8).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LogDensity {
    factor: Vec<Vec<f64>>,
    degrees_of_freedom: f64,
    margin: StudentT,
    constant: f64,
}

impl LogDensity {
    pub(super) fn new(correlation: &[Vec<f64>], degrees_of_freedom: f64) -> Option<LogDensity> {
        let factor = cholesky(correlation)?;
        let (n, nu) = (correlation.len() as f64, degrees_of_freedom);
        let constant = libm::lgamma(0.5 * (nu + n)) + (n - 1.0) * libm::lgamma(0.5 * nu)
            - n * libm::lgamma(0.5 * (nu + 1.0))
            - 0.5 * log_determinant(&factor);
        Some(LogDensity { factor, degrees_of_freedom, margin: StudentT::new(nu), constant })
    }

    pub(super) fn at(&self, u: &[f64]) -> f64 {
        let mut x = [0.0; super::MOST_PROPERTIES];
        let x = &mut x[..u.len()];
        x.iter_mut().zip(u).for_each(|(x, u)| *x = self.margin.quantile(*u));
        let share = libm::log1p(squared_length(&self.factor, x) / self.degrees_of_freedom);
        self.joint(1.0, x.len(), share) + margins(self.degrees_of_freedom, x)
    }

    /// One plus the Student t scores' squared length over the degrees of freedom.
    pub(super) fn share(&self, x: &[f64]) -> f64 {
        1.0 + squared_length(&self.factor, x) / self.degrees_of_freedom
    }

    /// The joint log-density of some tests with its constants, without the marginals' part, from the sum of the logarithms
    /// of their shares.
    pub(super) fn joint(&self, tests: f64, properties: usize, logarithms: f64) -> f64 {
        self.constant * tests - 0.5 * (self.degrees_of_freedom + properties as f64) * logarithms
    }
}

/// The marginals' part of the log-density at the scores `x`.
pub(super) fn margins(nu: f64, x: &[f64]) -> f64 {
    x.iter().map(|x| 0.5 * (nu + 1.0) * libm::log1p(x * x / nu)).sum()
}

/// Bivariate distribution function by the integral over the correlation from perfect negative dependence (Dunnett and
/// Sobel 1954; Genz 2004), with the correlation written as a sine.
pub(super) fn cdf(rho: f64, nu: f64, u: f64, v: f64) -> f64 {
    let margin = StudentT::new(nu);
    let (h, k) = (margin.quantile(u), margin.quantile(v));
    let density = |angle: f64| {
        let (sine, cosine) = libm::sincos(angle);
        let square = (h * h + k * k - 2.0 * h * k * sine) / (nu * cosine * cosine);
        libm::exp(-0.5 * nu * libm::log1p(square))
    };
    let start = (u + v - 1.0).max(0.0);
    (start + integrate(-FRAC_PI_2, libm::asin(rho), density) / TAU).clamp(start, u.min(v))
}

/// Given x, the other score is Student t with one more degree of freedom (Demarta and McNeil 2005).
fn conditional_scale(rho: f64, nu: f64, x: f64) -> f64 {
    libm::sqrt((nu + x * x) * (1.0 - rho) * (1.0 + rho) / (nu + 1.0))
}

pub(super) fn conditional(rho: f64, nu: f64, u: f64, v: f64) -> f64 {
    let margin = StudentT::new(nu);
    let (x, y) = (margin.quantile(u), margin.quantile(v));
    StudentT::new(nu + 1.0).cdf((y - rho * x) / conditional_scale(rho, nu, x))
}

pub(super) fn conditional_quantile(rho: f64, nu: f64, u: f64, w: f64) -> f64 {
    let margin = StudentT::new(nu);
    let x = margin.quantile(u);
    margin.cdf(rho * x + conditional_scale(rho, nu, x) * StudentT::new(nu + 1.0).quantile(w))
}

/// Both tails: 2 T_{nu+1}(-sqrt((nu + 1)(1 - rho) / (1 + rho))) (Demarta and McNeil 2005).
pub(super) fn tail_dependence(rho: f64, nu: f64) -> f64 {
    2.0 * StudentT::new(nu + 1.0).cdf(-libm::sqrt((nu + 1.0) * (1.0 - rho) / (1.0 + rho)))
}
