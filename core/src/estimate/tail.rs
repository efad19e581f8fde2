//! Distances of small exceedance probability, from the four fitted families, with bootstrap intervals.
//!
//! A 0.1 % distance lies beyond what a thousand samples show, so that the family decides it. All families are given
//! side by side: their spread is the sensitivity to that choice, which no interval of one family contains. The interval
//! of each is the percentile interval of the nonparametric bootstrap (Efron & Tibshirani 1993, Section 13.3): samples are
//! drawn with replacement and the family is fitted anew. It is nonparametric so that it stays honest about the spread of
//! the samples where the family fits badly.
//!
//! Probabilities are conditional on failure. For an unconditional probability p ask for p / `p_failure`.

use super::interval::Interval;
use crate::marginal::fit::{aic, bic, by_likelihood};
use crate::marginal::{Family, Marginal};
use crate::seed::{self, Purpose};
use rand_chacha::rand_core::Rng;
use rayon::prelude::*;
use serde::Serialize;

/// Most bootstrap replicates: beyond these the ends of a 95 % interval move by less than 2 % of its width.
pub const MOST_REPLICATES: u32 = 5_000;

/// What to work out.
#[derive(Debug, Clone, PartialEq)]
pub struct TailSettings {
    /// Exceedance probabilities in (0, 1), conditional on failure.
    pub probabilities: Vec<f64>,
    /// Confidence level of the intervals.
    pub confidence: f64,
    /// Bootstrap replicates, at most [`MOST_REPLICATES`]; zero for no intervals.
    pub replicates: u32,
    /// Campaign seed.
    pub seed: u64,
}

/// One family fitted to the samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FamilyTail {
    /// Family.
    pub family: Family,
    /// The maximum-likelihood fit; absent if the family cannot hold the samples.
    pub fit: Option<Marginal>,
    /// Its log-likelihood.
    pub log_likelihood: Option<f64>,
    /// Akaike's criterion.
    pub aic: Option<f64>,
    /// Bayesian criterion.
    pub bic: Option<f64>,
    /// Why the family does not apply.
    pub note: Option<String>,
    /// The distances asked for, in that order; empty without a fit.
    pub distances: Vec<TailDistance>,
    /// Bootstrap replicates that the family could not be fitted to; they are in no interval.
    pub failed_replicates: u32,
}

/// The distance exceeded with a given probability, according to one family.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TailDistance {
    /// Exceedance probability, conditional on failure.
    pub probability: f64,
    /// Distance, m.
    pub distance_m: f64,
    /// Its bootstrap interval, m; absent without replicates.
    pub interval_m: Option<Interval>,
}

/// All families' tails, in the order of [`Family::ALL`], from samples in m.
///
/// The same samples in the same order, settings and seed give the same bits.
pub fn tails(samples_m: &[f64], settings: &TailSettings) -> Vec<FamilyTail> {
    let fits: Vec<_> = Family::ALL.iter().map(|&family| by_likelihood(family, samples_m)).collect();
    let fitted = fits.iter().flatten().copied().collect::<Vec<Marginal>>();
    let mut replicates = bootstrap(samples_m, &fitted, settings).into_iter();
    let tail = |(&family, fit): (&Family, &Result<Marginal, _>)| match fit {
        Ok(marginal) => family_tail(*marginal, samples_m, settings, replicates.next().unwrap_or_default()),
        Err(why) => unfitted(family, why),
    };
    Family::ALL.iter().zip(&fits).map(tail).collect()
}

/// The refitted distributions of each fitted family, one a successful replicate. Replicates have streams of their own and
/// are gathered in their order, so that the threads they are shared by move no bit.
fn bootstrap(samples_m: &[f64], fitted: &[Marginal], settings: &TailSettings) -> Vec<Vec<Marginal>> {
    let replicate = |replicate: u32| -> Vec<Option<Marginal>> {
        let mut stream = seed::stream(settings.seed, u64::from(replicate), Purpose::ReportBootstrap);
        let mut draw = || {
            // The upper half of the product is uniform over the places to within n / 2^64.
            let place = (u128::from(stream.next_u64()) * samples_m.len() as u128) >> 64;
            samples_m[place as usize]
        };
        let drawn: Vec<f64> = samples_m.iter().map(|_| draw()).collect();
        fitted.iter().map(|marginal| by_likelihood(marginal.family, &drawn).ok()).collect()
    };
    let replicates = settings.replicates.min(MOST_REPLICATES);
    let refits: Vec<_> = (0..replicates).into_par_iter().map(replicate).collect();
    (0..fitted.len()).map(|family| refits.iter().filter_map(|refit| refit[family]).collect()).collect()
}

fn family_tail(
    marginal: Marginal,
    samples_m: &[f64],
    settings: &TailSettings,
    refits: Vec<Marginal>,
) -> FamilyTail {
    // Two parameters in every family.
    const PARAMETERS: usize = 2;
    let log_likelihood = marginal.log_likelihood(samples_m);
    let distance = |&probability: &f64| {
        let mut replicated: Vec<f64> = refits.iter().map(|m| m.quantile(1.0 - probability)).collect();
        replicated.sort_by(f64::total_cmp);
        TailDistance {
            probability,
            distance_m: marginal.quantile(1.0 - probability),
            interval_m: percentile_interval(&replicated, settings.confidence),
        }
    };
    FamilyTail {
        family: marginal.family,
        fit: Some(marginal),
        log_likelihood: Some(log_likelihood),
        aic: Some(aic(log_likelihood, PARAMETERS)),
        bic: Some(bic(log_likelihood, PARAMETERS, samples_m.len())),
        note: None,
        distances: settings.probabilities.iter().map(distance).collect(),
        failed_replicates: settings.replicates.min(MOST_REPLICATES) - refits.len() as u32,
    }
}

fn unfitted(family: Family, why: &impl std::fmt::Display) -> FamilyTail {
    FamilyTail {
        family,
        fit: None,
        log_likelihood: None,
        aic: None,
        bic: None,
        note: Some(why.to_string()),
        distances: Vec::new(),
        failed_replicates: 0,
    }
}

/// The order statistics that leave half of 1 - confidence on either side; absent without values.
fn percentile_interval(sorted: &[f64], confidence: f64) -> Option<Interval> {
    let last = sorted.len().checked_sub(1)?;
    let outside = (0.5 * (1.0 - confidence) * sorted.len() as f64).floor() as usize;
    Some([sorted[outside.min(last)], sorted[last - outside.min(last)]])
}
