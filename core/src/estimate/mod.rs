//! Folds outcomes, in index order, into estimates, intervals and the stopping decision.
//!
//! A *sample* is a realisation whose slope failed (outcome `runout`); every moment and exceedance here is
//! conditional on that, and `p_failure` says how often it happens. Stable realisations and failed analyses are
//! counted, never dropped in silence. The decision is a function of the prefix of outcomes alone: it is taken
//! once, at a deterministic index, and what comes after that index changes nothing.
//!
//! * [`moments`]: running mean, variance and kurtosis.
//! * [`interval`]: confidence intervals; [`quantiles`] are the distribution functions they need.
//! * [`rule`]: the stopping rules; [`remaining`] guesses how much a rule still needs.
//! * [`exceedance`]: the exceedance curve of the runout distance with pointwise intervals; [`tail`]: distances of small
//!   exceedance probability from fitted families.
//! * [`saved`]: a fold as numbers, so that it can be taken up later.

pub mod exceedance;
pub mod interval;
pub mod moments;
pub mod quantiles;
pub mod remaining;
pub mod rule;
pub mod saved;
pub mod tail;

use crate::campaign::{OnFailure, Run, RunoutMeasure, Sample, Stop, StopRule};
use crate::outcome::{Outcome, OutcomeKind, Reason};
use interval::Interval;
use moments::Moments;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Confidence level of reported intervals where the stopping rule names none.
pub const REPORT_CONFIDENCE: f64 = 0.95;

/// What the prefix of outcomes says about going on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "decision", rename_all = "kebab-case")]
pub enum Decision {
    /// More realisations are needed.
    Continue,
    /// The rule holds.
    Converged {
        /// Realisations in the prefix that met it.
        realisations: u64,
        /// Samples among them.
        samples: u64,
    },
    /// The maximum number of realisations is reached and the rule does not hold.
    Maximum,
    /// A failed analysis ended the campaign (`on_failure = "abort"`).
    Aborted {
        /// Index of the failed realisation.
        index: u64,
        /// Why it failed.
        reason: Reason,
    },
}

/// Mean and variance after one more sample, for the convergence plot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Iterate {
    /// Realisations up to and including this sample.
    pub realisations: u64,
    /// The sample, m.
    pub runout_m: f64,
    /// Mean of the samples so far, m.
    pub mean_m: f64,
    /// Their variance with divisor n - 1, m2; zero for the first sample.
    pub variance_m2: f64,
}

/// An exceedance probability that the stopping rule watches.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TargetEstimate {
    /// Runout distance, m.
    pub distance_m: f64,
    /// Share of the samples beyond it (conditional on failure).
    pub probability: f64,
    /// Its Clopper-Pearson interval.
    pub interval: Interval,
}

/// Everything known from the prefix. What is not defined yet is absent, never NaN.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Realisations in the prefix: samples, stable and failed.
    pub realisations: u64,
    /// Realisations whose slope failed.
    pub samples: u64,
    /// Realisations whose slope stood.
    pub stable: u64,
    /// Failed analyses; they are in no estimate.
    pub failed: u64,
    /// Samples whose material still moved when the analysis ended: their runout is a lower bound.
    pub still_moving: u64,
    /// Realisations, samples or stable, whose balance of energy drifted beyond the limit.
    pub energy_drifted: u64,
    /// Confidence level of every interval here.
    pub confidence: f64,
    /// Mean runout, m.
    pub mean_m: Option<f64>,
    /// Interval of the mean (Student), m.
    pub mean_interval_m: Option<Interval>,
    /// Standard error of the mean, m.
    pub standard_error_m: Option<f64>,
    /// Variance (divisor n - 1), m2.
    pub variance_m2: Option<f64>,
    /// Standard deviation, m.
    pub sd_m: Option<f64>,
    /// Interval of the standard deviation (see [`interval::sd`]), m.
    pub sd_interval_m: Option<Interval>,
    /// Coefficient of variation: standard deviation over mean.
    pub cov: Option<f64>,
    /// Smallest sample, m.
    pub min_m: Option<f64>,
    /// Largest sample, m.
    pub max_m: Option<f64>,
    /// Samples over samples and stable realisations.
    pub p_failure: Option<f64>,
    /// Its Clopper-Pearson interval. Failed analyses are in neither count: with many of them it says too much.
    pub p_failure_interval: Option<Interval>,
    /// The exceedance probabilities that the stopping rule watches.
    pub exceedance: Vec<TargetEstimate>,
}

