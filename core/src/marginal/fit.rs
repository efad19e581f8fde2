//! Fits one family to one sample: soil properties, and runout distances in the report.

use super::{Family, Marginal, MarginalError, lognormal, trunc_gumbel, trunc_normal, weibull};
use thiserror::Error;

/// A sample that a family cannot be fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum SampleError {
    /// Fewer than two values.
    #[error("{0} values; at least 2 are needed")]
    TooFew(usize),
    /// A value that is negative or not a number.
    #[error("the value {0} is not in [0, inf)")]
    BadValue(f64),
    /// All values are the same.
    #[error("all values are {0}; a spread is needed")]
    Constant(f64),
    /// A value of exactly zero in a family whose likelihood there is zero or infinite.
    #[error("{} cannot hold a value of exactly zero; set `zeros` to \"drop\" or {{ floor = value }}", .0.name())]
    Zero(Family),
    /// The likelihood keeps rising towards the edge of the parameters' range.
    #[error("{} has no likelihood maximum for this sample: it is as dispersed as an exponential one", .0.name())]
    NoMaximum(Family),
    /// The parameters leave the range that can be used.
    #[error(transparent)]
    Parameters(#[from] MarginalError),
}

/// The method of moments: sample mean and standard deviation (n - 1) put into Table 1's formulas before truncation.
///
/// # Errors
/// A sample without spread, with bad values, or with a zero that the family cannot hold.
pub fn by_moments(family: Family, sample: &[f64]) -> Result<Marginal, SampleError> {
    check(family, sample)?;
    let (mean, sd) = sample_moments(sample);
    Ok(Marginal::from_moments(family, mean, sd)?)
}

/// Maximum likelihood of the (truncated) density.
///
/// # Errors
/// As [`by_moments`], and a sample for which the likelihood has no maximum.
pub fn by_likelihood(family: Family, sample: &[f64]) -> Result<Marginal, SampleError> {
    check(family, sample)?;
    let found = match family {
        Family::TruncNormal => trunc_normal::by_likelihood(sample),
        Family::Lognormal => Some(lognormal::by_likelihood(sample)),
        Family::TruncGumbel => trunc_gumbel::by_likelihood(sample),
        Family::Weibull => weibull::by_likelihood(sample),
    };
    let (p, q) = found.ok_or(SampleError::NoMaximum(family))?;
    Ok(Marginal::new(family, p, q)?)
}

/// Mean and standard deviation (n - 1) of a sample.
pub fn sample_moments(sample: &[f64]) -> (f64, f64) {
    let n = sample.len() as f64;
    let mean = sample.iter().sum::<f64>() / n;
    let squares: f64 = sample.iter().map(|x| (x - mean) * (x - mean)).sum();
    (mean, libm::sqrt(squares / (n - 1.0)))
}

/// Akaike's criterion.
pub fn aic(log_likelihood: f64, parameters: usize) -> f64 {
    2.0 * parameters as f64 - 2.0 * log_likelihood
}

/// Bayesian criterion for `n` observations.
pub fn bic(log_likelihood: f64, parameters: usize, n: usize) -> f64 {
    parameters as f64 * libm::log(n as f64) - 2.0 * log_likelihood
}

fn check(family: Family, sample: &[f64]) -> Result<(), SampleError> {
    if sample.len() < 2 {
        return Err(SampleError::TooFew(sample.len()));
    }
    if let Some(&bad) = sample.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
        return Err(SampleError::BadValue(bad));
    }
    if sample.iter().all(|x| *x == sample[0]) {
        return Err(SampleError::Constant(sample[0]));
    }
    if !family.holds_zero() && sample.contains(&0.0) {
        return Err(SampleError::Zero(family));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_samples_are_named() {
        assert_eq!(by_moments(Family::Weibull, &[1.0]), Err(SampleError::TooFew(1)));
        assert_eq!(by_moments(Family::Weibull, &[1.0, -2.0]), Err(SampleError::BadValue(-2.0)));
        assert_eq!(by_likelihood(Family::Lognormal, &[3.0, 3.0]), Err(SampleError::Constant(3.0)));
        assert_eq!(by_likelihood(Family::Weibull, &[0.0, 3.0]), Err(SampleError::Zero(Family::Weibull)));
        let exponential = [0.1, 0.1, 0.1, 10.0];
        for family in [Family::TruncNormal, Family::TruncGumbel] {
            assert_eq!(by_likelihood(family, &exponential), Err(SampleError::NoMaximum(family)));
        }
    }

    /// The score is zero at a maximum: small steps in either parameter lower the likelihood.
    #[test]
    fn likelihood_is_largest_at_the_fit() {
        let sample = [4.1, 4.2, 17.0, 19.4, 9.1, 9.5, 12.5, 14.6, 10.3, 23.4];
        for family in Family::ALL {
            let best = by_likelihood(family, &sample).unwrap();
            let top = best.log_likelihood(&sample);
            for (dp, dq) in [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)] {
                let near = Marginal { p: best.p * (1.0 + dp), q: best.q * (1.0 + dq), ..best };
                assert!(near.log_likelihood(&sample) < top, "{}", family.name());
            }
        }
    }
}
