//! Weibull distribution with scale p and shape q (Table 1 of the paper): survival exp(-(x / p)^q).

use crate::numeric::root;

/// Range of shapes: the 1 - 2^-53 quantile of a unit scale is 36.7^(1/q), 1e78 at the lower end.
const SHAPES: std::ops::RangeInclusive<f64> = 0.02..=1e4;

/// Scales whose quantiles stay finite at any allowed shape.
const SCALES: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

pub(super) fn allowed(p: f64, q: f64) -> Result<(), &'static str> {
    if SCALES.contains(&p) && SHAPES.contains(&q) {
        Ok(())
    } else {
        Err("p must be in [1e-60, 1e60] and q in [0.02, 1e4]")
    }
}

/// At zero the density is zero (q > 1), 1 / p (q = 1) or infinite (q < 1).
pub(super) fn log_density(p: f64, q: f64, x: f64) -> f64 {
    let ln_ratio = libm::log(x / p);
    let power = if q == 1.0 { 0.0 } else { (q - 1.0) * ln_ratio };
    libm::log(q / p) + power - libm::exp(q * ln_ratio)
}

pub(super) fn survival(p: f64, q: f64, x: f64) -> f64 {
    libm::exp(-libm::pow(x / p, q))
}

#[inline]
pub(super) fn quantile(p: f64, inverse_shape: f64, below: f64, above: f64) -> f64 {
    let hazard = if below < 0.5 { -libm::log1p(-below) } else { -libm::log(above) };
    p * libm::pow(hazard, inverse_shape)
}

/// Mean p Gamma(1 + 1/q), second moment p^2 Gamma(1 + 2/q).
pub(super) fn moments(p: f64, q: f64) -> (f64, f64) {
    let mean = p * libm::tgamma(1.0 + 1.0 / q);
    (mean, mean * libm::sqrt(squared_variation(q)))
}

/// The shape from the coefficient of variation, which falls with it; `None` if it leaves the range of shapes.
pub(super) fn from_moments(mean: f64, sd: f64) -> Option<(f64, f64)> {
    let target = (sd / mean) * (sd / mean);
    // In the logarithm of the shape; the lower end keeps the gamma functions finite.
    let ln_shape = root(libm::log(0.1), libm::log(*SHAPES.end()), |ln_q| {
        libm::log(squared_variation(libm::exp(ln_q)) / target)
    })?;
    let q = libm::exp(ln_shape);
    Some((mean / libm::tgamma(1.0 + 1.0 / q), q))
}

/// Square of the coefficient of variation, Gamma(1 + 2/q) / Gamma(1 + 1/q)^2 - 1.
fn squared_variation(q: f64) -> f64 {
    libm::expm1(libm::lgamma(1.0 + 2.0 / q) - 2.0 * libm::lgamma(1.0 + 1.0 / q))
}

/// The shape solves sum(x^q ln x) / sum(x^q) - 1/q = mean(ln x), whose left side rises with q; the scale follows.
/// `None` if the shape leaves its range. All values must be positive.
pub(super) fn by_likelihood(sample: &[f64]) -> Option<(f64, f64)> {
    let n = sample.len() as f64;
    // Values over the largest one keep the powers within [0, 1].
    let largest = sample.iter().copied().fold(0.0, f64::max);
    let logs: Vec<f64> = sample.iter().map(|&x| libm::log(x / largest)).collect();
    let mean_log = logs.iter().sum::<f64>() / n;
    let score = |q: f64| {
        let (top, bottom) = logs.iter().fold((0.0, 0.0), |(top, bottom), &l| {
            let power = libm::exp(q * l);
            (top + power * l, bottom + power)
        });
        top / bottom - 1.0 / q - mean_log
    };
    let q = root(*SHAPES.start(), *SHAPES.end(), score)?;
    let mean_power = logs.iter().map(|&l| libm::exp(q * l)).sum::<f64>() / n;
    Some((largest * libm::pow(mean_power, 1.0 / q), q))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shape 1 is exponential; shape 2 (Rayleigh) has mean p sqrt(pi) / 2.
    #[test]
    fn special_shapes_match_their_closed_forms() {
        assert!((survival(2.0, 1.0, 3.0) - libm::exp(-1.5)).abs() < 1e-16);
        assert!((log_density(2.0, 1.0, 0.0) + libm::log(2.0)).abs() < 1e-16);
        let (mean, sd) = moments(1.0, 2.0);
        assert!((mean - 0.5 * libm::sqrt(std::f64::consts::PI)).abs() < 1e-15);
        assert!((sd * sd - (1.0 - 0.25 * std::f64::consts::PI)).abs() < 1e-15);
        assert_eq!(log_density(2.0, 2.0, 0.0), f64::NEG_INFINITY);
    }

    #[test]
    fn moments_come_back() {
        for q in [0.3, 1.0, 2.3, 14.3, 400.0] {
            let (mean, sd) = moments(6.0, q);
            let (p, back) = from_moments(mean, sd).unwrap();
            // At a shape of 400 the variation is a difference of gamma functions of 1e-5 known to 1e-16.
            assert!((back - q).abs() < 1e-9 * q && (p - 6.0).abs() < 1e-10, "{q}: {back}");
        }
        assert_eq!(from_moments(1.0, 1e9), None);
    }
}
