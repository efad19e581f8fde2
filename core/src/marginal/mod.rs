//! Marginal distributions of soil properties: the four families of the paper's Table 1, one a file.
//!
//! The truncated families are the untruncated ones given that the value is above zero: p and q are the parameters
//! before truncation, while [`Marginal::mean`] and [`Marginal::sd`] are those of the truncated distribution. They
//! differ where much is cut off: the paper's cohesion has p = 11.41 and q = 6.19, but mean 11.88 and sd 5.73.

pub mod fit;
mod lognormal;
mod quantile;
mod trunc_gumbel;
mod trunc_normal;
mod weibull;

pub use quantile::Quantile;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A marginal family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Normal truncated below zero.
    TruncNormal,
    /// Lognormal.
    Lognormal,
    /// Gumbel (maximum) truncated below zero.
    TruncGumbel,
    /// Weibull.
    Weibull,
}

impl Family {
    /// All families, in the order of the paper's Table 4.
    pub const ALL: [Family; 4] =
        [Family::TruncNormal, Family::Lognormal, Family::TruncGumbel, Family::Weibull];

    /// The name used in files, tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Family::TruncNormal => "trunc-normal",
            Family::Lognormal => "lognormal",
            Family::TruncGumbel => "trunc-gumbel",
            Family::Weibull => "weibull",
        }
    }

    /// The family of that name.
    pub fn from_name(name: &str) -> Option<Family> {
        Family::ALL.into_iter().find(|f| f.name() == name)
    }

    /// Whether a sample with a value of exactly zero has a positive and finite likelihood.
    pub fn holds_zero(self) -> bool {
        matches!(self, Family::TruncNormal | Family::TruncGumbel)
    }
}

/// A marginal distribution with the parameters p and q of the paper's Table 1, in the property's edge unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marginal {
    /// Family.
    pub family: Family,
    /// First parameter: location (trunc-normal, trunc-gumbel), mean of the logarithm (lognormal), scale (Weibull).
    pub p: f64,
    /// Second parameter: sd before truncation, inverse scale, sd of the logarithm, shape.
    pub q: f64,
}

/// Parameters that are no distribution this program can work with.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum MarginalError {
    /// p or q outside the family's range.
    #[error("{}: p = {p} and q = {q} are not allowed; {allowed}", family.name())]
    Parameters {
        /// Family.
        family: Family,
        /// First parameter.
        p: f64,
        /// Second parameter.
        q: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A mean and a standard deviation that no member of the family has.
    #[error("{}: mean {mean} and standard deviation {sd} are not allowed; {allowed}", family.name())]
    Moments {
        /// Family.
        family: Family,
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sd: f64,
        /// What is allowed.
        allowed: &'static str,
    },
}

impl Marginal {
    /// A distribution whose quantiles are finite and not negative on the whole open interval.
    ///
    /// # Errors
    /// Parameters outside the family's range.
    pub fn new(family: Family, p: f64, q: f64) -> Result<Marginal, MarginalError> {
        let marginal = Marginal { family, p, q };
        marginal.check()?;
        Ok(marginal)
    }

    /// Whether the parameters are in the family's range.
    ///
    /// # Errors
    /// Parameters outside it.
    pub fn check(&self) -> Result<(), MarginalError> {
        let Marginal { family, p, q } = *self;
        let allowed = match family {
            Family::TruncNormal => trunc_normal::allowed(p, q),
            Family::Lognormal => lognormal::allowed(p, q),
            Family::TruncGumbel => trunc_gumbel::allowed(p, q),
            Family::Weibull => weibull::allowed(p, q),
        };
        allowed.map_err(|allowed| MarginalError::Parameters { family, p, q, allowed })
    }

    /// p and q from a mean and a standard deviation by Table 1's formulas.
    ///
    /// As in the paper, the formulas are those before truncation: a truncated family does not keep the mean and the
    /// standard deviation it was made from.
    ///
    /// # Errors
    /// A mean or standard deviation that is not positive, or too large a ratio of the two.
    pub fn from_moments(family: Family, mean: f64, sd: f64) -> Result<Marginal, MarginalError> {
        let refuse = |allowed| MarginalError::Moments { family, mean, sd, allowed };
        if !(mean.is_finite() && mean > 0.0 && sd.is_finite() && sd > 0.0) {
            return Err(refuse("mean and standard deviation must be positive"));
        }
        let (p, q) = match family {
            Family::TruncNormal => (mean, sd),
            Family::Lognormal => lognormal::from_moments(mean, sd),
            Family::TruncGumbel => trunc_gumbel::from_moments(mean, sd),
            Family::Weibull => weibull::from_moments(mean, sd)
                .ok_or_else(|| refuse("the coefficient of variation must be in [1.3e-4, 429]"))?,
        };
        Marginal::new(family, p, q)
    }

    /// Density at `x`; zero below zero.
    pub fn density(&self, x: f64) -> f64 {
        libm::exp(self.log_density(x))
    }

    /// Logarithm of the density at `x`; minus infinity where the density is zero.
    pub fn log_density(&self, x: f64) -> f64 {
        if x < 0.0 {
            return f64::NEG_INFINITY;
        }
        match self.family {
            Family::TruncNormal => trunc_normal::log_density(self.p, self.q, x),
            Family::Lognormal => lognormal::log_density(self.p, self.q, x),
            Family::TruncGumbel => trunc_gumbel::log_density(self.p, self.q, x),
            Family::Weibull => weibull::log_density(self.p, self.q, x),
        }
    }

    /// Probability of a value at or below `x`.
    pub fn cdf(&self, x: f64) -> f64 {
        1.0 - self.survival(x).min(1.0)
    }

    /// Probability of a value above `x`, accurate far into the upper tail.
    pub fn survival(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 1.0;
        }
        match self.family {
            Family::TruncNormal => trunc_normal::survival(self.p, self.q, x),
            Family::Lognormal => lognormal::survival(self.p, self.q, x),
            Family::TruncGumbel => trunc_gumbel::survival(self.p, self.q, x),
            Family::Weibull => weibull::survival(self.p, self.q, x),
        }
    }

    /// The value that is not exceeded with probability `u`; finite and not negative for u in [2^-53, 1 - 2^-53].
    ///
    /// For many values of one distribution prepare a [`Quantile`].
    pub fn quantile(&self, u: f64) -> f64 {
        Quantile::new(self).at(u)
    }

    /// Mean, after truncation.
    pub fn mean(&self) -> f64 {
        self.moments().0
    }

    /// Standard deviation, after truncation.
    pub fn sd(&self) -> f64 {
        self.moments().1
    }

    /// Mean and standard deviation, after truncation.
    pub fn moments(&self) -> (f64, f64) {
        match self.family {
            Family::TruncNormal => trunc_normal::moments(self.p, self.q),
            Family::Lognormal => lognormal::moments(self.p, self.q),
            Family::TruncGumbel => trunc_gumbel::moments(self.p, self.q),
            Family::Weibull => weibull::moments(self.p, self.q),
        }
    }

    /// Log-likelihood of an independent sample; minus infinity if the family cannot hold it.
    pub fn log_likelihood(&self, sample: &[f64]) -> f64 {
        sample.iter().map(|&x| self.log_density(x)).sum()
    }
}
