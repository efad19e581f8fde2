//! Gaussian copula (the paper, Eqs. 4 to 6), any number of properties.

use super::matrix::{cholesky, log_determinant, squared_length};
use crate::numeric::integrate;
use crate::special::{normal_cdf, normal_quantile};
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, TAU};

/// Kendall's tau of a bivariate Gaussian or Student t copula: 2 asin(rho) / pi (the paper, Eq. 6).
pub fn tau_of_correlation(correlation: f64) -> f64 {
    FRAC_2_PI * libm::asin(correlation)
}

/// The correlation of a Gaussian or Student t copula with this Kendall's tau, sin(pi tau / 2).
pub fn correlation_of_tau(tau: f64) -> f64 {
    libm::sin(FRAC_PI_2 * tau)
}

/// The log-density with its factorised matrix: -(ln|R| + z^T (R^-1 - I) z) / 2 (the paper, Eq. 5).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LogDensity {
    factor: Vec<Vec<f64>>,
    log_determinant: f64,
}

impl LogDensity {
    pub(super) fn new(correlation: &[Vec<f64>]) -> Option<LogDensity> {
        let factor = cholesky(correlation)?;
        let log_determinant = log_determinant(&factor);
        Some(LogDensity { factor, log_determinant })
    }

    pub(super) fn at(&self, u: &[f64]) -> f64 {
        let mut z = [0.0; super::MOST_PROPERTIES];
        let z = &mut z[..u.len()];
        z.iter_mut().zip(u).for_each(|(z, u)| *z = normal_quantile(*u));
        let own: f64 = z.iter().map(|z| z * z).sum();
        -0.5 * (self.log_determinant + squared_length(&self.factor, z) - own)
    }
}

/// Bivariate distribution function: that of independence plus the integral of the density over the correlation
/// (Plackett 1954), with the correlation written as a sine so that the integrand stays smooth.
pub(super) fn cdf(rho: f64, u: f64, v: f64) -> f64 {
    let (h, k) = (normal_quantile(u), normal_quantile(v));
    let density = |angle: f64| {
        let (sine, cosine) = libm::sincos(angle);
        libm::exp(-0.5 * (h * h + k * k - 2.0 * h * k * sine) / (cosine * cosine))
    };
    (u * v + integrate(0.0, libm::asin(rho), density) / TAU).clamp(0.0, u.min(v))
}

pub(super) fn conditional(rho: f64, u: f64, v: f64) -> f64 {
    normal_cdf((normal_quantile(v) - rho * normal_quantile(u)) / libm::sqrt((1.0 - rho) * (1.0 + rho)))
}

pub(super) fn conditional_quantile(rho: f64, u: f64, w: f64) -> f64 {
    normal_cdf(rho * normal_quantile(u) + libm::sqrt((1.0 - rho) * (1.0 + rho)) * normal_quantile(w))
}
