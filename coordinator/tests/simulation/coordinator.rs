//! A simulated coordinator: the real engine, a disk that keeps only what was synced, and the service's order of things
//! (ask the engine, make durable, tell the engine, answer).

use runout::engine::{Engine, Step, Verdict, poison};
use runout::queue::{Attempts, Event, Held, Lease, LeaseAnswer, Order, Settings, WorkerId};
use runout::rulings;
use runout::store::log::{Entry, Record};
use runout::store::wire::{self, Form};
use runout::store::{Contents, Ledger};
use runout_core::campaign::Campaign;
use runout_core::estimate::Estimator;
use runout_core::outcome::Outcome;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::time::Duration;

/// What a worker asks.
#[derive(Debug, Clone)]
pub(crate) enum Call {
    Register { name: String, slots: u32, held: Vec<Lease> },
    Lease { id: WorkerId },
    Heartbeat { id: WorkerId, held: Vec<Held> },
    Report { id: WorkerId, attempt: u32, outcome: Box<Outcome> },
    Release { id: WorkerId, leases: Vec<Lease>, leaving: bool },
}

/// What it is told.
#[derive(Debug, Clone)]
pub(crate) enum Reply {
    Registered(WorkerId),
    Assigned(Lease),
    Wait,
    Draining,
    Finished,
    Beat {
        order: Order,
        cancel: Vec<Lease>,
    },
    Verdict(Verdict),
    Released,
    /// NOT_FOUND: it has to register again.
    Unknown,
    /// UNAVAILABLE: it has to ask again.
    Busy,
}

/// Where an answer goes: worker, its process, the number of the call.
pub(crate) type Sender = (usize, u32, u64);

/// What survives a crash.
#[derive(Debug, Default)]
pub(crate) struct Disk {
    pub(crate) log: Vec<Entry>,
    pub(crate) attempts: BTreeMap<u64, Attempts>,
    recorded: BTreeSet<u64>,
    sessions: u32,
    /// Every lease that was ever sent.
    sent: BTreeSet<Lease>,
    most_slots: u64,
}

impl Disk {
    /// What a coordinator finds that starts.
    fn contents(&self) -> Contents {
        self.read(|entry| wire::gist(entry).expect("its digest has 32 digits"))
    }

    /// The same with whole outcomes.
    pub(crate) fn records(&self) -> Contents<Record> {
        self.read(Entry::clone)
    }

    fn read<R: Form>(&self, form: impl Fn(&Entry) -> Entry<R>) -> Contents<R> {
        let mut ledger = Ledger::new();
        self.log.iter().for_each(|entry| ledger.push(form(entry)));
        let mut contents = Contents { attempts: self.attempts.clone(), ..ledger.finish() };
        rulings::apply(&mut contents);
        contents
    }

    /// A lease goes out: its number is on the disk, and never went out before.
    fn send(&mut self, lease: Lease) {
        let kept = self.attempts.get(&lease.index).copied().unwrap_or_default();
        assert!(lease.attempt <= kept.attempt, "{lease:?} is sent, and not durable");
        assert!(self.sent.insert(lease), "{lease:?} was sent twice");
    }

    pub(crate) fn holds(&self, index: u64) -> bool {
        self.recorded.contains(&index)
    }

    /// As the store: a number below the one kept changes nothing.
    fn keep_attempts(&mut self, index: u64, attempts: Attempts) {
        let kept = self.attempts.entry(index).or_default();
        if kept.attempt <= attempts.attempt {
            *kept = attempts;
        }
    }

    fn write(&mut self, job: &Job) {
        match job {
            Job::Attempts(index, attempts) => self.keep_attempts(*index, *attempts),
            Job::Reservation(indices) => {
                indices.clone().for_each(|index| self.keep_attempts(index, Attempts::FIRST));
            }
            Job::Entry(entry) => {
                if let Entry::Outcome(record) = &**entry {
                    assert!(self.recorded.insert(record.outcome.index), "recorded twice: {record:?}");
                }
                self.log.push((**entry).clone());
            }
        }
    }
}

#[derive(Debug)]
enum Job {
    Attempts(u64, Attempts),
    Reservation(Range<u64>),
    Entry(Box<Entry>),
}

/// A job, and the answer that waits for it.
type Waiting = (Job, Option<(Sender, Reply)>);

