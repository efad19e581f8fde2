//! A simulated worker: what `runout-worker` does, as reactions to timers and answers.

use super::coordinator::{Call, Reply, held_at};
use super::random::Random;
use runout::engine::Verdict;
use runout::queue::{Held, Lease, Order, WorkerId};
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use runout_core::profile::Profile;
use std::collections::BTreeMap;

const SECOND_US: u64 = 1_000_000;
pub(crate) const HEARTBEAT_US: u64 = 5 * SECOND_US;
/// A call without an answer is given up after this, as by the client.
const CALL_LIMIT_US: u64 = 30 * SECOND_US;
/// A worker ends if a cancelled realisation has not ended by then.
const STUCK_AFTER_US: u64 = 60 * SECOND_US;

/// A finished realisation, on the worker's disk until it is acknowledged.
#[derive(Debug, Clone)]
pub(crate) struct Report {
    attempt: u32,
    outcome: Outcome,
}

/// Something that a process waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Timer {
    Beat,
    /// A slot has computed for its time.
    Done(usize, Lease),
    /// No answer to a call came.
    Silence(u64),
    /// A call is to be made again.
    Again(Purpose),
    /// A computation that was cancelled has not ended.
    Stuck(usize, Lease),
}

/// What a call is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    Register,
    Lease(usize),
    Heartbeat,
    Report(usize),
    /// The first of what an earlier process left behind.
    LeftBehind,
    Leave,
}

#[derive(Debug, Clone)]
enum Slot {
    Asking,
    Computing { lease: Lease, since_us: u64, stands_still: bool, ignores: bool, cancelled: bool },
    Reporting { lease: Lease, report: Box<Report> },
}

/// What a process wants done.
#[derive(Debug)]
pub(crate) enum Do {
    Send(u64, Call),
    Wait(u64, Timer),
    /// The process ends, because it was told to or because it broke.
    End {
        told_to: bool,
    },
    /// Something to count.
    Note(&'static str),
    /// A worker has been told that this index is recorded.
    Acknowledged(u64),
}

/// What a worker is like.
#[derive(Debug, Clone)]
pub(crate) struct Nature {
    pub(crate) slots: usize,
    pub(crate) mean_us: u64,
    /// Share of its outcomes that have wrong bits.
    pub(crate) wrong: f64,
    /// Share of attempts that take no steps any more.
    pub(crate) hangs: f64,
    /// Share of those that do not see their cancellation either.
    pub(crate) stuck: f64,
    /// Index that takes the process down.
    pub(crate) dies_at: Option<u64>,
}

/// A running process.
#[derive(Debug)]
pub(crate) struct Process {
    name: String,
    seed: u64,
    nature: Nature,
    id: Option<WorkerId>,
    registering: bool,
    slots: Vec<Slot>,
    calls: BTreeMap<u64, Purpose>,
    next_call: u64,
    left_behind: Vec<Report>,
    random: Random,
}

impl Process {
    /// Starts with what an earlier process has left in the spool.
    pub(crate) fn start(
        name: String,
        seed: u64,
        nature: Nature,
        spool: Vec<Report>,
        random: Random,
    ) -> (Process, Vec<Do>) {
        let slots = vec![Slot::Asking; nature.slots];
        let mut process = Process {
            name,
            seed,
            nature,
            id: None,
            registering: false,
            slots,
            calls: BTreeMap::new(),
            next_call: 0,
            left_behind: spool,
            random,
        };
        let mut wanted = vec![Do::Wait(HEARTBEAT_US, Timer::Beat)];
        process.register(&mut wanted);
        (process, wanted)
    }

    /// What lies on its disk.
    pub(crate) fn spool(&self) -> Vec<Report> {
        let reporting = self.slots.iter().filter_map(|slot| match slot {
            Slot::Reporting { report, .. } => Some((**report).clone()),
            _ => None,
        });
        self.left_behind.iter().cloned().chain(reporting).collect()
    }

    fn leases(&self) -> Vec<Lease> {
        self.held(0).into_iter().map(|held| held.lease).collect()
    }

    fn held(&self, now_us: u64) -> Vec<Held> {
        let held = |slot: &Slot| match slot {
            Slot::Asking => None,
            Slot::Reporting { lease, .. } => Some(held_at(*lease, 1, true)),
            Slot::Computing { lease, since_us, stands_still, .. } => {
                let steps = if *stands_still { 1 } else { 1 + now_us.saturating_sub(*since_us) };
                Some(held_at(*lease, steps, false))
            }
        };
        self.slots.iter().filter_map(held).collect()
    }

    fn send(&mut self, purpose: Purpose, call: Call, limit_us: u64, wanted: &mut Vec<Do>) {
        // One call at a time for each purpose.
        self.calls.retain(|_, other| match (*other, purpose) {
            (Purpose::Lease(a) | Purpose::Report(a), Purpose::Lease(b) | Purpose::Report(b)) => a != b,
            (other, purpose) => other != purpose,
        });
        self.next_call += 1;
        self.calls.insert(self.next_call, purpose);
        wanted.push(Do::Send(self.next_call, call));
        wanted.push(Do::Wait(limit_us, Timer::Silence(self.next_call)));
    }

