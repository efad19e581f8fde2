//! Quantiles of the beta and the Student t distribution with the same bits on every host.
//!
//! The stopping index of a campaign must not depend on the machine that computes it, so that these are built on
//! `libm` and fixed sequences of additions. The regularised incomplete beta function is the continued fraction
//! of Abramowitz & Stegun (1964) 26.5.8, evaluated by Lentz's method (Thompson & Barnett 1986); its inverse is
//! Newton's method kept inside a shrinking bracket.

/// Most terms of the continued fraction. It needs about sqrt(max(a, b)) of them, so that this is enough for
/// counts up to some 10^8.
const MOST_TERMS: usize = 20_000;

/// Relative change at which the continued fraction has converged: twice the spacing of f64 at 1.
const FRACTION_TOLERANCE: f64 = 4.0e-16;

/// Most Newton or bisection steps: bisection alone reaches the smallest positive number in about 1100.
const MOST_STEPS: usize = 1200;

/// Regularised incomplete beta function I_x(a, b): the distribution function of Beta(a, b), a > 0 and b > 0,
/// at x, which is clamped to [0, 1].
pub fn beta_cdf(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let front = libm::exp(a * libm::log(x) + b * libm::log1p(-x) - ln_beta(a, b));
    // The fraction converges fast on the near side of the mean only; the other side is the complement.
    if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(x, a, b) / a
    } else {
        1.0 - front * fraction(1.0 - x, b, a) / b
    }
}

/// Quantile of Beta(a, b): the x at which [`beta_cdf`] is `probability`, clamped to [0, 1].
pub fn beta_quantile(probability: f64, a: f64, b: f64) -> f64 {
    if probability <= 0.0 {
        return 0.0;
    }
    if probability >= 1.0 {
        return 1.0;
    }
    let ln_scale = ln_beta(a, b);
    let (mut low, mut high) = (0.0, 1.0);
    let mut x = a / (a + b);
    for _ in 0..MOST_STEPS {
        let excess = beta_cdf(x, a, b) - probability;
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let ln_density = (a - 1.0) * libm::log(x) + (b - 1.0) * libm::log1p(-x) - ln_scale;
        let newton = x - excess / libm::exp(ln_density);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let change = (next - x).abs();
        x = next;
        if change <= 2.0 * f64::EPSILON * x {
            break;
        }
    }
    x
}

/// The t with P(|T| < t) = `confidence` for Student's t with `degrees_of_freedom` > 0.
///
/// T^2 / (nu + T^2) is Beta(1/2, nu/2) (Abramowitz & Stegun 26.7.1, 26.5.27).
pub fn student_t_two_sided(confidence: f64, degrees_of_freedom: f64) -> f64 {
    let share = beta_quantile(confidence, 0.5, 0.5 * degrees_of_freedom);
    (degrees_of_freedom * share / (1.0 - share)).sqrt()
}

/// Logarithm of the beta function. Where an argument is large, the logarithms of its gamma functions nearly cancel,
/// so that their difference is formed term by term from Stirling's series.
fn ln_beta(a: f64, b: f64) -> f64 {
    // From here on four terms of the series leave less than 2e-15 (Abramowitz & Stegun 6.1.41).
    const LARGE: f64 = 20.0;
    let (a, b) = if a < b { (a, b) } else { (b, a) };
    if b < LARGE {
        return libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    }
    // ln Gamma(b) - ln Gamma(a + b).
    let difference =
        a - a * libm::log(b) - (a + b - 0.5) * libm::log1p(a / b) + stirling(b) - stirling(a + b);
    libm::lgamma(a) + difference
}

/// What Stirling's formula lacks: ln Gamma(x) - (x - 1/2) ln x + x - ln(2 pi) / 2.
fn stirling(x: f64) -> f64 {
    let r = 1.0 / (x * x);
    (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / x
}

/// The continued fraction 1/(1+ d1/(1+ d2/(1+ ...))) of Abramowitz & Stegun 26.5.8.
fn fraction(x: f64, a: f64, b: f64) -> f64 {
    // Lentz's method replaces a vanishing denominator by this, the smallest number of any use.
    const TINY: f64 = 1e-300;
    let safe = |v: f64| if v.abs() < TINY { TINY } else { v };

    let mut c = 1.0;
    let mut d = 1.0 / safe(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    for term in 1..MOST_TERMS {
        let m = term as f64;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / safe(1.0 + even * d);
        c = safe(1.0 + even / c);
        value *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / safe(1.0 + odd * d);
        c = safe(1.0 + odd / c);
        value *= d * c;
        if (d * c - 1.0).abs() < FRACTION_TOLERANCE {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Beta, ContinuousCDF, StudentsT};

    const SHAPES: [(f64, f64); 8] = [
        (0.5, 0.5),
        (0.5, 40.0),
        (1.0, 1000.0),
        (2.0, 3.0),
        (12.5, 7.25),
        (300.0, 700.0),
        (1000.0, 2.0),
        (0.5, 5000.0),
    ];

    #[test]
    fn the_incomplete_beta_function_agrees_with_statrs() {
        for (a, b) in SHAPES {
            let other = Beta::new(a, b).unwrap();
            for i in 1..200 {
                let x = f64::from(i) / 200.0;
                let difference = (beta_cdf(x, a, b) - other.cdf(x)).abs();
                assert!(difference < 1e-10, "I_{x}({a}, {b}) differs by {difference:e}");
            }
        }
    }

    #[test]
    fn the_quantile_inverts_the_distribution_function() {
        for (a, b) in SHAPES {
            for p in [1e-9, 1e-4, 0.005, 0.025, 0.3, 0.5, 0.9, 0.975, 0.9999] {
                let x = beta_quantile(p, a, b);
                // One unit in the last place of x moves the probability by the density times that.
                let density = (beta_cdf(x * (1.0 + 1e-9), a, b) - p).abs() / 1e-9;
                let tolerance = 1e-11 * p + 4.0 * f64::EPSILON * density.max(1.0);
                let error = (beta_cdf(x, a, b) - p).abs();
                assert!(error < tolerance.max(1e-13), "p = {p}, a = {a}, b = {b}: {error:e}");
            }
        }
        assert_eq!(beta_quantile(0.0, 2.0, 3.0), 0.0);
        assert_eq!(beta_quantile(1.0, 2.0, 3.0), 1.0);
    }

    #[test]
    fn the_t_quantile_agrees_with_statrs_and_tables() {
        for df in [1.0, 2.0, 5.0, 30.0, 326.0, 8162.0] {
            let other = StudentsT::new(0.0, 1.0, df).unwrap();
            for confidence in [0.5, 0.8, 0.9, 0.95, 0.99, 0.999] {
                let t = student_t_two_sided(confidence, df);
                let back = 2.0 * other.cdf(t) - 1.0;
                assert!((back - confidence).abs() < 1e-10, "df {df}, {confidence}: {back}");
            }
        }
        // Abramowitz & Stegun 26.7.5: t = z + (z^3 + z) / (4 nu) + O(nu^-2).
        let z = 1.959_963_984_540_054;
        assert!((student_t_two_sided(0.95, 1e6) - z - (z * z * z + z) / 4e6).abs() < 1e-9);
        // Abramowitz & Stegun, Table 26.10.
        assert!((student_t_two_sided(0.95, 10.0) - 2.228).abs() < 5e-4);
        assert!((student_t_two_sided(0.99, 1.0) - 63.657).abs() < 5e-4);
    }
}
