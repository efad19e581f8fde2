//! Where a running realisation stands, and how it is told to stop.

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
    pub(super) fn advance(&self, steps: u64, simulated_s: f64) {
        self.steps.store(steps, Ordering::Relaxed);
        self.simulated_s_bits.store(simulated_s.to_bits(), Ordering::Relaxed);
    }
}

/// The realisation was cancelled: there is no outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the realisation was cancelled")]
pub struct Cancelled;
