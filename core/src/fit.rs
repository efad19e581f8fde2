//! Fits marginals and a copula to the site data, by either recipe.

use crate::campaign::{Criterion, FitSettings, Recipe};
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
    /// Why the family does not apply.
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

impl Fit {
    /// The chosen distributions in property order, as the frozen spec keeps them.
    pub fn random(&self, properties: &[Property]) -> Vec<RandomProperty> {
        properties
            .iter()
            .map(|&property| RandomProperty { property, marginal: self.marginals[property.name()].best })
            .collect()
    }
}

/// Fits `settings.marginals` and `settings.copula` for the `random` properties, to `data` where it is measured.
///
/// # Errors
/// A forced family that cannot hold the data, or data no family can hold.
pub fn fit(random: &[Property], data: Option<&SiteData>, settings: &FitSettings) -> Result<Fit, FitError> {
    let _ = (random, data, settings);
    todo!("the statistics branch")
}
