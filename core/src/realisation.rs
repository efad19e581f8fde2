//! The whole way from (spec, index) to an outcome.

use crate::gimp::Kernel;
use crate::outcome::Outcome;
use crate::spec::Spec;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use thiserror::Error;

/// Where a running realisation stands; written by the time loop, read by other threads (heartbeat, progress bar).
#[derive(Debug, Default)]
pub struct Progress {
    steps: AtomicU64,
    simulated_s_bits: AtomicU64,
    cancel: AtomicBool,
}

impl Progress {
    /// Time steps taken so far, gravity stage included.
    pub fn steps(&self) -> u64 {
        self.steps.load(Ordering::Relaxed)
    }

    /// Simulated time of the failure stage so far, s.
    pub fn simulated_s(&self) -> f64 {
        f64::from_bits(self.simulated_s_bits.load(Ordering::Relaxed))
    }

    /// Asks the time loop to stop soon; the realisation then ends as [`Cancelled`].
    pub fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }

    /// Whether a stop was asked for.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// Called by the time loop.
    pub(crate) fn advance(&self, steps: u64, simulated_s: f64) {
        self.steps.store(steps, Ordering::Relaxed);
        self.simulated_s_bits.store(simulated_s.to_bits(), Ordering::Relaxed);
    }
}

/// The realisation was cancelled: there is no outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the realisation was cancelled")]
pub struct Cancelled;

/// A spec that cannot be prepared for realisations.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PrepareError {
    /// The model needs more material points than the limit.
    #[error("the slope needs {points} material points; at most {limit} are supported")]
    TooLarge {
        /// Points needed.
        points: u64,
        /// Limit.
        limit: u64,
    },
    /// The geometry holds no material point.
    #[error("the slope holds no material point")]
    Empty,
}

/// Everything that is the same in every realisation of a spec, computed once and shared by threads.
#[derive(Debug)]
pub struct Prepared {
    spec: Spec,
    kernel: Kernel,
}

impl Prepared {
    /// Prepares a spec.
    ///
    /// # Errors
    /// A geometry without points or with too many.
    pub fn new(spec: Spec, kernel: Kernel) -> Result<Prepared, PrepareError> {
        Ok(Prepared { spec, kernel })
    }

    /// The spec.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// Number of material points.
    pub fn points(&self) -> usize {
        todo!("the solver branch")
    }

    /// Runs realisation `index` from its random field to rest.
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` was asked to stop.
    pub fn realise(&self, index: u64, progress: &Progress) -> Result<Outcome, Cancelled> {
        let _ = (self.kernel, index);
        progress.advance(0, 0.0);
        todo!("the solver branch")
    }
}
