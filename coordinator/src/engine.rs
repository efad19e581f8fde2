//! A campaign in progress: the queue, the estimates folded in index order, and the decision to stop.
//!
//! Synchronous like the queue. Outcomes reach the estimator only as part of the contiguous prefix of indices, so
//! that the stopping index and every estimate are the same for any number of workers, and after any interruption.
//! Outcomes beyond the stopping index are kept in the store but are no part of the results.

use crate::queue::{
    Done, Event, Held, Lease, LeaseAnswer, Order, Queue, ReportStep, Settings, UnknownWorker, WorkerId,
};
use crate::store::Contents;
use crate::store::log::{Entry, Record};
use crate::store::wire::Gist;
use runout_core::estimate::{Decision, Estimator};
use runout_core::outcome::{Outcome, OutcomeKind, Reason};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// What became of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Recorded.
    Recorded,
    /// Recorded before, equal.
    Duplicate,
    /// Recorded before, different.
    Conflict,
    /// Of no use.
    NotWanted,
}

/// What to do with a report.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Answer this.
    Answer(Verdict),
    /// Make the entry durable, call [`Engine::stored`], then answer.
    Store(Box<Entry>, Verdict),
    /// The worker shall ask again.
    Busy,
}

/// The campaign in progress.
#[derive(Debug)]
pub struct Engine {
    queue: Queue,
    estimator: Estimator,
    /// Recorded outcomes beyond the prefix.
    waiting: BTreeMap<u64, Outcome>,
    conflicts: u64,
    audits_agreed: u64,
}

impl Engine {
    /// Continues from what the store holds (nothing, for a new campaign), with an estimator that has folded none of
    /// it yet, or a part of its prefix.
    pub fn new(settings: Settings, estimator: Estimator, contents: &Contents, session: u32) -> Engine {
        let mut engine = Engine {
            queue: Queue::new(settings, session),
            estimator,
            waiting: BTreeMap::new(),
            conflicts: contents.conflicts.len() as u64,
            audits_agreed: contents.audited.len() as u64,
        };
        let contradicted: BTreeSet<u64> = contents.conflicts.iter().map(|c| c.index).collect();
        for record in &contents.records {
            let index = record.index;
            let audited = contents.audited.contains(&index) || contradicted.contains(&index);
            engine.queue.restore_recorded(done_before(record, &record.digest_text()), audited);
            if index >= engine.estimator.next_index() {
                engine.waiting.insert(index, record.to_fold());
            }
            engine.fold_waiting();
        }
        for (index, attempts) in &contents.attempts {
            engine.queue.restore_attempts(*index, *attempts);
        }
        engine.fold();
        engine
    }

    /// The queue.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// The estimates so far.
    pub fn estimator(&self) -> &Estimator {
        &self.estimator
    }

    /// Outcomes that contradict a recorded one.
    pub fn conflicts(&self) -> u64 {
        self.conflicts
    }

    /// Audits whose second run agreed.
    pub fn audits_agreed(&self) -> u64 {
        self.audits_agreed
    }

    /// Outcomes recorded beyond the prefix.
    pub fn ahead(&self) -> u64 {
        self.waiting.len() as u64
    }

    /// Whether the campaign is over.
    pub fn is_over(&self) -> bool {
        self.estimator.decision() != Decision::Continue
    }

    /// Whether workers are told to leave, or to take nothing new.
    pub fn is_ending(&self) -> bool {
        self.is_over() || self.queue.is_draining()
    }

    /// See [`Queue::register`].
    pub fn register(&mut self, name: &str, slots: u32, held: &[Held], now: Duration) -> WorkerId {
        self.queue.register(name, slots, held, now)
    }

    /// See [`Queue::lease`].
    ///
    /// # Errors
    /// The worker is not known.
    pub fn lease(&mut self, worker: WorkerId, now: Duration) -> Result<LeaseAnswer, UnknownWorker> {
        self.queue.lease(worker, now)
    }

    /// See [`Queue::heartbeat`].
    ///
    /// # Errors
    /// The worker is not known.
    pub fn heartbeat(
        &mut self,
        worker: WorkerId,
        held: &[Held],
        now: Duration,
    ) -> Result<(Order, Vec<Lease>, Vec<Event>), UnknownWorker> {
        self.queue.heartbeat(worker, held, now)
    }

