//! Which realisation goes to which worker: a synchronous state machine that is given `now` and says what to do.
//!
//! No async, lock, socket, file or clock here. `now` is the time since the coordinator's start. An index passes
//! through: never leased, leased (by one worker, or two if a straggler is repeated), given back (`open`), reported
//! but not yet durable (`storing`), recorded. Everything below [`Queue::prefix`] is recorded; leases are given out
//! at most a bounded look-ahead beyond it, so that stopping wastes little.

mod durations;
#[cfg(test)]
mod tests;
mod workers;

use durations::Durations;
use rand::Rng;
use runout_core::seed::{Purpose, stream};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
use thiserror::Error;
pub use workers::{Worker, WorkerId};

/// Settings of the queue. None moves an outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Campaign seed: it chooses the audited realisations.
    pub seed: u64,
    /// Share of realisations re-run on another worker.
    pub audit_fraction: f64,
    /// No index at or beyond this is leased.
    pub maximum_realisations: u64,
    /// Time between a worker's heartbeats.
    pub heartbeat: Duration,
    /// Heartbeats missed in a row that make a worker lost.
    pub missed_heartbeats: u32,
    /// Unexpected losses of one index that make it poison.
    pub losses_to_poison: u32,
    /// Leases beyond the prefix, as a multiple of all slots.
    pub look_ahead_per_slot: u64,
    /// A realisation that runs longer than this multiple of the 95th percentile may be repeated.
    pub straggler_factor: f64,
    /// A realisation whose step count has stood still for this long, or for `straggler_factor` times the 95th
    /// percentile if that is longer, hangs.
    pub shortest_hang: Duration,
}

impl Settings {
    /// The usual settings for a campaign.
    pub fn new(seed: u64, audit_fraction: f64, maximum_realisations: u64) -> Settings {
        Settings {
            seed,
            audit_fraction,
            maximum_realisations,
            heartbeat: Duration::from_secs(5),
            missed_heartbeats: 3,
            losses_to_poison: 3,
            look_ahead_per_slot: 4,
            straggler_factor: 2.0,
            // Laying out the points and drawing the fields takes seconds at most, also for large models.
            shortest_hang: Duration::from_secs(120),
        }
    }

    /// Time without a heartbeat after which a worker is lost.
    pub fn lost_after(&self) -> Duration {
        self.heartbeat * self.missed_heartbeats
    }
}

/// The right to run one realisation; the attempt number is the fencing token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lease {
    /// Realisation index.
    pub index: u64,
    /// Attempt, from 1.
    pub attempt: u32,
}

/// A lease that a worker says it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Which.
    pub lease: Lease,
    /// Time steps taken so far.
    pub steps: u64,
    /// Simulated time so far, s.
    pub simulated_s: f64,
    /// Whether only the report is outstanding.
    pub reporting: bool,
}

/// A lease given out, and how it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Running {
    /// Who holds it.
    pub worker: WorkerId,
    /// When it was given out.
    pub since: Duration,
    /// Time steps at the last heartbeat.
    pub steps: u64,
    /// Simulated time at the last heartbeat, s.
    pub simulated_s: f64,
    /// When the step count last changed.
    moved_at: Duration,
    /// Whether this re-runs a recorded index to compare digests.
    audit: bool,
}

/// The answer to a worker that asks for a lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeaseAnswer {
    /// Run this; persist the attempt before saying so.
    Assigned(Lease),
    /// Nothing to do now.
    Wait,
    /// The coordinator is stopping.
    Draining,
    /// The campaign is over, or the worker was set aside.
    Finished,
}

/// What a worker is told with its heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Go on.
    Continue,
    /// Finish what runs, take nothing new.
    Drain,
    /// Drop everything and leave.
    Stop,
}

/// What to do with a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportStep {
    /// Make it durable, then call [`Queue::stored`].
    Store,
    /// The same index is being made durable right now: the worker shall ask again.
    Busy,
    /// Recorded before with the same digest.
    Duplicate,
    /// As [`ReportStep::Duplicate`], and it completes an audit.
    AuditAgrees,
    /// Recorded before with another digest; the worker is set aside.
    Conflict,
    /// Of no use: the campaign has ended before it, it was given up, or it was never asked for.
    NotWanted,
}