/// A coordinator process.
#[derive(Debug)]
pub(crate) struct Session {
    pub(crate) engine: Engine,
    pub(crate) number: u32,
    started_us: u64,
    waiting: Vec<Waiting>,
    committing: Vec<Waiting>,
    prefix: u64,
    audited_by_us: Option<(usize, u64)>,
    told_by_us: Option<u64>,
    told: bool,
    drained_by_us: Option<u64>,
    /// What happened, for the world to count.
    pub(crate) happened: Vec<&'static str>,
}

/// Whether a session goes on.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Goes {
    On,
    /// It drained; the campaign is not over.
    Drained,
    /// The campaign is over.
    Over,
}

impl Session {
    pub(crate) fn start(disk: &mut Disk, campaign: &Campaign, settings: Settings, now_us: u64) -> Session {
        disk.sessions += 1;
        let estimator = Estimator::new(&campaign.stop, &campaign.model.sample, &campaign.run);
        let engine = Engine::new(settings, estimator, &disk.contents(), disk.sessions);
        Session {
            engine,
            number: disk.sessions,
            started_us: now_us,
            waiting: Vec::new(),
            committing: Vec::new(),
            prefix: 0,
            audited_by_us: None,
            told_by_us: None,
            told: false,
            drained_by_us: None,
            happened: Vec::new(),
        }
    }

    fn now(&self, now_us: u64) -> Duration {
        Duration::from_micros(now_us - self.started_us)
    }

    /// Answers a call, now or once something is durable.
    pub(crate) fn take(&mut self, disk: &mut Disk, from: Sender, call: Call, now_us: u64) -> Option<Reply> {
        let now = self.now(now_us);
        match call {
            Call::Register { name, slots, held } => {
                let held: Vec<Held> = held.into_iter().map(|lease| held_at(lease, 0, false)).collect();
                let id = self.engine.register(&name, slots, &held, now);
                let all = self.engine.queue().workers().map(|(_, w)| u64::from(w.slots)).sum();
                disk.most_slots = disk.most_slots.max(all);
                Some(Reply::Registered(id))
            }
            Call::Lease { id } => {
                let Ok(answer) = self.engine.lease(id, now) else { return Some(Reply::Unknown) };
                match answer {
                    LeaseAnswer::Wait => Some(Reply::Wait),
                    LeaseAnswer::Draining => Some(Reply::Draining),
                    LeaseAnswer::Finished => Some(Reply::Finished),
                    LeaseAnswer::Assigned(lease) => {
                        self.check_lease(disk, id, lease);
                        let ahead = self.engine.reserve();
                        if !ahead.is_empty() {
                            self.waiting.push((Job::Reservation(ahead), None));
                        }
                        if self.engine.queue().is_reserved(lease) {
                            disk.send(lease);
                            return Some(Reply::Assigned(lease));
                        }
                        let attempts = self.engine.queue().attempts(lease.index);
                        let job = Job::Attempts(lease.index, attempts);
                        self.waiting.push((job, Some((from, Reply::Assigned(lease)))));
                        None
                    }
                }
            }
            Call::Heartbeat { id, held } => match self.engine.heartbeat(id, &held, now) {
                Err(_) => Some(Reply::Unknown),
                Ok((order, cancel, events)) => {
                    self.handle(events);
                    Some(Reply::Beat { order, cancel })
                }
            },
            Call::Report { id, attempt, outcome } => {
                match self.engine.report(id, attempt, *outcome, 1.0, now) {
                    Err(_) => Some(Reply::Unknown),
                    Ok(Step::Answer(verdict)) => Some(Reply::Verdict(verdict)),
                    Ok(Step::Busy) => Some(Reply::Busy),
                    Ok(Step::Store(entry, verdict)) => {
                        self.waiting.push((Job::Entry(entry), Some((from, Reply::Verdict(verdict)))));
                        None
                    }
                }
            }
            Call::Release { id, leases, leaving } => {
                match self.engine.release(id, &leases, false, leaving, now) {
                    Err(_) => Some(Reply::Unknown),
                    Ok(events) => {
                        self.handle(events);
                        Some(Reply::Released)
                    }
                }
            }
        }
    }

    fn check_lease(&mut self, disk: &mut Disk, id: WorkerId, lease: Lease) {
        let queue = self.engine.queue();
        let (_, worker) = queue.workers().find(|(known, _)| *known == id).expect("it has just asked");
        let held = queue.leases().filter(|(_, running)| running.worker == id).count();
        assert!(held <= worker.slots as usize, "{held} leases for {} slots", worker.slots);
        let bound = queue.prefix() + queue.settings().look_ahead_per_slot * disk.most_slots.max(1);
        assert!(lease.index < bound, "{lease:?} is beyond the look-ahead: {bound}");
        assert!(!worker.set_aside, "a worker set aside gets {lease:?}");
    }

