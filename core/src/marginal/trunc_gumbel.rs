//! Gumbel distribution of maxima truncated below zero (Table 1 of the paper): location p, inverse scale q.
//!
//! Before truncation the distribution function is exp(-exp(-q (x - p))); with b = exp(p q) it is exp(-b) at zero.

use crate::numeric::{integrate, minimise, root};
use crate::special::EULER_GAMMA;
use std::f64::consts::PI;

/// Least p q: there the distribution is exponential to 1 part in 1e13.
const LEAST_PRODUCT: f64 = -30.0;

/// Most p q, beyond which exp(p q) overflows; nothing is cut off from 4 on.
const MOST_PRODUCT: f64 = 700.0;

pub(super) fn allowed(p: f64, q: f64) -> Result<(), &'static str> {
    let fine = p.is_finite() && q.is_finite() && q > 0.0 && (LEAST_PRODUCT..=MOST_PRODUCT).contains(&(p * q));
    if fine { Ok(()) } else { Err("p must be finite, q positive, and p q in [-30, 700]") }
}

pub(super) fn log_density(p: f64, q: f64, x: f64) -> f64 {
    let s = q * (x - p);
    libm::log(q / above_zero(p, q)) - s - libm::exp(-s)
}

pub(super) fn survival(p: f64, q: f64, x: f64) -> f64 {
    -libm::expm1(-libm::exp(-q * (x - p))) / above_zero(p, q)
}

/// Probability above zero before truncation, 1 - exp(-exp(p q)).
fn above_zero(p: f64, q: f64) -> f64 {
    -libm::expm1(-libm::exp(p * q))
}

/// The quantile function with the cut-off probabilities worked out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prepared {
    p: f64,
    scale: f64,
    /// Probability below zero before truncation.
    below: f64,
    /// Probability above zero before truncation.
    above: f64,
}

impl Prepared {
    pub(super) fn new(p: f64, q: f64) -> Prepared {
        Prepared { p, scale: 1.0 / q, below: libm::exp(-libm::exp(p * q)), above: above_zero(p, q) }
    }

    #[inline]
    pub(super) fn quantile(&self, below: f64, above: f64) -> f64 {
        // Minus the logarithm of the untruncated probability, from the nearer end.
        let hazard = if self.below < 0.5 && below < 0.5 {
            -libm::log(self.below + below * self.above)
        } else {
            -libm::log1p(-above * self.above)
        };
        (self.p - self.scale * libm::log(hazard)).max(0.0)
    }
}

/// Mean and standard deviation after truncation, by quadrature of the standardised density.
pub(super) fn moments(p: f64, q: f64) -> (f64, f64) {
    // Below -4 the density is under exp(-50), 45 above the start under exp(-45).
    let start = (-p * q).max(-4.0);
    let end = start.max(0.0) + 45.0;
    // The factor exp(start) keeps the density of order one when only the tail is left.
    let density = |s: f64| libm::exp(start.max(0.0) - s - libm::exp(-s));
    // In two pieces, because the peak is narrow beside the tail.
    let middle = start + 9.0;
    let moment = |f: &dyn Fn(f64) -> f64| {
        let weighted = |s: f64| f(s) * density(s);
        integrate(start, middle, weighted) + integrate(middle, end, weighted)
    };
    let total = moment(&|_| 1.0);
    let mean = moment(&|s| s) / total;
    let variance = moment(&|s| (s - mean) * (s - mean)) / total;
    (p + mean / q, libm::sqrt(variance) / q)
}

/// Mean p + gamma / q, variance pi^2 / (6 q^2), both before truncation.
pub(super) fn from_moments(mean: f64, sd: f64) -> (f64, f64) {
    let q = PI / (sd * libm::sqrt(6.0));
    (mean - EULER_GAMMA / q, q)
}

/// Maximum likelihood by the profile over q.
///
/// With b = exp(p q) the mean log-likelihood is ln q + ln b - q mean(x) - b mean(e^(-q x)) - ln(1 - e^-b). For
/// given q the best b solves 1/b - 1/(e^b - 1) = mean(e^(-q x)), which has a root if the right side is below 1/2;
/// the profile's derivative is then 1/q - mean(x) + b mean(x e^(-q x)). `None` if the maximum is the exponential
/// limit, b = 0.
pub(super) fn by_likelihood(sample: &[f64]) -> Option<(f64, f64)> {
    let n = sample.len() as f64;
    let mean = sample.iter().sum::<f64>() / n;
    let tilted = |q: f64| sample.iter().map(|&x| libm::exp(-q * x)).sum::<f64>() / n;
    let loss = |ln_q: f64| {
        let q = libm::exp(ln_q);
        let tilt = tilted(q);
        match best_b(tilt) {
            Some(b) => q * mean + b * tilt + libm::log(-libm::expm1(-b)) - ln_q - libm::log(b),
            // The exponential limit.
            None => q * mean - ln_q,
        }
    };
    let slope = |ln_q: f64| {
        let q = libm::exp(ln_q);
        let b = best_b(tilted(q)).unwrap_or(0.0);
        1.0 / q - mean + b * sample.iter().map(|&x| x * libm::exp(-q * x)).sum::<f64>() / n
    };
    // Inverse scales from a hundredth of the mean's inverse to where e^(p q) overflows.
    let (least, most) = (libm::log(0.01 / mean), libm::log(MOST_PRODUCT / mean));
    let rough = minimise(least, most, 200, loss);
    if rough.at_end {
        return None;
    }
    // The minimum's place from values is good to 1e-8; the root of the slope around it to the last bits.
    let ln_q = root(rough.x - 1e-3, rough.x + 1e-3, slope).unwrap_or(rough.x);
    let q = libm::exp(ln_q);
    let p = libm::log(best_b(tilted(q))?) / q;
    (p * q >= LEAST_PRODUCT).then_some((p, q))
}

/// The b that solves 1/b - 1/(e^b - 1) = `tilt`; `None` from 1/2 on.
fn best_b(tilt: f64) -> Option<f64> {
    let excess = |ln_b: f64| {
        let b = libm::exp(ln_b);
        // The difference cancels for small b: 1/2 - b/12.
        let left = if b < 1e-5 { 0.5 - b / 12.0 } else { 1.0 / b - 1.0 / libm::expm1(b) };
        left - tilt
    };
    root(LEAST_PRODUCT, MOST_PRODUCT, excess).map(libm::exp)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where nothing is cut off the moments are those of Gumbel's distribution.
    #[test]
    fn far_from_zero_the_moments_are_gumbels() {
        let (p, q) = from_moments(100.0, 2.0);
        let (mean, sd) = moments(p, q);
        assert!((mean - 100.0).abs() < 1e-12 && (sd - 2.0).abs() < 1e-12, "{mean} {sd}");
    }

    /// Salt Creek's cohesion as the paper fitted it; the truncated distribution's own moments, computed apart
    /// from this program.
    #[test]
    fn truncation_shifts_the_moments() {
        let (mean, sd) = moments(7.135720013484887, 0.1522807447204123);
        assert!((mean - 11.615182507919362).abs() < 1e-12, "{mean}");
        assert!((sd - 8.092073260660605).abs() < 1e-12, "{sd}");
    }

    /// Deep truncation leaves the exponential distribution of rate q.
    #[test]
    fn the_limit_is_exponential() {
        let (mean, sd) = moments(-60.0, 0.5);
        assert!((mean - 2.0).abs() < 1e-11 && (sd - 2.0).abs() < 1e-11, "{mean} {sd}");
        assert!((survival(-60.0, 0.5, 3.0) - libm::exp(-1.5)).abs() < 1e-12);
    }
}
