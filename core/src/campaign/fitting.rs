//! How marginals and copula are chosen.

use crate::copula;
use crate::marginal;
use serde::{Deserialize, Serialize};

/// Fitting recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recipe {
    /// As the paper's printed numbers: moments, inversion of Kendall's tau, ordinal ranks.
    Paper,
    /// Maximum likelihood throughout, average ranks.
    Likelihood,
}

/// Criterion that picks among families.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// Akaike's.
    Aic,
    /// Bayesian.
    Bic,
}

/// How marginals and copula are chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// Recipe.
    pub recipe: Recipe,
    /// Criterion.
    pub criterion: Criterion,
    /// One entry per random property, in property order.
    pub marginals: Vec<MarginalChoice>,
    /// The copula.
    pub copula: CopulaChoice,
}

/// How one marginal is chosen.
#[derive(Debug, Clone, PartialEq)]
pub enum MarginalChoice {
    /// Best family by the criterion.
    Auto,
    /// This family, fitted.
    Family(marginal::Family),
    /// Given: this distribution.
    Given(marginal::Marginal),
    /// This family with p and q from mean and standard deviation by Table 1's moments.
    Moments {
        /// Family.
        family: marginal::Family,
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sd: f64,
    },
}

/// How the copula is chosen.
#[derive(Debug, Clone, PartialEq)]
pub enum CopulaChoice {
    /// Best family by the criterion.
    Auto,
    /// This family, fitted, but for the parameters that are given.
    Family {
        /// Family.
        family: copula::Family,
        /// Given theta (two-property families).
        theta: Option<f64>,
        /// Given correlation matrix (Gaussian, Student t).
        correlation: Option<Vec<Vec<f64>>>,
        /// Given degrees of freedom (Student t).
        degrees_of_freedom: Option<f64>,
    },
}