/// What happened by itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// A worker was given up; its leases are open again.
    WorkerLost {
        /// Its name.
        name: String,
    },
    /// This index took several workers down: record it as poison, then call [`Queue::stored`].
    Poisoned {
        /// Which.
        index: u64,
    },
}

/// The worker is not known: it was given up, or the coordinator was restarted. It has to register again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("this worker is not registered (any more)")]
pub struct UnknownWorker;

/// Who recorded an index, and what.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Recorded {
    digest: String,
    worker: String,
    poison: bool,
}

/// What is known of an index from an earlier session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Attempts {
    /// Highest attempt number given out.
    pub attempt: u32,
    /// Unexpected losses.
    pub losses: u32,
}

/// The queue.
#[derive(Debug)]
pub struct Queue {
    settings: Settings,
    workers: workers::Workers,
    leases: BTreeMap<Lease, Running>,
    /// Everything at or beyond was never leased.
    next: u64,
    prefix: u64,
    open: BTreeSet<u64>,
    storing: BTreeSet<u64>,
    recorded: BTreeMap<u64, Recorded>,
    attempts: BTreeMap<u64, Attempts>,
    audits_due: BTreeSet<u64>,
    durations: Durations,
    draining: bool,
    finished: bool,
}

impl Queue {
    /// An empty queue. `session` makes worker ids of different coordinator processes differ.
    pub fn new(settings: Settings, session: u32) -> Queue {
        Queue {
            settings,
            workers: workers::Workers::new(session),
            leases: BTreeMap::new(),
            next: 0,
            prefix: 0,
            open: BTreeSet::new(),
            storing: BTreeSet::new(),
            recorded: BTreeMap::new(),
            attempts: BTreeMap::new(),
            audits_due: BTreeSet::new(),
            durations: Durations::default(),
            draining: false,
            finished: false,
        }
    }

    /// Takes over what an earlier session left: attempts given out, whether or not they ended.
    pub fn restore_attempts(&mut self, index: u64, attempts: Attempts) {
        if index >= self.settings.maximum_realisations {
            return;
        }
        self.open.extend((self.next..=index).filter(|i| !self.recorded.contains_key(i)));
        self.next = self.next.max(index + 1);
        self.attempts.insert(index, attempts);
    }

    /// Takes over an outcome that an earlier session recorded; `audited` if a second run has agreed.
    pub fn restore_recorded(&mut self, index: u64, digest: &str, worker: &str, poison: bool, audited: bool) {
        if index < self.settings.maximum_realisations {
            self.open.extend(self.next..index);
            self.next = self.next.max(index + 1);
        }
        self.record(index, digest, worker, poison);
        if audited {
            self.audits_due.remove(&index);
        }
    }

    /// Settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Every index below is recorded.
    pub fn prefix(&self) -> u64 {
        self.prefix
    }

    /// Workers, in the order of registration.
    pub fn workers(&self) -> impl Iterator<Item = (WorkerId, &Worker)> {
        self.workers.iter()
    }

    /// Leases given out, in index order.
    pub fn leases(&self) -> impl Iterator<Item = (Lease, &Running)> {
        self.leases.iter().map(|(lease, running)| (*lease, running))
    }

    /// What to persist with a lease of this index.
    pub fn attempts(&self, index: u64) -> Attempts {
        self.attempts.get(&index).copied().unwrap_or_default()
    }

    /// Indices chosen for an audit and recorded, but not yet compared.
    pub fn audits_due(&self) -> usize {
        self.audits_due.len()
    }

    /// Recent mean wall time of a realisation, s.
    pub fn mean_duration_s(&self) -> Option<f64> {
        self.durations.mean_s()
    }

    /// Registers a worker with the leases it still holds.
    pub fn register(&mut self, name: &str, slots: u32, held: &[Held], now: Duration) -> WorkerId {
        let id = self.workers.add(name, slots, now);
        for held in held {
            self.adopt(id, *held, now);
        }
        id
    }