/// An outcome that does not come next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("outcome {found} was given where outcome {expected} comes next: outcomes are folded in index order")]
pub struct OutOfOrder {
    /// Index that comes next.
    pub expected: u64,
    /// Index given.
    pub found: u64,
}

/// The fold over outcomes in index order.
#[derive(Debug, Clone)]
pub struct Estimator {
    stop: Stop,
    measure: RunoutMeasure,
    on_failure: OnFailure,
    next_index: u64,
    realisations: u64,
    stable: u64,
    failed: u64,
    still_moving: u64,
    energy_drifted: u64,
    samples_m: Vec<f64>,
    history: Vec<Iterate>,
    moments: Moments,
    hits: Vec<u64>,
    state: rule::RuleState,
    decision: Decision,
}

impl Estimator {
    /// An empty fold.
    pub fn new(stop: &Stop, sample: &Sample, run: &Run) -> Estimator {
        Estimator::empty(stop.clone(), sample.measure, run.on_failure)
    }

    /// The fold under the same settings before its first outcome.
    pub fn restarted(&self) -> Estimator {
        Estimator::empty(self.stop.clone(), self.measure, self.on_failure)
    }

    fn empty(stop: Stop, measure: RunoutMeasure, on_failure: OnFailure) -> Estimator {
        Estimator {
            measure,
            on_failure,
            next_index: 0,
            realisations: 0,
            stable: 0,
            failed: 0,
            still_moving: 0,
            energy_drifted: 0,
            samples_m: Vec::new(),
            history: Vec::new(),
            moments: Moments::default(),
            hits: vec![0; rule::targets(&stop.rule).len()],
            stop,
            state: rule::RuleState::default(),
            decision: Decision::Continue,
        }
    }

    /// Folds the next outcome. Once the decision is taken, further outcomes are checked for order and otherwise
    /// left out, so that estimates belong to the prefix that decided.
    ///
    /// A `runout` outcome without a finite measure cannot be a sample and is counted as a failed analysis (non-finite).
    ///
    /// # Errors
    /// An outcome whose index is not the next one; nothing is changed then.
    pub fn push(&mut self, outcome: &Outcome) -> Result<(), OutOfOrder> {
        if outcome.index != self.next_index {
            return Err(OutOfOrder { expected: self.next_index, found: outcome.index });
        }
        self.next_index += 1;
        if self.decision != Decision::Continue {
            return Ok(());
        }
        self.realisations += 1;
        let runout_m = outcome.measures.as_ref().map(|m| self.measure.of(m)).filter(|r| r.is_finite());
        self.energy_drifted += u64::from(outcome.energy_drifted);
        let mut failure = None;
        match (outcome.outcome, runout_m) {
            (OutcomeKind::Runout, Some(runout_m)) => {
                self.still_moving += u64::from(outcome.reason == Reason::StillMoving);
                self.add_sample(runout_m);
            }
            (OutcomeKind::Stable, _) => self.stable += 1,
            (OutcomeKind::Failed, _) => failure = Some(outcome.reason),
            (OutcomeKind::Runout, None) => failure = Some(Reason::NonFinite),
        }
        self.failed += u64::from(failure.is_some());
        self.decision = match failure {
            Some(reason) if self.on_failure == OnFailure::Abort => {
                Decision::Aborted { index: outcome.index, reason }
            }
            _ => self.decide(),
        };
        Ok(())
    }

    /// What the prefix says about going on.
    pub fn decision(&self) -> Decision {
        self.decision
    }

    /// Index of the outcome that [`Estimator::push`] takes next.
    pub fn next_index(&self) -> u64 {
        self.next_index
    }

    /// Realisations folded into the estimates.
    pub fn realisations(&self) -> u64 {
        self.realisations
    }

    /// The samples, m, in index order.
    pub fn samples_m(&self) -> &[f64] {
        &self.samples_m
    }

    /// Mean and variance after each sample.
    pub fn history(&self) -> &[Iterate] {
        &self.history
    }

    /// Samples in a row that have met the paper's conditions; zero under the interval rule.
    pub fn streak(&self) -> u64 {
        self.state.streak()
    }

