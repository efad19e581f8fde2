//! Lognormal distribution: ln x is normal with mean p and standard deviation q (Table 1 of the paper).

use crate::special::{normal_cdf, normal_log_pdf, normal_quantile};

/// Largest exponent whose exponential, squared, is still finite.
const LARGEST_EXPONENT: f64 = 350.0;

/// Number of standard deviations at the ends of the open interval [2^-53, 1 - 2^-53], rounded up.
const END_SCORE: f64 = 8.3;

pub(super) fn allowed(p: f64, q: f64) -> Result<(), &'static str> {
    let finite =
        p.is_finite() && q.is_finite() && q > 0.0 && p.abs() + END_SCORE * q + q * q < LARGEST_EXPONENT;
    if finite { Ok(()) } else { Err("p must be finite, q positive, and |p| + 8.3 q + q^2 below 350") }
}

pub(super) fn log_density(p: f64, q: f64, x: f64) -> f64 {
    if x == 0.0 {
        return f64::NEG_INFINITY;
    }
    let ln_x = libm::log(x);
    normal_log_pdf((ln_x - p) / q) - libm::log(q) - ln_x
}

pub(super) fn survival(p: f64, q: f64, x: f64) -> f64 {
    normal_cdf((p - libm::log(x)) / q)
}

#[inline]
pub(super) fn quantile(p: f64, q: f64, below: f64, above: f64) -> f64 {
    let score = if below < 0.5 { normal_quantile(below) } else { -normal_quantile(above) };
    libm::exp(p + q * score)
}

/// Mean exp(p + q^2 / 2), variance (exp(q^2) - 1) times its square.
pub(super) fn moments(p: f64, q: f64) -> (f64, f64) {
    let mean = libm::exp(p + 0.5 * q * q);
    (mean, mean * libm::sqrt(libm::expm1(q * q)))
}

pub(super) fn from_moments(mean: f64, sd: f64) -> (f64, f64) {
    let cv = sd / mean;
    let variance = libm::log1p(cv * cv);
    (libm::log(mean) - 0.5 * variance, libm::sqrt(variance))
}

/// Closed form: mean and standard deviation (divided by n) of the logarithms.
pub(super) fn by_likelihood(sample: &[f64]) -> (f64, f64) {
    let n = sample.len() as f64;
    let p = sample.iter().map(|&x| libm::log(x)).sum::<f64>() / n;
    let variance = sample.iter().map(|&x| (libm::log(x) - p) * (libm::log(x) - p)).sum::<f64>() / n;
    (p, libm::sqrt(variance))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The median is exp(p); the density there is 1 / (exp(p) q sqrt(2 pi)).
    #[test]
    fn median_and_density_match_their_closed_forms() {
        let (p, q): (f64, f64) = (2.3, 0.5);
        let median = libm::exp(p);
        assert!((quantile(p, q, 0.5, 0.5) - median).abs() < 1e-14);
        assert!((survival(p, q, median) - 0.5).abs() < 1e-15);
        let density = 1.0 / (median * q * libm::sqrt(2.0 * std::f64::consts::PI));
        assert!((libm::exp(log_density(p, q, median)) - density).abs() < 1e-15);
    }

    #[test]
    fn moments_come_back() {
        let (p, q) = from_moments(11.8875, 5.839767155870396);
        let (mean, sd) = moments(p, q);
        assert!((mean - 11.8875).abs() < 1e-13 && (sd - 5.839767155870396).abs() < 1e-13);
    }
}
