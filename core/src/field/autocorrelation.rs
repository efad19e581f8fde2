//! The five one-dimensional autocorrelation functions.
//!
//! All are written in the scale of fluctuation delta of Vanmarcke (1977, 1983): the integral of the function over all
//! lags, negative ones included, equals delta. A field's autocorrelation is the product of one such function along
//! each axis, as in the paper's Eq. 16; what that equation calls autocorrelation distance is the scale of fluctuation.
//!
//! Formulas: Vanmarcke (1983), Random Fields, Section 5.1; tabulated for soils by Cami et al. (2020), ASCE-ASME
//! Journal of Risk and Uncertainty in Engineering Systems A 6(4), 03120002, Table 1.

use crate::campaign::Autocorrelation;
use std::f64::consts::PI;

/// Correlation at distance `lag_m` >= 0 of a field with this scale of fluctuation, m.
///
/// An infinite scale gives 1 at every lag: a homogeneous field.
pub fn correlation(family: Autocorrelation, lag_m: f64, scale_m: f64) -> f64 {
    let d = lag_m / scale_m;
    match family {
        // Markov: the paper's Eq. 16.
        Autocorrelation::SingleExponential => libm::exp(-2.0 * d),
        // Gaussian: infinitely smooth.
        Autocorrelation::SquaredExponential => libm::exp(-PI * d * d),
        // Once differentiable.
        Autocorrelation::SecondOrderMarkov => (1.0 + 4.0 * d) * libm::exp(-4.0 * d),
        // Negative between delta pi/2 and 3 delta pi/2: layers that repeat.
        Autocorrelation::CosineExponential => libm::exp(-d) * libm::cos(d),
        // Moving average of white noise over the length delta.
        Autocorrelation::BinaryNoise => (1.0 - d).max(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) const FAMILIES: [Autocorrelation; 5] = [
        Autocorrelation::SingleExponential,
        Autocorrelation::SquaredExponential,
        Autocorrelation::SecondOrderMarkov,
        Autocorrelation::CosineExponential,
        Autocorrelation::BinaryNoise,
    ];

    /// Trapezoidal rule with step h = delta / 1000 over [0, 40 delta], doubled. Its error is at most
    /// h^2 / 12 times the change of slope (at most 4 / delta), 3.4e-7 delta; the rest beyond 40 delta is below e^-40.
    #[test]
    fn the_integral_over_all_lags_is_the_scale_of_fluctuation() {
        for family in FAMILIES {
            for scale in [0.3, 2.0, 40.0] {
                let h = scale / 1000.0;
                let inner: f64 = (1..40_000).map(|i| correlation(family, f64::from(i) * h, scale)).sum();
                let integral = 2.0 * h * (0.5 + inner);
                assert!((integral / scale - 1.0).abs() < 1e-6, "{family:?} {scale}: {integral}");
            }
        }
    }

    #[test]
    fn the_limits_are_homogeneous_and_white() {
        for family in FAMILIES {
            assert_eq!(correlation(family, 0.0, 2.0), 1.0);
            assert_eq!(correlation(family, 1e3, f64::INFINITY), 1.0);
            assert_eq!(correlation(family, 1.0, 1e-6), 0.0);
        }
    }
}
