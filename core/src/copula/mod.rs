//! Copulas: the dependence between soil properties, one family a file.

use serde::{Deserialize, Serialize};

/// A copula family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// No dependence; the only one for a single property.
    Independent,
    /// Gaussian, two or more properties.
    Gaussian,
    /// Plackett, two properties.
    Plackett,
    /// Frank, two properties.
    Frank,
    /// Nelsen's 4.2.16, two properties.
    No16,
    /// Student t, two or more properties.
    StudentT,
}

impl Family {
    /// All families, in the order of the paper's Table 5.
    pub const ALL: [Family; 6] = [
        Family::Independent,
        Family::Gaussian,
        Family::Plackett,
        Family::Frank,
        Family::No16,
        Family::StudentT,
    ];

    /// The name used in files, tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Family::Independent => "independent",
            Family::Gaussian => "gaussian",
            Family::Plackett => "plackett",
            Family::Frank => "frank",
            Family::No16 => "no16",
            Family::StudentT => "student-t",
        }
    }

    /// The family of that name.
    pub fn from_name(name: &str) -> Option<Family> {
        Family::ALL.into_iter().find(|f| f.name() == name)
    }
}

/// A copula with its parameters. Dimensions follow the order of [`crate::site::Property::ALL`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "family", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Copula {
    /// No dependence.
    Independent {
        /// Number of properties.
        dimension: usize,
    },
    /// Gaussian (paper Eqs. 4-5).
    Gaussian {
        /// Correlation matrix of the normal scores, rows in property order.
        correlation: Vec<Vec<f64>>,
    },
    /// Plackett, theta > 0, theta = 1 being independence.
    Plackett {
        /// Parameter.
        theta: f64,
    },
    /// Frank, theta real, theta = 0 being independence.
    Frank {
        /// Parameter.
        theta: f64,
    },
    /// Nelsen 4.2.16, theta >= 0.
    No16 {
        /// Parameter.
        theta: f64,
    },
    /// Student t (paper Eqs. 7-8).
    StudentT {
        /// Correlation matrix, rows in property order.
        correlation: Vec<Vec<f64>>,
        /// Degrees of freedom, > 2.
        degrees_of_freedom: f64,
    },
}