    /// See [`Queue::release`].
    ///
    /// # Errors
    /// The worker is not known.
    pub fn release(
        &mut self,
        worker: WorkerId,
        leases: &[Lease],
        broken: bool,
        leaving: bool,
        now: Duration,
    ) -> Result<Vec<Event>, UnknownWorker> {
        self.queue.release(worker, leases, broken, leaving, now)
    }

    /// See [`Queue::worker_died`].
    pub fn worker_died(&mut self, name: &str) -> Vec<Event> {
        self.queue.worker_died(name)
    }

    /// See [`Queue::tick`].
    pub fn tick(&mut self, now: Duration) -> Vec<Event> {
        self.queue.tick(now)
    }

    /// See [`Queue::close`].
    pub fn close(&mut self) {
        self.queue.close();
    }

    /// See [`Queue::drain`].
    pub fn drain(&mut self) {
        self.queue.drain();
    }

    /// Takes a report.
    ///
    /// # Errors
    /// The worker is not known.
    pub fn report(
        &mut self,
        worker: WorkerId,
        attempt: u32,
        outcome: Outcome,
        wall_s: f64,
        now: Duration,
    ) -> Result<Step, UnknownWorker> {
        let lease = Lease { index: outcome.index, attempt };
        let step = self.queue.report(worker, lease, &outcome.digest, now)?;
        let name = self
            .queue
            .workers()
            .find(|(id, _)| *id == worker)
            .map(|(_, w)| w.name.clone())
            .unwrap_or_default();
        let index = outcome.index;
        let record = Record { outcome, attempt, worker: name, wall_s };
        Ok(match step {
            ReportStep::Store => Step::Store(Box::new(Entry::Outcome(record)), Verdict::Recorded),
            ReportStep::Conflict => Step::Store(Box::new(Entry::Conflict(record)), Verdict::Conflict),
            ReportStep::AuditAgrees => {
                let entry = Entry::Audit { index, worker: record.worker };
                Step::Store(Box::new(entry), Verdict::Duplicate)
            }
            ReportStep::Duplicate => Step::Answer(Verdict::Duplicate),
            ReportStep::NotWanted => Step::Answer(Verdict::NotWanted),
            ReportStep::Busy => Step::Busy,
        })
    }

    /// An entry is durable now.
    pub fn stored(&mut self, entry: &Entry) {
        match entry {
            Entry::Conflict(_) => self.conflicts += 1,
            Entry::Audit { .. } => self.audits_agreed += 1,
            // Written by `runout retry`, while no coordinator works on the directory.
            Entry::Withdrawn { .. } => {}
            Entry::Outcome(record) => {
                self.queue.stored(done(record));
                self.waiting.insert(record.outcome.index, record.outcome.clone());
                self.fold();
            }
        }
    }

    fn fold(&mut self) {
        self.fold_waiting();
        if self.is_over() {
            self.queue.finish(self.estimator.realisations());
        }
    }

    fn fold_waiting(&mut self) {
        while !self.is_over()
            && let Some(outcome) = self.waiting.remove(&self.estimator.next_index())
        {
            self.estimator.push(&outcome).expect("the outcome is the next one");
        }
    }
}

/// A record of an earlier session as the queue sees it.
fn done_before<'a>(record: &'a Gist, digest: &'a str) -> Done<'a> {
    Done {
        index: record.index,
        digest,
        worker: &record.worker,
        attempt: record.attempt,
        wall_s: record.wall_s,
        poison: record.reason == Reason::Poison,
    }
}

/// A record as the queue sees it.
fn done(record: &Record) -> Done<'_> {
    let Record { outcome, attempt, worker, wall_s } = record;
    Done {
        index: outcome.index,
        digest: &outcome.digest,
        worker,
        attempt: *attempt,
        wall_s: *wall_s,
        poison: outcome.reason == Reason::Poison,
    }
}

/// The entry that records an index as poison: a failed outcome that follows from the index alone.
pub fn poison(index: u64) -> Entry {
    let outcome = Outcome {
        index,
        outcome: OutcomeKind::Failed,
        reason: Reason::Poison,
        measures: None,
        energy: None,
        energy_drifted: false,
        simulated_s: 0.0,
        steps: 0,
        points: 0,
        digest: blake3::hash(&index.to_be_bytes()).to_hex()[..32].to_owned(),
    };
    Entry::Outcome(Record { outcome, attempt: 0, worker: "coordinator".to_owned(), wall_s: 0.0 })
}