    /// What the stopping rule asks for besides the fewest realisations, and how far it is met.
    pub fn requirements(&self) -> Vec<rule::Requirement> {
        rule::requirements(&self.stop.rule, &self.moments, &self.hits, self.state.streak())
    }

    /// Confidence level of the intervals: the stopping rule's, else [`REPORT_CONFIDENCE`].
    pub fn confidence(&self) -> f64 {
        match self.stop.rule {
            StopRule::Interval { confidence, .. } => confidence,
            StopRule::Paper { .. } => REPORT_CONFIDENCE,
        }
    }

    /// Likely number of realisations still needed, at least one while undecided; absent while too few samples
    /// tell (see [`remaining`]). A guess for progress displays: nothing depends on it.
    pub fn expected_remaining(&self) -> Option<u64> {
        if self.decision != Decision::Continue {
            return Some(0);
        }
        let samples = self.samples_m.len() as u64;
        let needed = remaining::samples_needed(&self.stop.rule, &self.samples_m, &self.moments, &self.hits)?;
        let realisations_per_sample = self.realisations as f64 / samples as f64;
        let more = ((needed - samples as f64) * realisations_per_sample).ceil().max(1.0);
        // The cast saturates, and no estimate goes beyond the campaign's maximum.
        let total = self.realisations.saturating_add(more as u64);
        let total = total.max(self.stop.minimum_realisations).min(self.stop.maximum_realisations);
        Some(total.saturating_sub(self.realisations))
    }

    /// Everything known from the prefix.
    pub fn estimate(&self) -> Estimate {
        let confidence = self.confidence();
        let samples = self.samples_m.len() as u64;
        let sd_m = self.moments.sd();
        let mean_m = self.moments.mean();
        let decided = samples + self.stable;
        Estimate {
            realisations: self.realisations,
            samples,
            stable: self.stable,
            failed: self.failed,
            still_moving: self.still_moving,
            energy_drifted: self.energy_drifted,
            confidence,
            mean_m,
            mean_interval_m: interval::mean(&self.moments, confidence),
            standard_error_m: sd_m.map(|sd| sd / (samples as f64).sqrt()),
            variance_m2: self.moments.variance(),
            sd_m,
            sd_interval_m: interval::sd(&self.moments, confidence),
            cov: sd_m.zip(mean_m).filter(|(_, mean)| *mean > 0.0).map(|(sd, mean)| sd / mean),
            min_m: self.samples_m.iter().copied().reduce(f64::min),
            max_m: self.samples_m.iter().copied().reduce(f64::max),
            p_failure: (decided > 0).then(|| samples as f64 / decided as f64),
            p_failure_interval: interval::probability(samples, decided, confidence),
            exceedance: self.target_estimates(confidence),
        }
    }

    fn add_sample(&mut self, runout_m: f64) {
        self.samples_m.push(runout_m);
        self.moments.push(runout_m);
        for (target, hits) in rule::targets(&self.stop.rule).iter().zip(&mut self.hits) {
            *hits += u64::from(runout_m > target.distance_m);
        }
        self.state.note(&self.stop.rule, &self.moments);
        self.history.push(Iterate {
            realisations: self.realisations,
            runout_m,
            mean_m: self.moments.mean().unwrap_or(runout_m),
            variance_m2: self.moments.variance().unwrap_or(0.0),
        });
    }

    fn decide(&self) -> Decision {
        if self.realisations >= self.stop.minimum_realisations
            && self.state.holds(&self.stop.rule, &self.moments, &self.hits)
        {
            let samples = self.samples_m.len() as u64;
            return Decision::Converged { realisations: self.realisations, samples };
        }
        if self.realisations >= self.stop.maximum_realisations {
            return Decision::Maximum;
        }
        Decision::Continue
    }

    fn target_estimates(&self, confidence: f64) -> Vec<TargetEstimate> {
        let samples = self.samples_m.len() as u64;
        let watched = rule::targets(&self.stop.rule).iter().zip(&self.hits);
        watched
            .filter_map(|(target, &hits)| {
                Some(TargetEstimate {
                    distance_m: target.distance_m,
                    probability: hits as f64 / samples as f64,
                    interval: interval::probability(hits, samples, confidence)?,
                })
            })
            .collect()
    }
}
