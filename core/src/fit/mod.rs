//! Fits marginals and a copula to the site data, by either recipe.
//!
//! * `paper` is how the printed numbers of Ma et al. (2024) came about: the method of moments with n - 1,
//!   likelihoods of the truncated densities, ordinal ranks (ties broken by row order), copula parameters by
//!   inversion of Kendall's tau_b, and for three properties Pearson's correlation of the normal scores. The text
//!   says maximum likelihood (Eq. 13).
//! * `likelihood` is maximum likelihood throughout, of the marginals and, on average ranks, of the copulas (Genest,
//!   Ghoudi and Rivest 1995). Ties thus do not depend on the order of the rows.
//!
//! [`fit`] is quick; [`goodness_of_fit`] and [`uncertainty`] resample and take longer.

mod copulas;
mod goodness;
mod marginals;
mod ranks;
mod uncertainty;

pub use goodness::{GOODNESS_REPLICATES, GoodnessOfFit, goodness_of_fit};
pub use marginals::marginal_candidates;
pub use ranks::spearman;
pub use uncertainty::{Interval, PropertyUncertainty, UNCERTAINTY_REPLICATES, Uncertainty, uncertainty};

use crate::campaign::{Criterion, FitSettings, MarginalChoice, Recipe};
use crate::copula::{self, Copula};
use crate::marginal::{self, Marginal};
use crate::site::{Property, SiteData};
use crate::spec::RandomProperty;
use serde::Serialize;
use std::collections::BTreeMap;
use thiserror::Error;

/// A marginal family as fitted to one property.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarginalCandidate {
    /// Family.
    pub family: marginal::Family,
    /// First parameter; absent if the family cannot hold the data (see `note`).
    pub p: Option<f64>,
    /// Second parameter.
    pub q: Option<f64>,
    /// The fitted family's own mean, edge unit.
    pub mean: Option<f64>,
    /// The fitted family's own standard deviation, edge unit.
    pub sd: Option<f64>,
    /// Log-likelihood.
    pub log_likelihood: Option<f64>,
    /// Akaike's criterion.
    pub aic: Option<f64>,
    /// Bayesian criterion.
    pub bic: Option<f64>,
    /// Why the family does not apply.
    pub note: Option<String>,
}

/// The fits of one property.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarginalFit {
    /// The chosen distribution.
    pub best: Marginal,
    /// `"criterion"`, `"forced"` or `"given"`: who chose it.
    pub chosen_by: &'static str,
    /// All families; empty if the distribution is given and nothing was measured.
    pub candidates: Vec<MarginalCandidate>,
    /// Sample mean, edge unit; absent if nothing was measured.
    pub sample_mean: Option<f64>,
    /// Sample standard deviation (n - 1), edge unit.
    pub sample_sd: Option<f64>,
}

/// A copula family as fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CopulaCandidate {
    /// Family.
    pub family: copula::Family,
    /// Parameter of a two-property family.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theta: Option<f64>,
    /// Correlation matrix of an elliptical family (its off-diagonal is also `theta` for two properties).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation: Option<Vec<Vec<f64>>>,
    /// Degrees of freedom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Log-likelihood of the pseudo-observations.
    pub log_likelihood: Option<f64>,
    /// Akaike's criterion.
    pub aic: Option<f64>,
    /// Bayesian criterion.
    pub bic: Option<f64>,
    /// Lower tail dependence.
    pub tail_lower: Option<f64>,
    /// Upper tail dependence.
    pub tail_upper: Option<f64>,
    /// Goodness of fit: Cramer-von Mises S_n (likelihood recipe).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cramer_von_mises: Option<f64>,
    /// Its p-value by parametric bootstrap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// What to know about the fit; where there are no numbers, why the family does not apply.
    pub note: Option<String>,
}

/// The fits of the dependence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CopulaFit {
    /// The chosen copula.
    pub best: Copula,
    /// `"criterion"`, `"forced"`, `"given"` or `"only-one"`.
    pub chosen_by: &'static str,
    /// All families of that dimension.
    pub candidates: Vec<CopulaCandidate>,
}

/// Rank and linear correlation matrices of the data, rows in property order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dependence {
    /// Kendall's tau_b.
    pub kendall_tau: Vec<Vec<f64>>,
    /// Pearson's r.
    pub pearson: Vec<Vec<f64>>,
    /// Spearman's rho.
    pub spearman: Vec<Vec<f64>>,
}

