//! The two stopping rules, evaluated on the prefix of outcomes in index order.
//!
//! *The paper's rule* (Ma et al. 2024, Eqs. 22-23): the last sample changed mean and variance (divisor n, as the paper
//! defines it) by less than the tolerance, so many samples in a row. It is shipped as written, but it is no test of
//! accuracy: one sample moves the mean by (X_n - mean)/n, whatever the error of that mean. With an absolute
//! tolerance e on both, neither chance nor luck can meet it before n = (sqrt(1 + 4 s^2) - 1)/(2 e), which is
//! [`earliest_paper_stop`].
//!
//! *The interval rule*: confidence intervals of the mean, the standard deviation and chosen exceedances are narrow
//! enough. Rules look again at every sample, so that the coverage at the stopping index is a little below the
//! level (Chow & Robbins 1965 show that it tends to the level as the width asked for goes to zero).

use super::interval;
use super::moments::Moments;
use crate::campaign::{ExceedanceTarget, StopRule};
use serde::{Deserialize, Serialize};

/// What a rule remembers between samples.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct RuleState {
    /// Mean and population variance before the last sample.
    previous: Option<(f64, f64)>,
    /// How many samples in a row have met the paper's conditions.
    streak: u64,
}

impl RuleState {
    /// Takes note of a new sample, already in `moments`.
    pub(super) fn note(&mut self, rule: &StopRule, moments: &Moments) {
        let (Some(mean), Some(variance)) = (moments.mean(), moments.population_variance()) else { return };
        if let (StopRule::Paper { tolerance, relative, .. }, Some(previous)) = (rule, self.previous) {
            let (of_mean, of_variance) = paper_tolerances(*tolerance, *relative, mean, variance);
            let met = (mean - previous.0).abs() < of_mean && (variance - previous.1).abs() < of_variance;
            self.streak = if met { self.streak + 1 } else { 0 };
        }
        self.previous = Some((mean, variance));
    }

    /// Whether the rule holds now; `hits` are the samples beyond each exceedance target.
    pub(super) fn holds(&self, rule: &StopRule, moments: &Moments, hits: &[u64]) -> bool {
        match rule {
            StopRule::Paper { patience, .. } => self.streak >= *patience,
            StopRule::Interval { confidence, mean_half_width, sd_half_width, exceedance } => {
                sd_half_width.is_none_or(|most| sd_is_narrow(moments, *confidence, most))
                    && mean_half_width.is_none_or(|most| mean_is_narrow(moments, *confidence, most))
                    && exceedance.iter().zip(hits).all(|(target, &hits)| {
                        exceedance_half_width(hits, moments.count(), *confidence)
                            .is_some_and(|half| half <= target.half_width)
                    })
            }
        }
    }

    /// How many samples in a row have met the paper's conditions.
    pub(super) fn streak(&self) -> u64 {
        self.streak
    }
}

/// Tolerances of the mean, m, and of the variance, m2.
pub(super) fn paper_tolerances(tolerance: f64, relative: bool, mean: f64, variance: f64) -> (f64, f64) {
    if relative { (tolerance * mean.abs(), tolerance * variance) } else { (tolerance, tolerance) }
}

/// Fewest samples with which the paper's rule can hold, given the standard deviation (m) and an absolute tolerance
/// (m and m2).
///
/// With d = X_n - mean, Eq. 22 asks for |d| < e n and Eq. 23 for |d^2 - s^2| < e n; both leave room for a d only
/// once e n > sqrt(s^2 - e n).
pub fn earliest_paper_stop(sd_m: f64, tolerance: f64) -> f64 {
    ((1.0 + 4.0 * sd_m * sd_m).sqrt() - 1.0) / (2.0 * tolerance)
}

/// The distances whose exceedance a rule watches.
pub(super) fn targets(rule: &StopRule) -> &[ExceedanceTarget] {
    match rule {
        StopRule::Paper { .. } => &[],
        StopRule::Interval { exceedance, .. } => exceedance,
    }
}

/// One thing that a stopping rule asks for, and how far it is met.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Requirement {
    /// What is asked for, in words.
    pub what: String,
    /// Where it stands; absent if too few samples tell.
    pub now: Option<f64>,
    /// Where it must be: `now` at most this, or at least for a streak.
    pub target: f64,
    /// Whether it is met.
    pub met: bool,
}

/// Everything that `rule` asks for besides the fewest realisations, and how far it is met; `hits` are the samples
/// beyond each exceedance target.
pub(super) fn requirements(
    rule: &StopRule,
    moments: &Moments,
    hits: &[u64],
    streak: u64,
) -> Vec<Requirement> {
    let at_most = |what: String, now: Option<f64>, target: f64| Requirement {
        what,
        now,
        target,
        met: now.is_some_and(|now| now <= target),
    };
    match rule {
        StopRule::Paper { patience, .. } => vec![Requirement {
            what: "samples in a row that changed little".to_owned(),
            now: Some(streak as f64),
            target: *patience as f64,
            met: streak >= *patience,
        }],
        StopRule::Interval { confidence, mean_half_width: mean, sd_half_width: sd, exceedance } => {
            let mean = mean.map(|most| {
                at_most("half-width / mean".to_owned(), mean_half_width(moments, *confidence), most)
            });
            let sd = sd.map(|most| {
                let now = sd_half_width(moments, *confidence);
                at_most("half-width / sd".to_owned(), now, most)
            });
            let exceedance = exceedance.iter().zip(hits).map(|(target, &hits)| {
                let what = format!("half-width of the exceedance of {} m", target.distance_m);
                let now = exceedance_half_width(hits, moments.count(), *confidence);
                at_most(what, now, target.half_width)
            });
            mean.into_iter().chain(sd).chain(exceedance).collect()
        }
    }
}

/// Half-width of the mean's interval as a share of the mean.
pub(super) fn mean_half_width(moments: &Moments, confidence: f64) -> Option<f64> {
    Some(interval::half_width(interval::mean(moments, confidence)?) / moments.mean()?.abs())
}

/// Half-width of the standard deviation's interval as a share of it.
pub(super) fn sd_half_width(moments: &Moments, confidence: f64) -> Option<f64> {
    Some(interval::half_width(interval::sd(moments, confidence)?) / moments.sd()?)
}

/// Half-width of an exceedance probability's interval.
pub(super) fn exceedance_half_width(hits: u64, samples: u64, confidence: f64) -> Option<f64> {
    interval::probability(hits, samples, confidence).map(interval::half_width)
}

fn mean_is_narrow(moments: &Moments, confidence: f64, most: f64) -> bool {
    let (Some(mean), Some(sd)) = (moments.mean(), moments.sd()) else { return false };
    // Student's t is wider than the normal: where the cheap normal interval is too wide already, t is not needed.
    let normal = interval::two_sided_z(confidence) * sd / (moments.count() as f64).sqrt();
    normal <= most * mean.abs() && mean_half_width(moments, confidence).is_some_and(|half| half <= most)
}

fn sd_is_narrow(moments: &Moments, confidence: f64, most: f64) -> bool {
    sd_half_width(moments, confidence).is_some_and(|half| half <= most)
}