    fn register(&mut self, wanted: &mut Vec<Do>) {
        if !self.registering {
            self.registering = true;
            self.id = None;
            let call = Call::Register {
                name: self.name.clone(),
                slots: self.slots.len() as u32,
                held: self.leases(),
            };
            self.send(Purpose::Register, call, CALL_LIMIT_US, wanted);
        }
    }

    /// Makes the call that this purpose needs now, if it still does; after a registration if that is missing.
    fn pursue(&mut self, purpose: Purpose, now_us: u64, wanted: &mut Vec<Do>) {
        let Some(id) = self.id else {
            if purpose == Purpose::Register {
                self.registering = false;
                self.register(wanted);
            }
            return;
        };
        let call = match purpose {
            Purpose::Register | Purpose::Leave => return,
            Purpose::Heartbeat => Call::Heartbeat { id, held: self.held(now_us) },
            Purpose::LeftBehind => match self.left_behind.first() {
                None => return,
                Some(Report { attempt, outcome }) => {
                    Call::Report { id, attempt: *attempt, outcome: Box::new(outcome.clone()) }
                }
            },
            Purpose::Lease(slot) | Purpose::Report(slot) => match &self.slots[slot] {
                Slot::Asking => Call::Lease { id },
                Slot::Computing { .. } => return,
                Slot::Reporting { report, .. } => {
                    Call::Report { id, attempt: report.attempt, outcome: Box::new(report.outcome.clone()) }
                }
            },
        };
        let limit_us = if purpose == Purpose::Heartbeat { HEARTBEAT_US } else { CALL_LIMIT_US };
        self.send(purpose, call, limit_us, wanted);
    }

    fn back_off(&mut self, purpose: Purpose, wanted: &mut Vec<Do>) {
        if purpose != Purpose::Heartbeat {
            wanted.push(Do::Wait(self.random.between(50_000, 5 * SECOND_US), Timer::Again(purpose)));
        }
    }

    pub(crate) fn timer(&mut self, timer: Timer, now_us: u64) -> Vec<Do> {
        let mut wanted = Vec::new();
        match timer {
            Timer::Beat => {
                self.pursue(Purpose::Heartbeat, now_us, &mut wanted);
                wanted.push(Do::Wait(HEARTBEAT_US, Timer::Beat));
            }
            Timer::Silence(call) => {
                if let Some(purpose) = self.calls.remove(&call) {
                    wanted.push(Do::Note("a call was not answered"));
                    self.back_off(purpose, &mut wanted);
                }
            }
            Timer::Again(purpose) => self.pursue(purpose, now_us, &mut wanted),
            Timer::Done(slot, lease) => self.done(slot, lease, now_us, &mut wanted),
            Timer::Stuck(slot, lease) => {
                if matches!(self.slots[slot], Slot::Computing { lease: l, .. } if l == lease) {
                    wanted.push(Do::Note("a worker left because a realisation was stuck"));
                    self.leave(&mut wanted);
                    wanted.push(Do::End { told_to: false });
                }
            }
        }
        wanted
    }

    fn done(&mut self, slot: usize, lease: Lease, now_us: u64, wanted: &mut Vec<Do>) {
        match self.slots[slot] {
            Slot::Computing { lease: l, stands_still: false, .. } if l == lease => {}
            _ => return,
        }
        if self.nature.dies_at == Some(lease.index) {
            return wanted.push(Do::End { told_to: false });
        }
        let mut outcome = outcome(self.seed, lease.index);
        if self.random.chance(self.nature.wrong) {
            wanted.push(Do::Note("an outcome had wrong bits"));
            outcome.digest = "f".repeat(32);
            outcome.outcome = OutcomeKind::Stable;
        }
        let report = Box::new(Report { attempt: lease.attempt, outcome });
        self.slots[slot] = Slot::Reporting { lease, report };
        self.pursue(Purpose::Report(slot), now_us, wanted);
    }

    fn free(&mut self, slot: usize, now_us: u64, wanted: &mut Vec<Do>) {
        self.slots[slot] = Slot::Asking;
        self.pursue(Purpose::Lease(slot), now_us, wanted);
    }

    /// Gives everything back; the answer is not waited for.
    fn leave(&mut self, wanted: &mut Vec<Do>) {
        if let Some(id) = self.id {
            let call = Call::Release { id, leases: self.leases(), leaving: true };
            self.send(Purpose::Leave, call, CALL_LIMIT_US, wanted);
        }
    }

