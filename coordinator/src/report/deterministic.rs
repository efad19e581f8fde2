//! The run with mean properties beside the samples: what a deterministic analysis would have said, and how many of the
//! random slopes run farther.

use super::families::FittedFamily;
use runout_core::campaign::Sample;
use runout_core::estimate::interval::{self, Interval};
use runout_core::outcome::{Outcome, OutcomeKind};

/// The deterministic run against the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Deterministic {
    /// Its runout, m.
    pub runout_m: f64,
    /// Whether the slope failed.
    pub failed: bool,
    /// Whether it still moved when its analysis ended.
    pub still_moving: bool,
    /// Samples beyond it.
    pub beyond: u64,
    /// Their share of the samples.
    pub share: f64,
    /// The interval of that share (Clopper-Pearson).
    pub share_interval: Option<Interval>,
    /// The share by the best family; absent without one.
    pub fitted_share: Option<f64>,
    /// The share of all realisations, stable ones included.
    pub share_of_all: f64,
}

/// Sets the outcome of the deterministic run beside the samples; none if its analysis failed or there is no sample.
pub fn beside(
    outcome: &Outcome,
    sample: &Sample,
    samples_m: &[f64],
    stable: u64,
    families: &[FittedFamily],
    confidence: f64,
) -> Option<Deterministic> {
    let runout_m = sample.measure.of(outcome.measures.as_ref()?);
    let beyond = samples_m.iter().filter(|sample| **sample > runout_m).count() as u64;
    let samples = samples_m.len() as u64;
    (samples > 0).then(|| Deterministic {
        runout_m,
        failed: outcome.outcome == OutcomeKind::Runout,
        still_moving: outcome.reason == runout_core::outcome::Reason::StillMoving,
        beyond,
        share: beyond as f64 / samples as f64,
        share_interval: interval::probability(beyond, samples, confidence),
        fitted_share: families.iter().find(|f| f.best).map(|f| f.exceedance(runout_m)),
        share_of_all: beyond as f64 / (samples + stable) as f64,
    })
}
