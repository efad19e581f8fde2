//! Which realisation goes to which worker: a synchronous state machine that is given `now` and says what to do.
//!
//! No async, lock, socket, file or clock here. `now` is the time since the coordinator's start. An index passes
//! through: never leased, leased (by one worker, or two if a straggler is repeated), given back (`open`), reported
//! but not yet durable (`storing`), recorded. Everything below [`Queue::prefix`] is recorded; leases are given out
//! at most a bounded look-ahead beyond it, so that stopping wastes little.

mod audits;
mod disputes;
mod durations;
mod leases;
mod moves;
mod reserve;
#[cfg(test)]
mod tests;
mod types;
mod workers;

use crate::rulings::{Disputes, Rulings};
pub use audits::is_audited;
use durations::Durations;
use leases::Leases;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
pub use types::{
    Attempts, Done, Event, Held, Lease, LeaseAnswer, Order, ReportStep, Running, Settings, UnknownWorker,
};
pub use workers::{Worker, WorkerId};

/// Who recorded an index, and what.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Recorded {
    digest: String,
    worker: String,
    attempt: u32,
    poison: bool,
}

/// The queue.
#[derive(Debug)]
pub struct Queue {
    settings: Settings,
    workers: workers::Workers,
    leases: Leases,
    /// Everything at or beyond was never leased.
    next: u64,
    prefix: u64,
    open: BTreeSet<u64>,
    storing: BTreeSet<u64>,
    recorded: BTreeMap<u64, Recorded>,
    attempts: BTreeMap<u64, Attempts>,
    reserved: reserve::Reserved,
    audits_due: BTreeSet<u64>,
    /// Who has agreed with a recorded outcome.
    auditors: BTreeMap<u64, Vec<String>>,
    disputes: Disputes,
    rulings: Rulings,
    /// Second opinions that are being made durable: index and worker.
    weighing: BTreeSet<(u64, String)>,
    /// Leases taken back because they hang: their workers cannot have them again.
    hung: BTreeSet<Lease>,
    durations: Durations,
    draining: bool,
    /// No realisation is wanted any more; audits may be.
    finished: bool,
    /// Results are below this; everything may be one before [`Queue::finish`].
    end: u64,
    /// Nor are audits.
    closed: bool,
}

impl Queue {
    /// An empty queue. `session` makes worker ids of different coordinator processes differ.
    pub fn new(settings: Settings, session: u32) -> Queue {
        Queue {
            settings,
            workers: workers::Workers::new(session),
            leases: Leases::default(),
            next: 0,
            prefix: 0,
            open: BTreeSet::new(),
            storing: BTreeSet::new(),
            recorded: BTreeMap::new(),
            attempts: BTreeMap::new(),
            reserved: reserve::Reserved::default(),
            audits_due: BTreeSet::new(),
            auditors: BTreeMap::new(),
            disputes: Disputes::new(),
            rulings: Rulings::default(),
            weighing: BTreeSet::new(),
            hung: BTreeSet::new(),
            durations: Durations::default(),
            draining: false,
            finished: false,
            end: u64::MAX,
            closed: false,
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
    pub fn restore_recorded(&mut self, done: Done<'_>, audited: bool) {
        let index = done.index;
        if index < self.settings.maximum_realisations {
            self.open.extend(self.next..index);
            self.next = self.next.max(index + 1);
        }
        self.record(done);
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

    /// A worker by its id.
    pub fn worker(&self, id: WorkerId) -> Option<&Worker> {
        self.workers.get(id)
    }

    /// Digest of the outcome of this index that counts.
    pub fn digest(&self, index: u64) -> Option<&str> {
        self.recorded.get(&index).map(|recorded| recorded.digest.as_str())
    }

    /// Leases given out, in index order.
    pub fn leases(&self) -> impl Iterator<Item = (Lease, &Running)> {
        self.leases.iter()
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
        let set_aside = self.is_set_aside(name);
        let id = self.workers.add(name, slots, set_aside, now);
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
        let over = self.is_over();
        let worker = self.workers.heard(id, now)?;
        if over || worker.set_aside {
            worker.told = true;
            return Ok(LeaseAnswer::Finished);
        }
        if self.draining {
            worker.told = true;
            return Ok(LeaseAnswer::Draining);
        }
        let (name, slots) = (worker.name.clone(), worker.slots as usize);
        if self.leases.of_worker(id).count() >= slots {
            return Ok(LeaseAnswer::Wait);
        }
        let audit = self.audit_for(&name);
        if self.finished && audit.is_none() {
            return Ok(LeaseAnswer::Wait);
        }
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
        let over = self.is_over();
        let worker = self.workers.heard(id, now)?;
        let order = match (over || worker.set_aside, self.draining) {
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
        let held = self.leases.held(id, lease);
        let audit = held.is_some_and(|running| running.audit);
        if held.is_some() {
            self.leases.remove(lease);
        }
        if self.recorded.contains_key(&index) {
            return Ok(if set_aside {
                ReportStep::NotWanted
            } else {
                self.second_opinion(name, lease, digest, audit)
            });
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
    pub fn stored(&mut self, done: Done<'_>) {
        self.storing.remove(&done.index);
        if !done.poison {
            self.workers.count_done(done.worker);
        }
        self.record(done);
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
            if self.leases.held(id, *lease).is_some() {
                if broken {
                    self.lose(*lease, &mut events);
                } else {
                    self.leases.remove(*lease);
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

    /// The campaign is over, and its results are the indices below `end`: no further realisation is wanted. Audits
    /// of the results still are, until [`Queue::close`]; then workers are told to leave.
    pub fn finish(&mut self, end: u64) {
        let before = std::mem::replace(&mut self.end, end);
        self.finished = true;
        self.open.clear();
        if before < end {
            self.look_for_audits();
        } else {
            self.audits_due.retain(|index| *index < end);
        }
    }

    /// The campaign is not over after all: an outcome that it rested on was overruled.
    pub fn go_on(&mut self) {
        (self.finished, self.closed, self.end) = (false, false, u64::MAX);
        for index in self.prefix..self.next {
            self.reopen(index);
        }
        self.look_for_audits();
    }

    /// Audits that are still due are given up.
    pub fn close(&mut self) {
        self.closed = true;
    }

    /// Whether every worker has been told that it is over, or that the coordinator stops.
    pub fn everyone_told(&self) -> bool {
        self.workers.iter().all(|(_, worker)| worker.told)
    }
}
