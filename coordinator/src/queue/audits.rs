//! Which realisations are run again, and by whom.
//!
//! The seed chooses some; contested ones and those of workers set aside come in addition (see `disputes`). The second
//! run goes to another worker; a worker that is alone runs its own again, which still finds what is not reproducible on one
//! machine (faulty memory, a race). Audits that are due when the campaign ends are run then, within a limit.

use super::Queue;
use rand::Rng;
use runout_core::seed::{Purpose, stream};
use std::time::Duration;

/// Whether `seed` chooses `index` for an audit, of which `fraction` are chosen.
pub fn is_audited(seed: u64, fraction: f64, index: u64) -> bool {
    // 53 random bits make a double in [0, 1).
    let draw = stream(seed, index, Purpose::Audit).next_u64() >> 11;
    (draw as f64) < fraction * (1_u64 << 53) as f64
}

impl Queue {
    /// An audit for the worker of this name.
    pub(super) fn audit_for(&self, worker: &str) -> Option<u64> {
        let alone = self.workers().all(|(_, w)| w.name == worker || w.set_aside);
        let running = |index| self.leases.count_of(index) > 0;
        // Who alone contradicts others, or was set aside, cannot decide.
        let other = |index| match self.disputes.get(&index) {
            Some(opinions) => opinions.iter().all(|o| o.worker != worker),
            None => alone || self.recorded[&index].worker != worker,
        };
        let fits = |index: &u64| other(*index) && !running(*index);
        self.audits_due.iter().copied().find(fits)
    }

    /// Whether nothing is wanted any more, audits included.
    pub(super) fn is_over(&self) -> bool {
        self.finished && (self.closed || (self.audits_due.is_empty() && self.weighing.is_empty()))
    }

    /// Once the campaign is over: how long the audits that are due may take; absent if there is nothing to wait for.
    pub fn audit_limit(&self) -> Option<Duration> {
        let slots: u64 = self.workers().filter(|(_, w)| !w.set_aside).map(|(_, w)| u64::from(w.slots)).sum();
        // A worker that could decide what is contested may still connect; one that only repeats is not waited for.
        if !self.finished || self.is_over() || (slots == 0 && self.contested() == 0) {
            return None;
        }
        let rounds = (self.audits_due.len() as u64).div_ceil(slots.max(1)) as f64;
        let mean = || self.mean_duration_s().and_then(|s| Duration::try_from_secs_f64(s).ok());
        let usual = self.durations.percentile_95().or_else(mean)?;
        // A worker hears of the end with its next heartbeat, and what it runs then ends soon after.
        Some(self.settings.lost_after() + usual.mul_f64(self.settings.straggler_factor * rounds))
    }
}
