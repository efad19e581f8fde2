//! The numbers of the report, from the outcomes in index order: estimates, convergence, exceedance, distances.
//!
//! With few samples many of them cannot be given; they are absent then, and the page says so.

use super::families::{self, FittedFamily, Sensitivity};
use runout_core::campaign::Campaign;
use runout_core::estimate::exceedance::{self, EmpiricalDistance, Point};
use runout_core::estimate::interval::{self, Interval};
use runout_core::estimate::moments::Moments;
use runout_core::estimate::{Decision, Estimate, Estimator};
use runout_core::outcome::{Outcome, OutcomeKind};

/// Exceedance probabilities whose distances the report gives.
pub const PROBABILITIES: [f64; 3] = [0.1, 0.01, 0.001];

/// Points of a convergence curve; more would not be seen.
const CURVE_POINTS: usize = 300;

/// Everything that the page and the figures show.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// Estimates over the prefix that decided.
    pub estimate: Estimate,
    /// What the stopping rule said.
    pub decision: Decision,
    /// The samples, m, in index order.
    pub samples_m: Vec<f64>,
    /// Convergence of mean and standard deviation.
    pub convergence: Vec<ConvergencePoint>,
    /// Empirical exceedance curve.
    pub curve: Vec<Point>,
    /// The families fitted to the samples; empty if there are too few.
    pub families: Vec<FittedFamily>,
    /// Distances at [`PROBABILITIES`].
    pub distances: Vec<Distance>,
    /// Realisations to name: failed analyses and samples still moving at the end, with their reasons.
    pub remarkable: Vec<(u64, OutcomeKind, &'static str)>,
}

/// Mean and variance after some samples, with intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvergencePoint {
    /// Samples.
    pub samples: u64,
    /// Mean, m.
    pub mean_m: f64,
    /// Interval of the mean, m.
    pub mean_interval_m: Option<Interval>,
    /// Variance, m2.
    pub variance_m2: f64,
    /// Interval of the variance, m2.
    pub variance_interval_m2: Option<Interval>,
}

/// The distance that is exceeded with a given probability.
#[derive(Debug, Clone)]
pub struct Distance {
    /// Probability, given failure.
    pub probability: f64,
    /// Read off the samples, where they suffice.
    pub empirical: EmpiricalDistance,
    /// By the fitted families, given failure.
    pub fitted: Option<Sensitivity>,
    /// Samples beyond the best family's distance; absent without a fitted family.
    pub beyond: Option<u64>,
    /// By the best family at the same probability of the whole slope, stable realisations included, m; absent if the
    /// slope fails more rarely than that.
    pub unconditional_m: Option<f64>,
}

/// Analyses `outcomes`, which stand in index order from 0.
pub fn analyse(campaign: &Campaign, outcomes: &[Outcome]) -> Analysis {
    let mut estimator = Estimator::new(&campaign.stop, &campaign.model.sample, &campaign.run);
    for outcome in outcomes {
        // A gap ends the prefix: what lies beyond it is in no estimate.
        if estimator.push(outcome).is_err() {
            break;
        }
    }
    let estimate = estimator.estimate();
    let samples_m = estimator.samples_m().to_vec();
    let families = families::fit(&samples_m, campaign.seed, estimate.confidence);
    let best = families.iter().find(|f| f.best);
    let distances = PROBABILITIES
        .into_iter()
        .enumerate()
        .map(|(i, probability)| Distance {
            probability,
            empirical: exceedance::empirical_distance(&samples_m, probability, estimate.confidence),
            fitted: families::distance(&families, i),
            beyond: best.map(|family| {
                let distance_m = family.distance_m(probability);
                samples_m.iter().filter(|sample| **sample > distance_m).count() as u64
            }),
            unconditional_m: best
                .zip(estimate.p_failure)
                .filter(|(_, p)| *p > probability)
                .map(|(f, p)| f.distance_m(probability / p)),
        })
        .collect();
    Analysis {
        convergence: convergence(&samples_m, estimate.confidence),
        curve: exceedance::curve(&samples_m, estimate.stable, estimate.confidence),
        decision: estimator.decision(),
        remarkable: remarkable(&outcomes[..estimator.realisations().min(outcomes.len() as u64) as usize]),
        estimate,
        samples_m,
        families,
        distances,
    }
}

fn convergence(samples_m: &[f64], confidence: f64) -> Vec<ConvergencePoint> {
    let every = samples_m.len().div_ceil(CURVE_POINTS).max(1);
    let mut moments = Moments::default();
    let mut points = Vec::new();
    for (i, &sample) in samples_m.iter().enumerate() {
        moments.push(sample);
        let shown = (i + 1) % every == 0 || i + 1 == samples_m.len();
        let (Some(mean_m), Some(variance_m2), true) = (moments.mean(), moments.variance(), shown) else {
            continue;
        };
        points.push(ConvergencePoint {
            samples: moments.count(),
            mean_m,
            mean_interval_m: interval::mean(&moments, confidence),
            variance_m2,
            variance_interval_m2: interval::sd(&moments, confidence)
                .map(|[low, high]| [low * low, high * high]),
        });
    }
    points
}

fn remarkable(outcomes: &[Outcome]) -> Vec<(u64, OutcomeKind, &'static str)> {
    outcomes
        .iter()
        .filter(|o| o.outcome == OutcomeKind::Failed || !o.mark().is_empty())
        .map(|o| (o.index, o.outcome, if o.mark().is_empty() { o.reason.name() } else { o.mark() }))
        .collect()
}
