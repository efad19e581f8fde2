//! A fold as numbers: what [`Estimator`] remembers beside its samples, so that a long campaign's estimates can be taken
//! up where they were left without its outcomes.

use super::moments::Moments;
use super::rule::{self, RuleState};
use super::{Decision, Estimator};
use crate::campaign::{Run, Sample, Stop};
use serde::{Deserialize, Serialize};

/// The state of a fold without its samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    next_index: u64,
    realisations: u64,
    stable: u64,
    failed: u64,
    still_moving: u64,
    energy_drifted: u64,
    moments: Moments,
    hits: Vec<u64>,
    state: RuleState,
    decision: Decision,
}

impl Estimator {
    /// What the fold remembers beside [`Estimator::samples_m`].
    pub fn save(&self) -> Saved {
        Saved {
            next_index: self.next_index,
            realisations: self.realisations,
            stable: self.stable,
            failed: self.failed,
            still_moving: self.still_moving,
            energy_drifted: self.energy_drifted,
            moments: self.moments,
            hits: self.hits.clone(),
            state: self.state.clone(),
            decision: self.decision,
        }
    }

    /// Takes up a fold that was saved under the same settings, with its samples. Every further outcome and estimate is
    /// the same to the bit as without the break; only [`Estimator::history`] begins anew. Absent if the numbers do not
    /// belong together.
    pub fn restore(
        stop: &Stop,
        sample: &Sample,
        run: &Run,
        saved: Saved,
        samples_m: Vec<f64>,
    ) -> Option<Estimator> {
        let samples = samples_m.len() as u64;
        let adds_up = samples.checked_add(saved.stable)?.checked_add(saved.failed)? == saved.realisations
            && saved.moments.count() == samples
            && saved.hits.len() == rule::targets(&stop.rule).len()
            && saved.next_index >= saved.realisations;
        adds_up.then(|| Estimator {
            next_index: saved.next_index,
            realisations: saved.realisations,
            stable: saved.stable,
            failed: saved.failed,
            still_moving: saved.still_moving,
            energy_drifted: saved.energy_drifted,
            samples_m,
            moments: saved.moments,
            hits: saved.hits,
            state: saved.state,
            decision: saved.decision,
            ..Estimator::new(stop, sample, run)
        })
    }
}
