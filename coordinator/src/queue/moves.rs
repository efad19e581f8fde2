//! How leases and indices move between the states of the queue.

use super::{Done, Event, Held, Lease, Queue, Recorded, Running, WorkerId, is_audited};
use std::time::Duration;

impl Queue {
    pub(super) fn record(&mut self, done: Done<'_>) {
        let Done { index, digest, worker, attempt, wall_s, poison } = done;
        let (digest, worker) = (digest.to_owned(), worker.to_owned());
        self.open.remove(&index);
        self.reserved.forget(index);
        self.recorded.insert(index, Recorded { digest, worker, attempt, poison });
        if !poison {
            self.durations.push(wall_s);
            if is_audited(self.settings.seed, self.settings.audit_fraction, index) {
                self.audits_due.insert(index);
            }
        }
        while self.recorded.contains_key(&self.prefix) {
            self.prefix += 1;
        }
    }

    /// What was never leased is leased below this only, for now.
    pub(super) fn fresh_limit(&self) -> u64 {
        let look_ahead = self.settings.look_ahead_per_slot.saturating_mul(self.workers.slots());
        self.prefix.saturating_add(look_ahead).min(self.settings.maximum_realisations)
    }

    pub(super) fn fresh(&mut self) -> Option<u64> {
        let index = self.next;
        if index >= self.fresh_limit() {
            return None;
        }
        self.next += 1;
        Some(index)
    }

    pub(super) fn straggler(&self, id: WorkerId, now: Duration) -> Option<u64> {
        let limit = self.durations.percentile_95()?.mul_f64(self.settings.straggler_factor);
        let late = self.leases.iter().find(|(lease, running)| {
            !running.audit
                && running.worker != id
                && now.saturating_sub(running.since) > limit
                && self.is_wanted(lease.index)
                && self.leases.count_of(lease.index) == 1
                // Else an index that takes its workers down would always be running somewhere, and never be poison.
                && self.attempts(lease.index).losses < self.settings.losses_to_poison
        });
        late.map(|(lease, _)| lease.index)
    }

    pub(super) fn give(&mut self, worker: WorkerId, index: u64, audit: bool, now: Duration) -> Lease {
        let attempts = self.attempts.entry(index).or_default();
        attempts.attempt += 1;
        let lease = Lease { index, attempt: attempts.attempt };
        let running = Running { worker, since: now, steps: 0, simulated_s: 0.0, moved_at: now, audit };
        self.leases.insert(lease, running);
        lease
    }

    /// Whether an outcome of this index is still to be recorded.
    pub(super) fn is_wanted(&self, index: u64) -> bool {
        !self.finished && !self.recorded.contains_key(&index) && !self.storing.contains(&index)
    }

    /// Opens an index again unless it is done or somebody else runs it.
    pub(super) fn reopen(&mut self, index: u64) {
        let leased = self.leases.count_of(index) > 0;
        if index < self.next && !leased && self.is_wanted(index) {
            self.open.insert(index);
        }
    }

    /// Notes the progress of a lease; false if the worker shall cancel it.
    pub(super) fn progress(
        &mut self,
        id: WorkerId,
        held: Held,
        now: Duration,
        events: &mut Vec<Event>,
    ) -> bool {
        let hang = self.hang_limit();
        let Some(running) = self.leases.held_mut(id, held.lease) else {
            return held.reporting || self.adopt(id, held, now);
        };
        if running.steps != held.steps || held.reporting {
            running.moved_at = now;
        }
        (running.steps, running.simulated_s) = (held.steps, held.simulated_s);
        let audit = running.audit;
        if now.saturating_sub(running.moved_at) > hang {
            self.hung.insert(held.lease);
            events.push(Event::Hung { index: held.lease.index });
            self.lose(held.lease, events);
            return false;
        }
        // A repeated straggler that the other worker has finished is of no more use; an audit is.
        if !audit && !held.reporting && !self.is_wanted(held.lease.index) {
            self.leases.remove(held.lease);
            return false;
        }
        true
    }

    pub(super) fn hang_limit(&self) -> Duration {
        let usual =
            self.durations.percentile_95().unwrap_or_default().mul_f64(self.settings.straggler_factor);
        usual.max(self.settings.shortest_hang)
    }

    /// A worker says it holds a lease that this session has not given it (the coordinator was restarted, or had
    /// given the worker up): it may go on if nobody else has it. False if not.
    pub(super) fn adopt(&mut self, id: WorkerId, held: Held, now: Duration) -> bool {
        let Held { lease, steps, simulated_s, .. } = held;
        if self.finished || self.hung.contains(&lease) || !self.open.remove(&lease.index) {
            return false;
        }
        let attempts = self.attempts.entry(lease.index).or_default();
        attempts.attempt = attempts.attempt.max(lease.attempt);
        let running = Running { worker: id, since: now, steps, simulated_s, moved_at: now, audit: false };
        self.leases.insert(lease, running);
        true
    }

    /// Takes back leases whose answer never reached the worker: it has sent two heartbeats without them.
    pub(super) fn take_back_unknown_to_worker(&mut self, id: WorkerId, held: &[Held], now: Duration) {
        let patience = self.settings.heartbeat * 2;
        let unknown: Vec<Lease> = self
            .leases
            .of_worker(id)
            .filter(|lease| {
                let since = self.leases.held(id, *lease).map_or(now, |running| running.since);
                now.saturating_sub(since) > patience && !held.iter().any(|h| h.lease == *lease)
            })
            .collect();
        for lease in unknown {
            self.leases.remove(lease);
            self.reopen(lease.index);
        }
    }

    pub(super) fn give_back_all(&mut self, id: WorkerId) {
        for lease in self.leases_of(id) {
            self.leases.remove(lease);
            self.reopen(lease.index);
        }
    }

    pub(super) fn leases_of(&self, id: WorkerId) -> Vec<Lease> {
        self.leases.of_worker(id).collect()
    }

    pub(super) fn lose_worker(&mut self, id: WorkerId, events: &mut Vec<Event>) {
        if let Some(worker) = self.workers.remove(id) {
            events.push(Event::WorkerLost { name: worker.name });
        }
        for lease in self.leases_of(id) {
            self.lose(lease, events);
        }
    }

    /// An unexpected loss: counted against the index, which is given up as poison at the limit.
    pub(super) fn lose(&mut self, lease: Lease, events: &mut Vec<Event>) {
        self.leases.remove(lease);
        let index = lease.index;
        if !self.is_wanted(index) {
            return;
        }
        let attempts = self.attempts.entry(index).or_default();
        attempts.losses += 1;
        let leased = self.leases.count_of(index) > 0;
        if attempts.losses >= self.settings.losses_to_poison && !leased {
            self.storing.insert(index);
            events.push(Event::Poisoned { index });
        } else {
            self.reopen(index);
        }
    }
}