    /// Gives out a lease, or says why not.
    ///
    /// # Errors
    /// The worker is not known.
    pub fn lease(&mut self, id: WorkerId, now: Duration) -> Result<LeaseAnswer, UnknownWorker> {
        let worker = self.workers.heard(id, now)?;
        if self.finished || worker.set_aside {
            worker.told = true;
            return Ok(LeaseAnswer::Finished);
        }
        if self.draining {
            worker.told = true;
            return Ok(LeaseAnswer::Draining);
        }
        let (name, slots) = (worker.name.clone(), worker.slots as usize);
        if self.leases.values().filter(|r| r.worker == id).count() >= slots {
            return Ok(LeaseAnswer::Wait);
        }
        let audit = self.audit_for(&name);
        let index = audit.or_else(|| self.open.pop_first()).or_else(|| self.fresh()).or_else(|| {
            // Near the end there is nothing new: an idle slot may repeat a straggler.
            self.straggler(id, now)
        });
        Ok(match index {
            None => LeaseAnswer::Wait,
            Some(index) => LeaseAnswer::Assigned(self.give(id, index, audit.is_some(), now)),
        })
    }

    /// Takes a heartbeat: `held` is every lease the worker holds. Returns the order, the leases to cancel and what
    /// happened.
    ///
    /// # Errors
    /// The worker is not known.
    pub fn heartbeat(
        &mut self,
        id: WorkerId,
        held: &[Held],
        now: Duration,
    ) -> Result<(Order, Vec<Lease>, Vec<Event>), UnknownWorker> {
        let worker = self.workers.heard(id, now)?;
        let order = match (self.finished || worker.set_aside, self.draining) {
            (true, _) => Order::Stop,
            (false, true) => Order::Drain,
            (false, false) => Order::Continue,
        };
        worker.told |= order != Order::Continue;
        let mut cancel = Vec::new();
        let mut events = Vec::new();
        for held in held {
            if !self.progress(id, *held, now, &mut events) {
                cancel.push(held.lease);
            }
        }
        self.take_back_unknown_to_worker(id, held, now);
        Ok((order, cancel, events))
    }

    /// Takes a report.
    ///
    /// # Errors
    /// The worker is not known.
    pub fn report(
        &mut self,
        id: WorkerId,
        lease: Lease,
        digest: &str,
        now: Duration,
    ) -> Result<ReportStep, UnknownWorker> {
        let reporter = self.workers.heard(id, now)?;
        let (name, set_aside) = (reporter.name.clone(), reporter.set_aside);
        let index = lease.index;
        if self.leases.get(&lease).is_some_and(|running| running.worker == id) {
            self.leases.remove(&lease);
        }
        if let Some(recorded) = self.recorded.get(&index) {
            if recorded.poison {
                return Ok(ReportStep::NotWanted);
            }
            if recorded.digest != digest {
                self.workers.set_aside(id);
                self.audits_due.remove(&index);
                self.give_back_all(id);
                return Ok(ReportStep::Conflict);
            }
            let audits = recorded.worker != name && self.audits_due.remove(&index);
            return Ok(if audits { ReportStep::AuditAgrees } else { ReportStep::Duplicate });
        }
        if self.storing.contains(&index) {
            return Ok(ReportStep::Busy);
        }
        if self.finished || set_aside || index >= self.next {
            self.reopen(index);
            return Ok(ReportStep::NotWanted);
        }
        self.open.remove(&index);
        self.storing.insert(index);
        Ok(ReportStep::Store)
    }

    /// An index is durable now.
    pub fn stored(&mut self, index: u64, digest: &str, worker: &str, wall_s: f64, poison: bool) {
        self.storing.remove(&index);
        if !poison {
            self.durations.push(wall_s);
            self.workers.count_done(worker);
        }
        self.record(index, digest, worker, poison);
    }

    /// Takes leases back in an orderly way; `broken` if the computation broke, which counts as a loss.
    ///
    /// # Errors
    /// The worker is not known.
    pub fn release(
        &mut self,
        id: WorkerId,
        leases: &[Lease],
        broken: bool,
        leaving: bool,
        now: Duration,
    ) -> Result<Vec<Event>, UnknownWorker> {
        self.workers.heard(id, now)?;
        let mut events = Vec::new();
        for lease in leases {
            if self.leases.get(lease).is_some_and(|running| running.worker == id) {
                if broken {
                    self.lose(*lease, &mut events);
                } else {
                    self.leases.remove(lease);
                    self.reopen(lease.index);
                }
            }
        }
        if leaving {
            self.give_back_all(id);
            self.workers.remove(id);
        }
        Ok(events)
    }