    fn handle(&mut self, events: Vec<Event>) {
        for event in events {
            match event {
                Event::WorkerLost { .. } => self.happened.push("a worker was lost"),
                Event::Hung { .. } => self.happened.push("a realisation hung"),
                Event::SetAside { .. } => self.happened.push("a worker was set aside"),
                Event::Corrected { .. } => self.happened.push("a recorded outcome was corrected"),
                Event::Poisoned { index } => {
                    self.happened.push("an index was poison");
                    self.waiting.push((Job::Entry(Box::new(poison(index))), None));
                }
            }
        }
    }

    /// Whether a group commit is to be begun; it takes what waits.
    pub(crate) fn begins_commit(&mut self) -> bool {
        let begins = self.committing.is_empty() && !self.waiting.is_empty();
        if begins {
            self.committing = std::mem::take(&mut self.waiting);
        }
        begins
    }

    /// The commit is durable. `order` shuffles the calls that go on now, as threads do.
    pub(crate) fn commit(&mut self, disk: &mut Disk, order: impl Fn(usize) -> usize) -> Vec<(Sender, Reply)> {
        let mut all = std::mem::take(&mut self.committing);
        all.iter().for_each(|(job, _)| disk.write(job));
        let mut answers = Vec::new();
        while !all.is_empty() {
            let (job, answer) = all.swap_remove(order(all.len()));
            match &job {
                Job::Entry(entry) => {
                    let events = self.engine.stored(entry);
                    self.handle(events);
                }
                Job::Reservation(indices) => self.engine.reserved(indices.clone()),
                Job::Attempts(..) => {}
            }
            if let Some((_, Reply::Assigned(lease))) = &answer {
                disk.send(*lease);
            }
            answers.extend(answer);
        }
        let prefix = self.engine.queue().prefix();
        assert!(prefix >= self.prefix, "the prefix shrinks");
        assert!((0..prefix).all(|index| disk.holds(index)), "the prefix holds what is not on the disk");
        self.prefix = prefix;
        answers
    }

    /// What a crash leaves of a commit that was under way: the log comes before the attempts, line by line.
    pub(crate) fn crash(mut self, disk: &mut Disk, lines: usize) {
        let all = std::mem::take(&mut self.committing);
        all.iter()
            .filter(|(job, _)| matches!(job, Job::Entry(_)))
            .take(lines)
            .for_each(|(job, _)| disk.write(job));
    }

    pub(crate) fn tick(&mut self, now_us: u64) {
        let events = self.engine.tick(self.now(now_us));
        self.handle(events);
    }

    pub(crate) fn drain(&mut self, grace_us: u64, now_us: u64) {
        self.engine.drain();
        self.drained_by_us = Some(now_us + grace_us);
    }

    /// As `serve::until_end`; `patient` for audits without a limit.
    pub(crate) fn goes(&mut self, patient: bool, now_us: u64) -> Goes {
        let queue = self.engine.queue();
        if !self.engine.is_over() {
            if self.told {
                return Goes::Drained;
            }
            self.audited_by_us = None;
            let idle =
                queue.leases().next().is_none() && self.committing.is_empty() && self.waiting.is_empty();
            return match self.drained_by_us {
                Some(by) if idle || now_us >= by => Goes::Drained,
                _ => Goes::On,
            };
        }
        let due = queue.audits_due();
        if self.drained_by_us.is_some() && due > 0 {
            return Goes::Drained;
        }
        if patient && due > 0 {
            self.told_by_us = None;
            return Goes::On;
        }
        if let Some(limit) = queue.audit_limit() {
            let by = match self.audited_by_us {
                Some((most, by)) if most >= due => by,
                _ => now_us + limit.as_micros() as u64,
            };
            self.audited_by_us = Some((due, by));
            if now_us < by {
                self.told_by_us = None;
                return Goes::On;
            }
        }
        self.told = true;
        let lost_after_us = queue.settings().lost_after().as_micros() as u64;
        let told = queue.everyone_told();
        let told_by = *self.told_by_us.get_or_insert_with(|| now_us + lost_after_us);
        self.engine.close();
        if (told || now_us >= told_by) && self.committing.is_empty() && self.waiting.is_empty() {
            return Goes::Over;
        }
        Goes::On
    }
}

pub(crate) fn held_at(lease: Lease, steps: u64, reporting: bool) -> Held {
    Held { lease, steps, simulated_s: 0.0, reporting }
}
