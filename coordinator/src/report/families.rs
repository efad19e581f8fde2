//! Fits the four families to the samples of runout, and gives distances in the tail with bootstrap intervals.
//!
//! 0.1 % cannot be read off a thousand samples; the fitted tail speaks there, and how much it depends on the choice
//! of family is part of the answer (Efron and Tibshirani 1993, chapter 13: percentile intervals).

use rand::RngExt;
use runout_core::estimate::interval::Interval;
use runout_core::marginal::{Family, Marginal, fit};
use runout_core::seed::{Purpose, stream};

/// Bootstrap samples: their 2.5 % and 97.5 % points then have a standard error of about 0.8 % in probability.
pub const BOOTSTRAP_SAMPLES: usize = 400;

/// Fewest samples to which families are fitted: two parameters and something left to judge the fit by.
pub const FEWEST_SAMPLES: usize = 5;

/// Both families' parameters, p and q, are fitted.
const PARAMETERS: usize = 2;

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
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// By the best family, m.
    pub best_m: f64,
    /// Its bootstrap percentile interval, m.
    pub interval_m: Interval,
    /// Smallest and largest over the four families by maximum likelihood, m.
    pub families_m: Interval,
    /// Smallest and largest over families and methods whose AIC is within 10 of the best, m.
    pub supported_m: Interval,
}

/// A family with an AIC this much above the best has essentially no support (Burnham and Anderson 2002, section 2.6).
const NO_SUPPORT_AIC: f64 = 10.0;

/// Fits every family by both methods; empty if the samples are too few.
pub fn fit(samples_m: &[f64]) -> Vec<FittedFamily> {
    if samples_m.len() < FEWEST_SAMPLES {
        return Vec::new();
    }
    let mut families = Vec::new();
    for method in [Method::Likelihood, Method::Moments] {
        for family in Family::ALL {
            let Some(marginal) = fit_one(family, method, samples_m) else { continue };
            let log_likelihood = marginal.log_likelihood(samples_m);
            families.push(FittedFamily {
                family,
                method,
                marginal,
                log_likelihood,
                aic: fit::aic(log_likelihood, PARAMETERS),
                bic: fit::bic(log_likelihood, PARAMETERS, samples_m.len()),
                best: false,
            });
        }
    }
    let by_likelihood = families.iter_mut().filter(|f| f.method == Method::Likelihood);
    if let Some(best) = by_likelihood.min_by(|a, b| a.aic.total_cmp(&b.aic)) {
        best.best = true;
    }
    families
}

/// Distances at [`super::analysis::PROBABILITIES`]; empty without a fitted family.
pub fn distances(
    samples_m: &[f64],
    families: &[FittedFamily],
    campaign_seed: u64,
    confidence: f64,
) -> Vec<Sensitivity> {
    let Some(best) = families.iter().find(|f| f.best) else { return Vec::new() };
    let resampled = bootstrap(samples_m, best.family, campaign_seed);
    super::analysis::PROBABILITIES
        .into_iter()
        .map(|probability| {
            let mut distances: Vec<f64> =
                resampled.iter().map(|m| m.quantile(1.0 - probability)).filter(|d| d.is_finite()).collect();
            distances.sort_by(f64::total_cmp);
            let of = |keep: &dyn Fn(&&FittedFamily) -> bool| {
                let values = families.iter().filter(keep).map(|f| f.distance_m(probability));
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], d| [l.min(d), h.max(d)])
            };
            Sensitivity {
                best_m: best.distance_m(probability),
                interval_m: percentiles(&distances, confidence, best.distance_m(probability)),
                families_m: of(&|f| f.method == Method::Likelihood),
                supported_m: of(&|f| f.aic - best.aic <= NO_SUPPORT_AIC),
            }
        })
        .collect()
}

fn fit_one(family: Family, method: Method, samples_m: &[f64]) -> Option<Marginal> {
    match method {
        Method::Likelihood => fit::by_likelihood(family, samples_m).ok(),
        Method::Moments => fit::by_moments(family, samples_m).ok(),
    }
}

/// The family fitted to resampled samples; a resample that cannot be fitted is left out.
fn bootstrap(samples_m: &[f64], family: Family, campaign_seed: u64) -> Vec<Marginal> {
    let mut random = stream(campaign_seed, 0, Purpose::ReportBootstrap);
    let mut resample = vec![0.0; samples_m.len()];
    (0..BOOTSTRAP_SAMPLES)
        .filter_map(|_| {
            resample.fill_with(|| samples_m[random.random_range(0..samples_m.len())]);
            fit_one(family, Method::Likelihood, &resample)
        })
        .collect()
}

fn percentiles(sorted: &[f64], confidence: f64, otherwise: f64) -> Interval {
    let at = |share: f64| {
        let place = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
        sorted.get(place).copied().unwrap_or(otherwise)
    };
    [at(0.5 - 0.5 * confidence), at(0.5 + 0.5 * confidence)]
}
