//! What the coordinator knows at one moment, read once for everybody who looks.

use crate::logs;
use crate::seen::Seen;
use crate::shared::Shared;
use crate::status::{self, State, Status};
use runout_core::estimate::interval::{self, Interval};
use runout_core::estimate::moments::Moments;
use runout_proto::logging::Line;
use std::sync::Arc;
use std::time::Duration;

/// Points of a curve: more are not seen on a page.
const CURVE_POINTS: usize = 96;
/// The longest slides are points of the exceedance curve each: there the curve is read.
const TAIL_POINTS: usize = 24;

/// A point of the exceedance curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ExceedancePoint {
    /// Distance, m.
    pub(super) distance_m: f64,
    /// Share of the samples beyond it.
    pub(super) conditional: f64,
    /// Interval of that share.
    pub(super) interval: Interval,
    /// Share of samples and stable realisations beyond it.
    pub(super) unconditional: f64,
}

/// The mean after some samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeanPoint {
    /// Samples.
    pub(super) samples: u64,
    /// Their mean, m.
    pub(super) mean_m: f64,
    /// Its interval, m; absent for one sample.
    pub(super) interval_m: Option<Interval>,
}

/// What follows from the samples alone, and changes only with them.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Curves {
    /// Exceedance curve, by rising distance.
    pub(super) exceedance: Vec<ExceedancePoint>,
    /// The mean in the order of the indices.
    pub(super) mean: Vec<MeanPoint>,
}

/// What the coordinator knows at one moment.
#[derive(Debug, Clone)]
pub(super) struct Snapshot {
    /// Where the campaign stands.
    pub(super) status: Status,
    /// What was seen.
    pub(super) seen: Seen,
    /// Curves of the samples.
    pub(super) curves: Arc<Curves>,
    /// Leases given out.
    pub(super) leases: usize,
    /// The latest log lines, the last one first.
    pub(super) lines: Vec<Line>,
    /// Time since the coordinator started.
    pub(super) up: Duration,
}

impl Snapshot {
    /// Reads everything now; `before` spares what has not changed since. `ended` is the state at the end of serving.
    pub(super) fn of(shared: &Shared, before: Option<&Snapshot>, ended: Option<State>) -> Snapshot {
        let (mut status, samples_m, leases) = {
            let engine = shared.engine();
            let status = status::of_engine(&shared.campaign, &shared.digest, &engine, shared.now());
            let known = before.is_some_and(|b| same_samples(&b.status, &status));
            let samples_m = (!known).then(|| engine.estimator().samples_m().to_vec());
            (status, samples_m, engine.queue().leases().count())
        };
        if let Some(state) = ended {
            status.state = state;
        }
        let curves = match (samples_m, before) {
            (None, Some(before)) => Arc::clone(&before.curves),
            (samples_m, _) => Arc::new(curves(&samples_m.unwrap_or_default(), &status)),
        };
        let seen = shared.seen().clone();
        Snapshot { status, seen, curves, leases, lines: logs::recent(), up: shared.now() }
    }
}

fn same_samples(a: &Status, b: &Status) -> bool {
    (a.samples, a.stable) == (b.samples, b.stable)
}

fn curves(samples_m: &[f64], status: &Status) -> Curves {
    let confidence = status.confidence;
    Curves { exceedance: exceedance(samples_m, status.stable, confidence), mean: mean(samples_m, confidence) }
}

/// The exceedance curve at evenly spaced ranks and at each of the longest slides.
fn exceedance(samples_m: &[f64], stable: u64, confidence: f64) -> Vec<ExceedancePoint> {
    let mut sorted = samples_m.to_vec();
    sorted.sort_by(f64::total_cmp);
    let samples = sorted.len();
    let every = samples.div_ceil(CURVE_POINTS).max(1);
    let shown = |place: &usize| place.is_multiple_of(every) || place + TAIL_POINTS >= samples;
    let mut points: Vec<ExceedancePoint> = Vec::new();
    for place in (0..samples).filter(shown) {
        let distance_m = sorted[place];
        if points.last().is_some_and(|last| last.distance_m == distance_m) {
            continue;
        }
        let beyond = samples - sorted.partition_point(|sample| *sample <= distance_m);
        let (beyond, samples) = (beyond as u64, samples as u64);
        if let Some(interval) = interval::probability(beyond, samples, confidence) {
            points.push(ExceedancePoint {
                distance_m,
                conditional: beyond as f64 / samples as f64,
                interval,
                unconditional: beyond as f64 / (samples + stable) as f64,
            });
        }
    }
    points
}

fn mean(samples_m: &[f64], confidence: f64) -> Vec<MeanPoint> {
    let every = samples_m.len().div_ceil(CURVE_POINTS).max(1);
    let mut moments = Moments::default();
    let mut points = Vec::new();
    for (place, &sample) in samples_m.iter().enumerate() {
        moments.push(sample);
        if (place + 1).is_multiple_of(every) || place + 1 == samples_m.len() {
            let interval_m = interval::mean(&moments, confidence);
            points.extend(moments.mean().map(|mean_m| MeanPoint {
                samples: moments.count(),
                mean_m,
                interval_m,
            }));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use runout_core::estimate::exceedance;

    #[test]
    fn few_samples_give_the_curve_of_the_results() {
        let samples = [3.0, 1.0, 2.0, 2.0, 7.5];
        let ours = super::exceedance(&samples, 3, 0.9);
        let theirs = exceedance::curve(&samples, 3, 0.9);
        assert_eq!(ours.len(), theirs.len());
        for (a, b) in ours.iter().zip(&theirs) {
            assert_eq!((a.distance_m, a.conditional), (b.distance_m, b.conditional));
            assert_eq!((a.interval, a.unconditional), (b.conditional_interval, b.unconditional));
        }
    }

    #[test]
    fn many_samples_give_a_bounded_part_of_it_with_all_of_its_tail() {
        let samples: Vec<f64> = (0..10_000).map(|k| f64::from((k * 7919) % 10_007)).collect();
        let ours = super::exceedance(&samples, 0, 0.95);
        assert!(ours.len() <= CURVE_POINTS + TAIL_POINTS, "{}", ours.len());
        let theirs = exceedance::curve(&samples, 0, 0.95);
        let tail = |n: usize| theirs[theirs.len() - n..].iter().map(|p| p.distance_m).collect::<Vec<_>>();
        let last: Vec<f64> = ours[ours.len() - TAIL_POINTS..].iter().map(|p| p.distance_m).collect();
        assert_eq!(last, tail(TAIL_POINTS));
        assert!(
            ours.iter().all(|p| theirs
                .iter()
                .any(|t| t.distance_m == p.distance_m && t.conditional == p.conditional))
        );
        assert!(mean(&samples, 0.95).len() <= CURVE_POINTS + 1);
    }
}
