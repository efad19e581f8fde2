//! Marginal distributions of soil properties: the four families of the paper's Table 1, one a file.

use serde::{Deserialize, Serialize};

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
