//! A campaign in progress: the queue, the estimates folded in index order, and the decision to stop.
//!
//! Synchronous like the queue. Outcomes reach the estimator only as part of the contiguous prefix of indices, so
//! that the stopping index and every estimate are the same for any number of workers, and after any interruption.
//! Outcomes beyond the stopping index are kept in the store but are no part of the results.

use crate::essence::Essence;
use crate::queue::{
    Done, Event, Held, Lease, LeaseAnswer, Order, Queue, ReportStep, Settings, UnknownWorker, WorkerId,
};
use crate::rulings::Opinion;
use crate::store::Contents;
use crate::store::log::{Entry, Record};
use crate::store::wire::Gist;
use runout_core::estimate::{Decision, Estimator};
use runout_core::outcome::{Outcome, OutcomeKind, Reason};
use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

/// What became of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Recorded.
    Recorded,
    /// Recorded before, equal.
    Duplicate,
    /// Another outcome was recorded first; both are kept.
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
    /// The estimator as it was before any outcome, for when a recorded one is overruled.
    empty: Estimator,
    /// What the estimator has been given, by index from 0: for when one is overruled.
    folded: Vec<Essence>,
    /// Recorded outcomes beyond the prefix.
    waiting: BTreeMap<u64, Essence>,
    /// Outcomes of contested realisations with their digests, for when the ruling changes.
    contested: BTreeMap<u64, Vec<(String, Essence)>>,
    conflicts: u64,
    audits_agreed: u64,
}

impl Engine {
    /// Continues from what the store holds (nothing, for a new campaign), with an estimator that has folded none of
    /// it yet, or a part of its prefix.
    pub fn new(settings: Settings, estimator: Estimator, contents: &Contents, session: u32) -> Engine {
        let mut engine = Engine {
            queue: Queue::new(settings, session),
            empty: estimator.restarted(),
            estimator,
            folded: Vec::new(),
            waiting: BTreeMap::new(),
            contested: BTreeMap::new(),
            conflicts: contents.conflicts.len() as u64,
            audits_agreed: contents.audited.len() as u64,
        };
        for record in &contents.records {
            let index = record.index;
            let audited = contents.audited.contains(&index) || contents.disputes.contains_key(&index);
            engine.queue.restore_recorded(done_before(record, &record.digest_text()), audited);
            if index < engine.estimator.next_index() {
                engine.folded.push(Essence::of_gist(record));
            } else {
                engine.waiting.insert(index, Essence::of_gist(record));
            }
            engine.fold_waiting();
        }
        let counting = contents.disputes.keys().filter_map(|index| contents.record(*index));
        for record in contents.overruled.iter().chain(&contents.conflicts).chain(counting) {
            engine.contest(record.index, &record.digest_text(), Essence::of_gist(record));
        }
        for (index, attempts) in &contents.attempts {
            engine.queue.restore_attempts(*index, *attempts);
        }
        engine.queue.restore_opinions(&contents.disputes, &contents.audits);
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

    /// Outcomes that contradict the one recorded first.
    pub fn conflicts(&self) -> u64 {
        self.conflicts
    }

    /// Name of a registered worker; empty if it is not known.
    fn name(&self, worker: WorkerId) -> String {
        self.queue.worker(worker).map(|w| w.name.clone()).unwrap_or_default()
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

    /// See [`Queue::reserve`].
    pub fn reserve(&mut self) -> Range<u64> {
        self.queue.reserve()
    }

    /// See [`Queue::reserved`].
    pub fn reserved(&mut self, indices: Range<u64>) {
        self.queue.reserved(indices);
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
        let name = self.name(worker);
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

    /// An entry is durable now. Returns what follows from it.
    pub fn stored(&mut self, entry: &Entry) -> Vec<Event> {
        match entry {
            // Written by `runout retry`, while no coordinator works on the directory.
            Entry::Withdrawn { .. } => Vec::new(),
            Entry::Outcome(record) => {
                self.queue.stored(done(record));
                self.waiting.insert(record.outcome.index, Essence::of(&record.outcome));
                self.fold();
                Vec::new()
            }
            Entry::Conflict(record) => {
                self.conflicts += 1;
                let index = record.outcome.index;
                let first = self.queue.digest(index).map(str::to_owned).zip(self.essence(index));
                if let Some((digest, first)) = first {
                    self.contest(index, &digest, first);
                }
                self.contest(index, &record.outcome.digest, Essence::of(&record.outcome));
                let events = self.queue.contradicted(index, Opinion::of(record));
                self.correct(events)
            }
            Entry::Audit { index, worker } => {
                self.audits_agreed += 1;
                let events = self.queue.agreed(*index, worker);
                self.correct(events)
            }
        }
    }

    /// Replaces outcomes that were overruled, and folds anew.
    fn correct(&mut self, events: Vec<Event>) -> Vec<Event> {
        let mut anew = false;
        for event in &events {
            let Event::Corrected { index, digest } = event else { continue };
            let known = self.contested.get(index).into_iter().flatten();
            let essence = known.filter(|(d, _)| d == digest).map(|(_, essence)| *essence).next();
            let essence = essence.expect("a verdict is one of the opinions");
            match usize::try_from(*index).ok().and_then(|i| self.folded.get_mut(i)) {
                Some(folded) => (*folded, anew) = (essence, true),
                None => drop(self.waiting.insert(*index, essence)),
            }
        }
        if anew {
            let folded = std::mem::take(&mut self.folded);
            self.waiting.extend((0..).zip(folded));
            self.estimator = self.empty.clone();
            self.fold();
            if !self.is_over() {
                self.queue.go_on();
            }
        }
        events
    }

    fn contest(&mut self, index: u64, digest: &str, essence: Essence) {
        let known = self.contested.entry(index).or_default();
        if known.iter().all(|(d, _)| d != digest) {
            known.push((digest.to_owned(), essence));
        }
    }

    fn essence(&self, index: u64) -> Option<Essence> {
        let folded = usize::try_from(index).ok().and_then(|i| self.folded.get(i));
        folded.or_else(|| self.waiting.get(&index)).copied()
    }

    fn fold(&mut self) {
        self.fold_waiting();
        if self.is_over() {
            self.queue.finish(self.estimator.realisations());
        }
    }

    fn fold_waiting(&mut self) {
        while !self.is_over()
            && let Some(essence) = self.waiting.remove(&self.estimator.next_index())
        {
            let outcome = essence.outcome(self.estimator.next_index());
            self.estimator.push(&outcome).expect("the outcome is the next one");
            self.folded.push(essence);
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
    let essence = Essence {
        kind: OutcomeKind::Failed,
        reason: Reason::Poison,
        energy_drifted: false,
        distances_m: None,
    };
    let digest = blake3::hash(&index.to_be_bytes()).to_hex()[..32].to_owned();
    let outcome = Outcome { digest, ..essence.outcome(index) };
    Entry::Outcome(Record { outcome, attempt: 0, worker: "coordinator".to_owned(), wall_s: 0.0 })
}
