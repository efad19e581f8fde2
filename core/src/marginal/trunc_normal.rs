//! Normal distribution truncated below zero (Table 1 of the paper): location p, standard deviation q before
//! truncation. Both tails are computed from their own end, so that neither cancels.

use crate::numeric::root;
use crate::special::{inverse_mills, normal_cdf, normal_log_pdf, normal_quantile};

/// Least p / q: there the distribution is exponential to 1 part in 900, and the normal tail is still a number.
const LEAST_RATIO: f64 = -30.0;

pub(super) fn allowed(p: f64, q: f64) -> Result<(), &'static str> {
    if p.is_finite() && q.is_finite() && q > 0.0 && p / q >= LEAST_RATIO {
        Ok(())
    } else {
        Err("p must be finite, q positive, and p / q at least -30")
    }
}

pub(super) fn log_density(p: f64, q: f64, x: f64) -> f64 {
    normal_log_pdf((x - p) / q) - libm::log(q * normal_cdf(p / q))
}

pub(super) fn survival(p: f64, q: f64, x: f64) -> f64 {
    normal_cdf((p - x) / q) / normal_cdf(p / q)
}

/// The quantile function with the cut-off probabilities worked out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prepared {
    p: f64,
    q: f64,
    /// Probability below zero before truncation.
    below: f64,
    /// Probability above zero before truncation.
    above: f64,
}

impl Prepared {
    pub(super) fn new(p: f64, q: f64) -> Prepared {
        Prepared { p, q, below: normal_cdf(-p / q), above: normal_cdf(p / q) }
    }

    #[inline]
    pub(super) fn quantile(&self, below: f64, above: f64) -> f64 {
        let score = if self.p > 0.0 && below < 0.5 {
            normal_quantile(self.below + below * self.above)
        } else {
            -normal_quantile(above * self.above)
        };
        // Rounding may end just below zero.
        (self.p + self.q * score).max(0.0)
    }
}

/// Mean q (a + l) and variance q^2 (1 - l (a + l)) with a = p / q and l = phi(a) / Phi(a) (Johnson, Kotz and
/// Balakrishnan 1994, section 13.10.1).
pub(super) fn moments(p: f64, q: f64) -> (f64, f64) {
    let (mean, variance) = unit_moments(p / q);
    (q * mean, q * libm::sqrt(variance))
}

fn unit_moments(a: f64) -> (f64, f64) {
    let l = inverse_mills(a);
    (a + l, 1.0 - l * (a + l))
}

/// Maximum likelihood: the family is exponential in (x, x^2), so that mean and variance (divided by n) of the
/// truncated distribution equal the sample's. Their ratio gives p / q. `None` if the sample is as dispersed as an
/// exponential distribution, the family's limit.
pub(super) fn by_likelihood(sample: &[f64]) -> Option<(f64, f64)> {
    let n = sample.len() as f64;
    let mean = sample.iter().sum::<f64>() / n;
    let variance = sample.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    let target = variance / (mean * mean);
    // Beyond 40 nothing is cut off, and p and q are mean and standard deviation.
    const NOTHING_CUT: f64 = 40.0;
    if target < 1.0 / (NOTHING_CUT * NOTHING_CUT) {
        return Some((mean, libm::sqrt(variance)));
    }
    let ratio = root(LEAST_RATIO, NOTHING_CUT, |a| {
        let (m, v) = unit_moments(a);
        v / (m * m) - target
    })?;
    let q = mean / unit_moments(ratio).0;
    Some((ratio * q, q))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Location zero is the half-normal distribution: mean q sqrt(2 / pi), variance q^2 (1 - 2 / pi).
    #[test]
    fn half_normal_matches_its_closed_form() {
        let two_over_pi = std::f64::consts::FRAC_2_PI;
        let (mean, sd) = moments(0.0, 3.0);
        assert!((mean - 3.0 * libm::sqrt(two_over_pi)).abs() < 1e-15);
        assert!((sd - 3.0 * libm::sqrt(1.0 - two_over_pi)).abs() < 1e-15);
        assert!((survival(0.0, 1.0, 1.0) - 2.0 * normal_cdf(-1.0)).abs() < 1e-16);
    }

    /// The paper's cohesion: p and q are the sample's moments, the distribution's own are these (from the closed form
    /// with another language's erfc).
    #[test]
    fn truncation_shifts_the_moments() {
        let (mean, sd) = moments(11.412, 6.191480706045471);
        assert!((mean - 11.879096198911663).abs() < 1e-12, "{mean}");
        assert!((sd - 5.725884442801454).abs() < 1e-12, "{sd}");
    }

    #[test]
    fn a_sample_as_dispersed_as_an_exponential_one_has_no_maximum() {
        assert_eq!(by_likelihood(&[0.1, 0.1, 0.1, 10.0]), None);
    }
}
