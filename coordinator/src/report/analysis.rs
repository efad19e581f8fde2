//! The numbers of the report, from the outcomes in index order: estimates, convergence, exceedance, distances.
//!
//! With few samples many of them cannot be given; they are absent then, and the page says so.

use super::families::{self, FittedFamily, Sensitivity};
use super::picks::{self, Pick};
use super::reach::{self, Reach};
use runout_core::campaign::Campaign;
use runout_core::estimate::exceedance::{self, EmpiricalDistance, Point};
use runout_core::estimate::interval::{self, Interval};
use runout_core::estimate::moments::Moments;
use runout_core::estimate::{Decision, Estimate, Estimator};
use runout_core::outcome::{Measures, Outcome, OutcomeKind};
use serde::Serialize;

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
    /// Indices of the realisations whose slope stood.
    pub stable: Vec<u64>,
    /// Index of each sample's realisation.
    pub indices: Vec<u64>,
    /// Convergence of mean, variance and coefficient of variation.
    pub convergence: Vec<ConvergencePoint>,
    /// Probability of failure after some realisations.
    pub failure: Vec<FailurePoint>,
    /// Empirical exceedance curve.
    pub curve: Vec<Point>,
    /// The families fitted to the samples; empty if there are too few.
    pub families: Vec<FittedFamily>,
    /// Distances at [`PROBABILITIES`].
    pub distances: Vec<Distance>,
    /// Realisations to name: failed analyses and samples still moving at the end, with their reasons.
    pub remarkable: Vec<(u64, OutcomeKind, &'static str)>,
    /// How far in front of the toe, and behind the crest, the ground is reached.
    pub reach: Reach,
    /// Areas that moved in the samples, m2.
    pub moved_areas_m2: Vec<f64>,
    /// Retreats of the crest in the samples, m.
    pub retreats_m: Vec<f64>,
    /// The samples that are shown: median, tail, longest.
    pub picks: Vec<Pick>,
}

/// Mean and variance after some samples, with intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvergencePoint {
    /// Samples.
    pub samples: u64,
    /// Realisations up to the last of them.
    pub realisations: u64,
    /// Mean, m.
    pub mean_m: f64,
    /// Interval of the mean, m.
    pub mean_interval_m: Option<Interval>,
    /// Variance, m2.
    pub variance_m2: f64,
    /// Interval of the variance, m2.
    pub variance_interval_m2: Option<Interval>,
    /// Coefficient of variation.
    pub cov: f64,
}

/// The probability of failure after some realisations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FailurePoint {
    /// Realisations that are samples or stable.
    pub realisations: u64,
    /// Share of samples among them.
    pub probability: f64,
    /// Its Clopper-Pearson interval.
    pub interval: Interval,
}

/// The distance that is exceeded with a given probability.
#[derive(Debug, Clone, Serialize)]
pub struct Distance {
    /// Probability, given failure.
    pub probability: f64,
    /// Read off the samples, where they suffice.
    pub empirical: EmpiricalDistance,
    /// By the fitted families, given failure.
    pub fitted: Option<Sensitivity>,
    /// Samples beyond the best family's distance; absent without a fitted family.
    pub beyond: Option<u64>,
    /// Read off samples and stable realisations together, which exceed nothing: at the same probability of the whole slope.
    pub unconditional: EmpiricalDistance,
    /// By the best family at the same probability of the whole slope, stable realisations included, m; absent if the
    /// slope fails more rarely than that.
    pub unconditional_m: Option<f64>,
}

impl Distance {
    /// The distance for the whole slope that the realisations settle, m; absent where they are too few, or fail too rarely.
    pub fn settled_unconditional_m(&self) -> Option<f64> {
        self.unconditional
            .settled_m()
            .map(|(distance_m, _)| distance_m)
            .filter(|distance_m| *distance_m > 0.0)
    }

    /// Whether the best family's distance lies outside the interval of the samples' own.
    pub fn is_contradicted(&self) -> bool {
        let outside = |([low, high], best_m): (Interval, f64)| best_m < low || best_m > high;
        self.empirical.interval_m.zip(self.fitted.as_ref().map(|f| f.best_m)).is_some_and(outside)
    }
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
    let prefix = &outcomes[..estimator.realisations().min(outcomes.len() as u64) as usize];
    let samples = samples(campaign, prefix);
    let indices: Vec<u64> = samples.iter().map(|(index, _)| *index).collect();
    let mut sorted_m = samples_m.clone();
    sorted_m.sort_by(f64::total_cmp);
    let with_stable: Vec<f64> = (0..estimate.stable).map(|_| 0.0).chain(sorted_m.iter().copied()).collect();
    let families = families::fit(&samples_m, campaign.seed, estimate.confidence);
    let best = families.iter().find(|f| f.best);
    let distances = PROBABILITIES
        .into_iter()
        .enumerate()
        .map(|(i, probability)| Distance {
            probability,
            empirical: exceedance::empirical_distance(&sorted_m, probability, estimate.confidence),
            fitted: families::distance(&families, i),
            beyond: best.map(|family| {
                let distance_m = family.distance_m(probability);
                samples_m.iter().filter(|sample| **sample > distance_m).count() as u64
            }),
            unconditional: exceedance::empirical_distance(&with_stable, probability, estimate.confidence),
            unconditional_m: best
                .zip(estimate.p_failure)
                .filter(|(_, p)| *p > probability)
                .map(|(f, p)| f.distance_m(probability / p)),
        })
        .collect();
    Analysis {
        convergence: convergence(&samples_m, &indices, estimate.confidence),
        failure: failure(prefix, &indices, estimate.confidence),
        curve: exceedance::curve(&samples_m, estimate.stable, estimate.confidence),
        decision: estimator.decision(),
        stable: stable(prefix),
        remarkable: remarkable(prefix),
        reach: reach::reach(prefix, estimate.confidence),
        moved_areas_m2: samples.iter().map(|(_, m)| m.moved_area_m2).collect(),
        retreats_m: samples.iter().map(|(_, m)| m.crest_retreat_m).collect(),
        picks: picks::picks(&indices, &samples_m),
        indices,
        estimate,
        samples_m,
        families,
        distances,
    }
}