    /// Gives up the workers of this name (their process is known to be dead); an unexpected loss of their leases.
    pub fn worker_died(&mut self, name: &str) -> Vec<Event> {
        let dead: Vec<WorkerId> = self.workers().filter(|(_, w)| w.name == name).map(|(id, _)| id).collect();
        let mut events = Vec::new();
        for id in dead {
            self.lose_worker(id, &mut events);
        }
        events
    }

    /// Gives up workers whose heartbeats are missing.
    pub fn tick(&mut self, now: Duration) -> Vec<Event> {
        let limit = self.settings.lost_after();
        let silent: Vec<WorkerId> =
            self.workers().filter(|(_, w)| now.saturating_sub(w.heard) > limit).map(|(id, _)| id).collect();
        let mut events = Vec::new();
        for id in silent {
            self.lose_worker(id, &mut events);
        }
        events
    }

    /// No more leases; what runs may be reported.
    pub fn drain(&mut self) {
        self.draining = true;
    }

    /// Whether leases are given out no more because the coordinator stops.
    pub fn is_draining(&self) -> bool {
        self.draining
    }

    /// The campaign is over: workers are told to leave.
    pub fn finish(&mut self) {
        self.finished = true;
        self.open.clear();
    }

    /// Whether every worker has been told that it is over, or that the coordinator stops.
    pub fn everyone_told(&self) -> bool {
        self.workers.iter().all(|(_, worker)| worker.told)
    }
}

impl Queue {
    fn record(&mut self, index: u64, digest: &str, worker: &str, poison: bool) {
        let recorded = Recorded { digest: digest.to_owned(), worker: worker.to_owned(), poison };
        self.open.remove(&index);
        self.recorded.insert(index, recorded);
        if !poison && self.is_audited(index) {
            self.audits_due.insert(index);
        }
        while self.recorded.contains_key(&self.prefix) {
            self.prefix += 1;
        }
    }

    /// Whether the seed chooses this index for an audit.
    fn is_audited(&self, index: u64) -> bool {
        // 53 random bits make a double in [0, 1).
        let draw = stream(self.settings.seed, index, Purpose::Audit).next_u64() >> 11;
        (draw as f64) < self.settings.audit_fraction * (1_u64 << 53) as f64
    }

    fn audit_for(&self, worker: &str) -> Option<u64> {
        let running = |index| self.leases.range(attempts_of(index)).next().is_some();
        self.audits_due.iter().copied().find(|i| self.recorded[i].worker != worker && !running(*i))
    }

    fn fresh(&mut self) -> Option<u64> {
        let look_ahead = self.settings.look_ahead_per_slot.saturating_mul(self.workers.slots());
        let limit = self.prefix.saturating_add(look_ahead).min(self.settings.maximum_realisations);
        let index = self.next;
        if index >= limit {
            return None;
        }
        self.next += 1;
        Some(index)
    }

    fn straggler(&self, id: WorkerId, now: Duration) -> Option<u64> {
        let limit = self.durations.percentile_95()?.mul_f64(self.settings.straggler_factor);
        let late = self.leases.iter().find(|(lease, running)| {
            !running.audit
                && running.worker != id
                && now.saturating_sub(running.since) > limit
                && self.is_wanted(lease.index)
                && self.leases.range(attempts_of(lease.index)).count() == 1
        });
        late.map(|(lease, _)| lease.index)
    }

    fn give(&mut self, worker: WorkerId, index: u64, audit: bool, now: Duration) -> Lease {
        let attempts = self.attempts.entry(index).or_default();
        attempts.attempt += 1;
        let lease = Lease { index, attempt: attempts.attempt };
        let running = Running { worker, since: now, steps: 0, simulated_s: 0.0, moved_at: now, audit };
        self.leases.insert(lease, running);
        lease
    }

    /// Whether an outcome of this index is still to be recorded.
    fn is_wanted(&self, index: u64) -> bool {
        !self.recorded.contains_key(&index) && !self.storing.contains(&index)
    }

