//! The families fitted to the samples of runout, by both methods, and the tail distances they give.
//!
//! 0.1 % cannot be read off a thousand samples; the fitted tail speaks there, and how much it depends on the choice
//! of family is part of the answer.

use super::analysis::PROBABILITIES;
use runout_core::estimate::interval::Interval;
use runout_core::estimate::tail::{FamilyTail, TailSettings, tails};
use runout_core::marginal::{Family, Marginal, fit};
use serde::Serialize;

/// Bootstrap replicates: their 2.5 % and 97.5 % points then have a standard error of about 0.8 % in probability.
const MOST_REPLICATES: u32 = 400;
/// With a quarter as many that standard error is 1.6 %: still less than the choice of the family moves a tail.
const FEWEST_REPLICATES: u32 = 100;
/// Values drawn by all replicates together before they become fewer: fitting four families to them takes some 10 s of one
/// core.
const MOST_DRAWN: u64 = 1_000_000;

/// Fewest samples to which families are fitted: two parameters and something left to judge the fit by.
pub const FEWEST_SAMPLES: usize = 5;

/// Every family has the parameters p and q.
const PARAMETERS: usize = 2;

/// A family with an AIC this much above the best has essentially no support (Burnham and Anderson 2002, section 2.6).
const NO_SUPPORT_AIC: f64 = 10.0;

/// How a family was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Maximum likelihood.
    Likelihood,
    /// Method of moments, as in the paper.
    Moments,
}

impl Method {
    /// The name used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Method::Likelihood => "likelihood",
            Method::Moments => "moments",
        }
    }
}

/// A family fitted to the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedFamily {
    /// Family.
    pub family: Family,
    /// Method.
    pub method: Method,
    /// The distribution.
    pub marginal: Marginal,
    /// Log-likelihood of the samples.
    pub log_likelihood: f64,
    /// Akaike's criterion.
    pub aic: f64,
    /// Bayesian criterion.
    pub bic: f64,
    /// Bootstrap intervals of the distances at [`PROBABILITIES`], m; maximum likelihood only.
    pub intervals_m: Vec<Option<Interval>>,
    /// Whether it has the smallest AIC of those fitted by maximum likelihood.
    pub best: bool,
}

impl FittedFamily {
    /// Density at `x` m, 1/m.
    pub fn density(&self, x: f64) -> f64 {
        self.marginal.density(x)
    }

    /// Probability of more than `x` m.
    pub fn exceedance(&self, x: f64) -> f64 {
        self.marginal.survival(x)
    }

    /// Distance exceeded with this probability, m.
    pub fn distance_m(&self, probability: f64) -> f64 {
        self.marginal.quantile(1.0 - probability)
    }
}

/// A tail distance by the fitted families.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivity {
    /// By the best family, m.
    pub best_m: f64,
    /// Its bootstrap percentile interval, m.
    pub interval_m: Option<Interval>,
    /// Smallest and largest over the four families by maximum likelihood, m.
    pub families_m: Interval,
    /// Smallest and largest over families and methods whose AIC is within 10 of the best, m.
    pub supported_m: Interval,
}

/// Bootstrap replicates for that many samples.
pub fn replicates(samples: usize) -> u32 {
    let affordable = MOST_DRAWN / (samples as u64).max(1);
    affordable.clamp(u64::from(FEWEST_REPLICATES), u64::from(MOST_REPLICATES)) as u32
}

/// Fits every family by both methods; empty if the samples are too few. A family that cannot hold the samples is left
/// out.
pub fn fit(samples_m: &[f64], campaign_seed: u64, confidence: f64) -> Vec<FittedFamily> {
    if samples_m.len() < FEWEST_SAMPLES {
        return Vec::new();
    }
    let settings = TailSettings {
        probabilities: PROBABILITIES.to_vec(),
        confidence,
        replicates: replicates(samples_m.len()),
        seed: campaign_seed,
    };
    let mut families: Vec<FittedFamily> =
        tails(samples_m, &settings).iter().filter_map(|tail| by_likelihood(tail, samples_m)).collect();
    if let Some(best) = families.iter_mut().min_by(|a, b| a.aic.total_cmp(&b.aic)) {
        best.best = true;
    }
    let by_moments = Family::ALL.iter().filter_map(|family| fit::by_moments(*family, samples_m).ok());
    families.extend(by_moments.map(|marginal| fitted(marginal, Method::Moments, samples_m)));
    families
}

/// The distance exceeded with the `place`-th of [`PROBABILITIES`]; absent without a fitted family.
pub fn distance(families: &[FittedFamily], place: usize) -> Option<Sensitivity> {
    let best = families.iter().find(|f| f.best)?;
    let probability = PROBABILITIES[place];
    let over = |keep: &dyn Fn(&&FittedFamily) -> bool| {
        let values = families.iter().filter(keep).map(|f| f.distance_m(probability));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], d| [l.min(d), h.max(d)])
    };
    Some(Sensitivity {
        best_m: best.distance_m(probability),
        interval_m: best.intervals_m.get(place).copied().flatten(),
        families_m: over(&|f| f.method == Method::Likelihood),
        supported_m: over(&|f| f.aic - best.aic <= NO_SUPPORT_AIC),
    })
}

fn by_likelihood(tail: &FamilyTail, samples_m: &[f64]) -> Option<FittedFamily> {
    let intervals_m = tail.distances.iter().map(|d| d.interval_m).collect();
    Some(FittedFamily { intervals_m, ..fitted(tail.fit?, Method::Likelihood, samples_m) })
}

fn fitted(marginal: Marginal, method: Method, samples_m: &[f64]) -> FittedFamily {
    let log_likelihood = marginal.log_likelihood(samples_m);
    FittedFamily {
        family: marginal.family,
        method,
        marginal,
        log_likelihood,
        aic: fit::aic(log_likelihood, PARAMETERS),
        bic: fit::bic(log_likelihood, PARAMETERS, samples_m.len()),
        intervals_m: Vec::new(),
        best: false,
    }
}