/// The samples as the estimator counts them: slopes that failed, with a finite measure.
fn samples<'a>(campaign: &Campaign, outcomes: &'a [Outcome]) -> Vec<(u64, &'a Measures)> {
    let measure = campaign.model.sample.measure;
    outcomes
        .iter()
        .filter(|o| o.outcome == OutcomeKind::Runout)
        .filter_map(|o| o.measures.as_ref().map(|m| (o.index, m)))
        .filter(|(_, m)| measure.of(m).is_finite())
        .collect()
}

/// Whether the `place`-th of `count` points of a curve is among those shown.
fn is_shown(place: usize, count: usize) -> bool {
    let every = count.div_ceil(CURVE_POINTS).max(1);
    (place + 1).is_multiple_of(every) || place + 1 == count
}

fn convergence(samples_m: &[f64], indices: &[u64], confidence: f64) -> Vec<ConvergencePoint> {
    let mut moments = Moments::default();
    let mut points = Vec::new();
    for (i, (&sample, &index)) in samples_m.iter().zip(indices).enumerate() {
        moments.push(sample);
        let (Some(mean_m), Some(variance_m2), true) =
            (moments.mean(), moments.variance(), is_shown(i, samples_m.len()))
        else {
            continue;
        };
        points.push(ConvergencePoint {
            samples: moments.count(),
            realisations: index + 1,
            mean_m,
            mean_interval_m: interval::mean(&moments, confidence),
            variance_m2,
            variance_interval_m2: interval::sd(&moments, confidence)
                .map(|[low, high]| [low * low, high * high]),
            cov: variance_m2.sqrt() / mean_m,
        });
    }
    points
}

fn failure(outcomes: &[Outcome], samples: &[u64], confidence: f64) -> Vec<FailurePoint> {
    let decided: Vec<u64> = outcomes
        .iter()
        .filter(|o| o.outcome == OutcomeKind::Stable || samples.binary_search(&o.index).is_ok())
        .map(|o| o.index)
        .collect();
    let shown = (0..decided.len()).filter(|i| is_shown(*i, decided.len()));
    shown
        .filter_map(|i| {
            let hits = samples.partition_point(|index| *index <= decided[i]) as u64;
            let realisations = i as u64 + 1;
            Some(FailurePoint {
                realisations,
                probability: hits as f64 / realisations as f64,
                interval: interval::probability(hits, realisations, confidence)?,
            })
        })
        .collect()
}

fn stable(outcomes: &[Outcome]) -> Vec<u64> {
    outcomes.iter().filter(|o| o.outcome == OutcomeKind::Stable).map(|o| o.index).collect()
}

fn remarkable(outcomes: &[Outcome]) -> Vec<(u64, OutcomeKind, &'static str)> {
    outcomes
        .iter()
        .filter(|o| o.outcome == OutcomeKind::Failed || !o.mark().is_empty())
        .map(|o| (o.index, o.outcome, if o.mark().is_empty() { o.reason.name() } else { o.mark() }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hundred samples 1 to 100: the distance of one in ten lies between 84 and 96, whatever the distribution.
    #[test]
    fn a_family_outside_the_samples_interval_is_contradicted() {
        let samples: Vec<f64> = (1..=100).map(f64::from).collect();
        let contradicted = |best_m: f64| {
            let fitted =
                Sensitivity { best_m, interval_m: None, families_m: [best_m; 2], supported_m: [best_m; 2] };
            let empirical = exceedance::empirical_distance(&samples, 0.1, 0.95);
            let unconditional = empirical;
            let fitted = Some(fitted);
            Distance {
                probability: 0.1,
                empirical,
                fitted,
                beyond: None,
                unconditional,
                unconditional_m: None,
            }
            .is_contradicted()
        };
        assert_eq!([83.9, 84.0, 90.0, 96.0, 96.1].map(contradicted), [true, false, false, false, true]);
    }
}