/// The whole fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Recipe used.
    pub recipe: Recipe,
    /// Criterion used.
    pub criterion: Criterion,
    /// Number of tests; absent if nothing was measured.
    pub tests: Option<usize>,
    /// By property name.
    pub marginals: BTreeMap<&'static str, MarginalFit>,
    /// Correlations of the measured properties.
    pub dependence: Option<Dependence>,
    /// The copula.
    pub copula: CopulaFit,
}

/// A fit that cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FitError {
    /// No family, or not the forced one, can hold a property's data.
    #[error("{property}: {why}")]
    Marginal {
        /// Property name.
        property: &'static str,
        /// Why, and what can be done.
        why: String,
    },
    /// No copula, or not the forced one, can hold the dependence.
    #[error("copula: {0}")]
    Copula(String),
}

impl MarginalCandidate {
    /// The fitted distribution; `None` if the family does not apply.
    pub fn marginal(&self) -> Option<Marginal> {
        Some(Marginal { family: self.family, p: self.p?, q: self.q? })
    }
}

impl CopulaCandidate {
    /// The fitted copula; `None` if the family does not apply.
    pub fn copula(&self) -> Option<Copula> {
        match self.family {
            copula::Family::Independent => None,
            copula::Family::Gaussian => Some(Copula::Gaussian { correlation: self.correlation.clone()? }),
            copula::Family::StudentT => Some(Copula::StudentT {
                correlation: self.correlation.clone()?,
                degrees_of_freedom: self.degrees_of_freedom?,
            }),
            family => Copula::with_theta(family, self.theta?),
        }
    }
}

impl Fit {
    /// The chosen distributions in property order, as the frozen spec keeps them.
    pub fn random(&self, properties: &[Property]) -> Vec<RandomProperty> {
        properties
            .iter()
            .map(|&property| RandomProperty { property, marginal: self.marginals[property.name()].best })
            .collect()
    }

    /// The random properties in column order.
    pub fn properties(&self) -> Vec<Property> {
        Property::ALL.into_iter().filter(|p| self.marginals.contains_key(p.name())).collect()
    }

    /// Writes the results of [`goodness_of_fit`] beside the families they belong to.
    pub fn add_goodness_of_fit(&mut self, results: &[GoodnessOfFit]) {
        for candidate in &mut self.copula.candidates {
            if let Some(result) = results.iter().find(|r| r.family == candidate.family) {
                candidate.cramer_von_mises = Some(result.cramer_von_mises);
                candidate.p_value = Some(result.p_value);
            }
        }
    }
}

/// Fits `settings.marginals` and `settings.copula` for the `random` properties, to `data` where it is measured.
///
/// # Errors
/// A forced family that cannot hold the data, data no family can hold, or parameters outside their family's range.
pub fn fit(random: &[Property], data: Option<&SiteData>, settings: &FitSettings) -> Result<Fit, FitError> {
    let mut marginals = BTreeMap::new();
    for (place, &property) in random.iter().enumerate() {
        let choice = settings.marginals.get(place).unwrap_or(&MarginalChoice::Auto);
        let sample = data.and_then(|data| column(data, property));
        let fitted = marginals::fit(sample, choice, settings)
            .map_err(|why| FitError::Marginal { property: property.name(), why })?;
        marginals.insert(property.name(), fitted);
    }
    let measured: Vec<&[f64]> = random.iter().filter_map(|&p| column(data?, p)).collect();
    let complete = measured.len() == random.len();
    Ok(Fit {
        recipe: settings.recipe,
        criterion: settings.criterion,
        tests: data.map(SiteData::tests),
        marginals,
        dependence: (measured.len() > 1).then(|| dependence(&measured)),
        copula: copulas::fit(complete.then_some(&measured), random.len(), settings)
            .map_err(FitError::Copula)?,
    })
}

/// The measured values of a property.
fn column(data: &SiteData, property: Property) -> Option<&[f64]> {
    let place = data.properties.iter().position(|&p| p == property)?;
    data.values.get(place).map(Vec::as_slice)
}

fn dependence(columns: &[&[f64]]) -> Dependence {
    let matrix = |of: fn(&[f64], &[f64]) -> f64| {
        let entry = |i: usize, j: usize| if i == j { 1.0 } else { of(columns[i.min(j)], columns[i.max(j)]) };
        (0..columns.len()).map(|i| (0..columns.len()).map(|j| entry(i, j)).collect()).collect()
    };
    Dependence {
        kendall_tau: matrix(ranks::kendall_tau),
        pearson: matrix(ranks::pearson),
        spearman: matrix(ranks::spearman),
    }
}