    /// Opens an index again unless it is done or somebody else runs it.
    fn reopen(&mut self, index: u64) {
        let leased = self.leases.range(attempts_of(index)).next().is_some();
        if !self.finished && index < self.next && !leased && self.is_wanted(index) {
            self.open.insert(index);
        }
    }

    /// Notes the progress of a lease; false if the worker shall cancel it.
    fn progress(&mut self, id: WorkerId, held: Held, now: Duration, events: &mut Vec<Event>) -> bool {
        let hang = self.hang_limit();
        let Some(running) = self.leases.get_mut(&held.lease).filter(|r| r.worker == id) else {
            return held.reporting || self.adopt(id, held, now);
        };
        if running.steps != held.steps || held.reporting {
            running.moved_at = now;
        }
        (running.steps, running.simulated_s) = (held.steps, held.simulated_s);
        if now.saturating_sub(running.moved_at) > hang {
            self.lose(held.lease, events);
            return false;
        }
        // A repeated straggler that the other worker has finished is of no more use; an audit is.
        let audit = self.leases[&held.lease].audit;
        if !audit && !held.reporting && !self.is_wanted(held.lease.index) {
            self.leases.remove(&held.lease);
            return false;
        }
        true
    }

    fn hang_limit(&self) -> Duration {
        let usual =
            self.durations.percentile_95().unwrap_or_default().mul_f64(self.settings.straggler_factor);
        usual.max(self.settings.shortest_hang)
    }

    /// A worker says it holds a lease that this session has not given it (the coordinator was restarted, or had
    /// given the worker up): it may go on if nobody else has it. False if not.
    fn adopt(&mut self, id: WorkerId, held: Held, now: Duration) -> bool {
        let Held { lease, steps, simulated_s, .. } = held;
        if self.finished || !self.open.remove(&lease.index) {
            return false;
        }
        let attempts = self.attempts.entry(lease.index).or_default();
        attempts.attempt = attempts.attempt.max(lease.attempt);
        let running = Running { worker: id, since: now, steps, simulated_s, moved_at: now, audit: false };
        self.leases.insert(lease, running);
        true
    }

    /// Takes back leases whose answer never reached the worker: it has sent two heartbeats without them.
    fn take_back_unknown_to_worker(&mut self, id: WorkerId, held: &[Held], now: Duration) {
        let patience = self.settings.heartbeat * 2;
        let unknown: Vec<Lease> = self
            .leases
            .iter()
            .filter(|(lease, running)| {
                running.worker == id
                    && now.saturating_sub(running.since) > patience
                    && !held.iter().any(|h| h.lease == **lease)
            })
            .map(|(lease, _)| *lease)
            .collect();
        for lease in unknown {
            self.leases.remove(&lease);
            self.reopen(lease.index);
        }
    }

    fn give_back_all(&mut self, id: WorkerId) {
        let held: Vec<Lease> = self.leases_of(id);
        for lease in held {
            self.leases.remove(&lease);
            self.reopen(lease.index);
        }
    }

    fn leases_of(&self, id: WorkerId) -> Vec<Lease> {
        self.leases.iter().filter(|(_, running)| running.worker == id).map(|(lease, _)| *lease).collect()
    }

    fn lose_worker(&mut self, id: WorkerId, events: &mut Vec<Event>) {
        if let Some(worker) = self.workers.remove(id) {
            events.push(Event::WorkerLost { name: worker.name });
        }
        for lease in self.leases_of(id) {
            self.lose(lease, events);
        }
    }

    /// An unexpected loss: counted against the index, which is given up as poison at the limit.
    fn lose(&mut self, lease: Lease, events: &mut Vec<Event>) {
        self.leases.remove(&lease);
        let index = lease.index;
        if self.finished || !self.is_wanted(index) {
            return;
        }
        let attempts = self.attempts.entry(index).or_default();
        attempts.losses += 1;
        let leased = self.leases.range(attempts_of(index)).next().is_some();
        if attempts.losses >= self.settings.losses_to_poison && !leased {
            self.storing.insert(index);
            events.push(Event::Poisoned { index });
        } else {
            self.reopen(index);
        }
    }
}

/// All leases of an index.
fn attempts_of(index: u64) -> std::ops::RangeInclusive<Lease> {
    Lease { index, attempt: 0 }..=Lease { index, attempt: u32::MAX }
}