    pub(crate) fn answer(&mut self, call: u64, reply: Reply, now_us: u64) -> Vec<Do> {
        let mut wanted = Vec::new();
        // An answer that comes too late, or twice, reaches nobody.
        let Some(purpose) = self.calls.remove(&call) else { return wanted };
        match (purpose, reply) {
            (_, Reply::Unknown) => {
                // The heartbeat brings itself back; everything else goes on once registered.
                self.register(&mut wanted);
            }
            (_, Reply::Busy) => self.back_off(purpose, &mut wanted),
            (Purpose::Register, Reply::Registered(id)) => {
                (self.id, self.registering) = (Some(id), false);
                for slot in 0..self.slots.len() {
                    self.pursue(Purpose::Lease(slot), now_us, &mut wanted);
                }
                self.pursue(Purpose::LeftBehind, now_us, &mut wanted);
            }
            (Purpose::Lease(slot), Reply::Assigned(lease)) => self.compute(slot, lease, now_us, &mut wanted),
            (Purpose::Lease(slot), Reply::Wait) => {
                wanted.push(Do::Wait(300_000, Timer::Again(Purpose::Lease(slot))));
            }
            (Purpose::Lease(slot), Reply::Draining) => {
                wanted.push(Do::Wait(SECOND_US, Timer::Again(Purpose::Lease(slot))));
            }
            (Purpose::Lease(_), Reply::Finished) | (_, Reply::Beat { order: Order::Stop, .. }) => {
                self.leave(&mut wanted);
                wanted.push(Do::End { told_to: true });
            }
            (_, Reply::Beat { cancel, .. }) => {
                cancel.iter().for_each(|l| self.cancel(*l, now_us, &mut wanted))
            }
            (Purpose::LeftBehind, Reply::Verdict(verdict)) => {
                let report = self.left_behind.remove(0);
                wanted.push(Do::Note("an outcome from an earlier process's spool was delivered"));
                acknowledged(verdict, report.outcome.index, &mut wanted);
                self.pursue(Purpose::LeftBehind, now_us, &mut wanted);
            }
            (Purpose::Report(slot) | Purpose::Lease(slot), Reply::Verdict(verdict)) => {
                if let Slot::Reporting { lease, .. } = &self.slots[slot] {
                    acknowledged(verdict, lease.index, &mut wanted);
                    self.free(slot, now_us, &mut wanted);
                }
            }
            _ => {}
        }
        wanted
    }

    fn compute(&mut self, slot: usize, lease: Lease, now_us: u64, wanted: &mut Vec<Do>) {
        if !matches!(self.slots[slot], Slot::Asking) {
            return;
        }
        let stands_still = self.random.chance(self.nature.hangs);
        let ignores = stands_still && self.random.chance(self.nature.stuck);
        let time_us = self.nature.mean_us / 2 + self.random.below(self.nature.mean_us.max(1));
        self.slots[slot] =
            Slot::Computing { lease, since_us: now_us, stands_still, ignores, cancelled: false };
        wanted.push(Do::Wait(time_us, Timer::Done(slot, lease)));
    }

    fn cancel(&mut self, lease: Lease, now_us: u64, wanted: &mut Vec<Do>) {
        for slot in 0..self.slots.len() {
            match &mut self.slots[slot] {
                // It does not hear; it is waited for once.
                Slot::Computing { lease: l, ignores: true, cancelled: true, .. } if *l == lease => {}
                Slot::Computing { lease: l, ignores: true, cancelled, .. } if *l == lease => {
                    *cancelled = true;
                    wanted.push(Do::Wait(STUCK_AFTER_US, Timer::Stuck(slot, lease)));
                }
                Slot::Computing { lease: l, .. } if *l == lease => self.free(slot, now_us, wanted),
                _ => {}
            }
        }
    }
}

fn acknowledged(verdict: Verdict, index: u64, wanted: &mut Vec<Do>) {
    match verdict {
        Verdict::Recorded | Verdict::Duplicate => wanted.push(Do::Acknowledged(index)),
        Verdict::Conflict => wanted.push(Do::Note("an outcome contradicted another")),
        Verdict::NotWanted => wanted.push(Do::Note("an outcome was not wanted")),
    }
}

fn profile(index: u64) -> Profile {
    Profile { column_m: 0.5, depth_mm: vec![index as u32 + 1; (index % 64) as usize], speed_mm_s: vec![7] }
}

/// The outcome of a sound worker: it follows from seed and index.
pub(crate) fn outcome(seed: u64, index: u64) -> Outcome {
    let mut random = Random::new(seed ^ (index << 20));
    let stable = random.chance(0.2);
    let distance_m = if stable { 0.01 } else { 2.0 + random.below(4096) as f64 / 1024.0 };
    let measures = Measures {
        max_displacement_m: distance_m,
        displacement_q999_m: distance_m,
        toe_advance_m: distance_m,
        ..Measures::default()
    };
    let kind = if stable { OutcomeKind::Stable } else { OutcomeKind::Runout };
    Outcome {
        simulated_s: 1.0,
        steps: index,
        points: 100,
        profile: index.is_multiple_of(2).then(|| profile(index)),
        digest: format!("{:016x}{index:016x}", random.next()),
        ..Outcome::bare(index, kind, Reason::AtRest, Some(measures))
    }
}
