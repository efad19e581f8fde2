//! What became of attempts, and what workers did, from `events.log` and the outcome log.
//!
//! An attempt begins when its lease is noted and ends with what the worker, or the loss of the worker, brings about. An
//! attempt of which nothing more was noted is open: it runs, or its coordinator was killed.

use crate::events::{Noted, What};
use crate::machine::Machine;
use crate::store::log::{Entry, Record};
use serde::Serialize;
use std::collections::BTreeMap;

/// How an attempt ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "how")]
pub enum End {
    /// It gave the recorded outcome.
    Recorded,
    /// It ran a recorded index again and gave the same digest.
    AuditAgreed,
    /// It gave another digest than the recorded outcome's.
    Conflict,
    /// It gave the recorded digest once more.
    Duplicate,
    /// It came when nobody waited for it any more.
    NotWanted,
    /// The worker gave it back in good order.
    GivenBack,
    /// The computation broke: a loss.
    Broke {
        /// How.
        error: String,
    },
    /// It took no more steps: a loss.
    Hung,
    /// Its worker died or was not heard of any more: a loss.
    WorkerLost,
}

impl End {
    /// Whether it counts as an unexpected loss of the index.
    pub fn is_loss(&self) -> bool {
        matches!(self, End::Broke { .. } | End::Hung | End::WorkerLost)
    }

    /// In words.
    pub fn words(&self) -> String {
        match self {
            End::Recorded => "recorded".to_owned(),
            End::AuditAgreed => "audit: the same digest".to_owned(),
            End::Conflict => "ANOTHER DIGEST than the recorded outcome; worker set aside".to_owned(),
            End::Duplicate => "the same digest once more".to_owned(),
            End::NotWanted => "not wanted any more".to_owned(),
            End::GivenBack => "given back in good order".to_owned(),
            End::Broke { error } => format!("lost: the computation broke ({error})"),
            End::Hung => "lost: it took no more steps".to_owned(),
            End::WorkerLost => "lost: the worker died or was not heard of any more".to_owned(),
        }
    }
}

/// An attempt of a realisation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Attempt {
    /// Realisation index.
    pub index: u64,
    /// Attempt; absent where only its result was noted without it.
    pub attempt: Option<u32>,
    /// Worker.
    pub worker: String,
    /// When it was leased, in UTC; absent if that was not noted.
    pub from: Option<String>,
    /// When it ended, in UTC.
    pub until: Option<String>,
    /// How it ended; absent if it is open.
    pub end: Option<End>,
}

/// Follows attempts through events in their order.
#[derive(Debug, Default)]
pub struct Follower {
    open: BTreeMap<(u64, u32), Attempt>,
}

impl Follower {
    /// Takes the next event; returns the attempts that it ended.
    pub fn follow(&mut self, noted: &Noted) -> Vec<Attempt> {
        let at = &noted.at;
        match &noted.what {
            What::Leased { index, attempt, worker } => {
                let begun = Attempt {
                    index: *index,
                    attempt: Some(*attempt),
                    worker: worker.clone(),
                    from: Some(at.clone()),
                    until: None,
                    end: None,
                };
                self.open.insert((*index, *attempt), begun);
                Vec::new()
            }
            What::Recorded { attempt: 0, .. } => Vec::new(),
            What::Recorded { index, attempt, worker, .. } => {
                vec![self.end(*index, *attempt, worker, at, End::Recorded)]
            }
            What::Conflict { index, attempt, worker } => {
                vec![self.end(*index, *attempt, worker, at, End::Conflict)]
            }
            What::Duplicate { index, attempt, worker } => {
                vec![self.end(*index, *attempt, worker, at, End::Duplicate)]
            }
            What::NotWanted { index, attempt, worker } => {
                vec![self.end(*index, *attempt, worker, at, End::NotWanted)]
            }
            What::Released { index, attempt, worker, error } => {
                let end = error.clone().map_or(End::GivenBack, |error| End::Broke { error });
                vec![self.end(*index, *attempt, worker, at, end)]
            }
            What::Audited { index, worker } => {
                self.end_all(at, &End::AuditAgreed, |a| a.is_of(*index, worker))
            }
            What::Hung { index, worker } => self.end_all(at, &End::Hung, |a| a.is_of(*index, worker)),
            What::WorkerLost { worker } => self.end_all(at, &End::WorkerLost, |a| a.worker == *worker),
            What::Left { worker } => self.end_all(at, &End::GivenBack, |a| a.worker == *worker),
            What::Started { .. }
            | What::Registered { .. }
            | What::Poisoned { .. }
            | What::Withdrawn { .. } => Vec::new(),
        }
    }

    /// The attempts that are open.
    pub fn into_open(self) -> impl Iterator<Item = Attempt> {
        self.open.into_values()
    }

    fn end(&mut self, index: u64, attempt: u32, worker: &str, at: &str, end: End) -> Attempt {
        let begun = self.open.remove(&(index, attempt));
        let from = begun.and_then(|begun| begun.from);
        let (worker, until) = (worker.to_owned(), Some(at.to_owned()));
        Attempt { index, attempt: Some(attempt), worker, from, until, end: Some(end) }
    }

    fn end_all(&mut self, at: &str, end: &End, meant: impl Fn(&Attempt) -> bool) -> Vec<Attempt> {
        let ended = self.open.extract_if(.., |_, attempt| meant(attempt));
        ended
            .map(|(_, attempt)| Attempt { until: Some(at.to_owned()), end: Some(end.clone()), ..attempt })
            .collect()
    }
}

impl Attempt {
    fn is_of(&self, index: u64, worker: &str) -> bool {
        self.index == index && self.worker == worker
    }
}

/// What a worker did, over all sessions.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct WorkerRecord {
    /// Its name.
    pub worker: String,
    /// Realisations at a time, when it last registered; absent if that was not noted.
    pub slots: Option<u32>,
    /// What it runs on, when it last registered; absent if that was not noted.
    pub machine: Option<Machine>,
    /// Recorded outcomes that it computed.
    pub realisations: u64,
    /// Wall time of these, s.
    pub wall_s: f64,
    /// Steps times points of these.
    pub point_updates: f64,
    /// Speed of one realisation, point updates a second; absent without any.
    pub point_updates_per_s: Option<f64>,
    /// Second runs that gave the recorded digest.
    pub audits: u64,
    /// Outcomes that contradict the recorded one.
    pub conflicts: u64,
    /// Attempts that were lost on it.
    pub losses: u64,
    /// Attempts that are open: running, or left by a coordinator that was killed.
    pub open: u64,
    /// When it was first noted, in UTC.
    pub first_seen: Option<String>,
    /// When it was last noted, in UTC.
    pub last_seen: Option<String>,
}

/// Sums over workers, from the entries of the outcome log and the events.
#[derive(Debug, Default)]
pub struct Workers {
    by_name: BTreeMap<String, WorkerRecord>,
    follower: Follower,
}

impl Workers {
    /// Takes an entry of the outcome log.
    pub fn entry(&mut self, entry: &Entry) {
        match entry {
            // What the coordinator gave up was computed by nobody.
            Entry::Outcome(Record { attempt: 0, .. }) | Entry::Withdrawn { .. } => {}
            Entry::Outcome(Record { outcome, worker, wall_s, .. }) => {
                let of = self.named(worker);
                of.realisations += 1;
                of.wall_s += wall_s;
                of.point_updates += outcome.steps as f64 * outcome.points as f64;
            }
            Entry::Conflict(record) => self.named(&record.worker).conflicts += 1,
            Entry::Audit { worker, .. } => self.named(worker).audits += 1,
        }
    }

    /// Takes an event.
    pub fn event(&mut self, noted: &Noted) {
        let lost: Vec<Attempt> = self.follower.follow(noted);
        for attempt in lost.iter().filter(|a| a.end.as_ref().is_some_and(End::is_loss)) {
            self.named(&attempt.worker).losses += 1;
        }
        if let Some(name) = noted.what.worker() {
            let of = self.named(name);
            of.first_seen.get_or_insert_with(|| noted.at.clone());
            of.last_seen = Some(noted.at.clone());
            if let What::Registered { slots, machine, .. } = &noted.what {
                of.slots = Some(*slots);
                of.machine.clone_from(machine);
            }
        }
    }

    /// The workers by name.
    pub fn finish(mut self) -> Vec<WorkerRecord> {
        let follower = std::mem::take(&mut self.follower);
        for attempt in follower.into_open() {
            self.named(&attempt.worker).open += 1;
        }
        let records = self.by_name.into_values().map(|of| {
            let speed = (of.wall_s > 0.0).then(|| of.point_updates / of.wall_s);
            WorkerRecord { point_updates_per_s: speed, ..of }
        });
        records.collect()
    }

    fn named(&mut self, worker: &str) -> &mut WorkerRecord {
        if !self.by_name.contains_key(worker) {
            let of = WorkerRecord { worker: worker.to_owned(), ..WorkerRecord::default() };
            self.by_name.insert(worker.to_owned(), of);
        }
        self.by_name.get_mut(worker).expect("it was just put there")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::tests::record;
    use runout_core::outcome::Reason;

    fn noted(second: u32, what: What) -> Noted {
        Noted { at: format!("2026-01-01T00:00:{second:02}.000Z"), what }
    }

    fn leased(index: u64, attempt: u32, worker: &str) -> What {
        What::Leased { index, attempt, worker: worker.into() }
    }

    #[test]
    fn attempts_are_followed_to_their_ends() {
        let recorded =
            What::Recorded { index: 1, attempt: 2, worker: "b".into(), reason: Reason::AtRest, wall_s: 1.0 };
        let released = |error| What::Released { index: 3, attempt: 1, worker: "b".into(), error };
        let events = [
            leased(1, 1, "a"),
            leased(2, 1, "a"),
            What::WorkerLost { worker: "a".into() },
            leased(1, 2, "b"),
            recorded,
            leased(3, 1, "b"),
            released(Some("no memory".into())),
            leased(1, 3, "c"),
            What::Audited { index: 1, worker: "c".into() },
            leased(4, 1, "c"),
        ];
        let mut follower = Follower::default();
        let ended: Vec<Attempt> =
            (0..).zip(events).flat_map(|(second, what)| follower.follow(&noted(second, what))).collect();
        let ends: Vec<(u64, Option<u32>, &str, bool)> = ended
            .iter()
            .map(|a| (a.index, a.attempt, a.worker.as_str(), a.end.as_ref().unwrap().is_loss()))
            .collect();
        let expected = [
            (1, Some(1), "a", true),
            (2, Some(1), "a", true),
            (1, Some(2), "b", false),
            (3, Some(1), "b", true),
            (1, Some(3), "c", false),
        ];
        assert_eq!(ends, expected);
        assert_eq!(ended[2].from.as_deref(), Some("2026-01-01T00:00:03.000Z"));
        assert_eq!(ended[2].until.as_deref(), Some("2026-01-01T00:00:04.000Z"));
        assert_eq!(follower.into_open().map(|a| a.index).collect::<Vec<_>>(), [4]);
    }

    fn machine() -> Option<Machine> {
        Some(Machine { processor: "Xeon".into(), kernel: "avx2".into(), cores: 8 })
    }

    #[test]
    fn workers_are_summed_over_both_logs() {
        let mut workers = Workers::default();
        let fast = Record { worker: "a".into(), wall_s: 0.5, ..record(10) };
        workers.entry(&Entry::Outcome(fast.clone()));
        workers.entry(&Entry::Outcome(Record { wall_s: 1.5, ..fast.clone() }));
        workers.entry(&Entry::Outcome(Record { attempt: 0, worker: "coordinator".into(), ..fast.clone() }));
        workers.entry(&Entry::Audit { index: 1, worker: "b".into() });
        workers.entry(&Entry::Conflict(Record { worker: "b".into(), ..fast }));
        workers
            .event(&noted(0, What::Registered { worker: "a".into(), slots: 4, held: 0, machine: machine() }));
        workers.event(&noted(1, leased(5, 1, "a")));
        workers.event(&noted(2, What::Hung { index: 5, worker: "a".into() }));
        workers.event(&noted(3, leased(6, 1, "b")));
        let records = workers.finish();
        let [a, b] = records.as_slice() else { panic!("{records:?}") };
        assert_eq!((a.realisations, a.wall_s, a.losses, a.slots, a.open), (2, 2.0, 1, Some(4), 0));
        assert_eq!((&a.machine, &b.machine), (&machine(), &None));
        // Twice 10 steps of 100 points in 2 s.
        assert_eq!(a.point_updates_per_s, Some(1000.0));
        assert_eq!(
            (b.audits, b.conflicts, b.realisations, b.open, b.point_updates_per_s),
            (1, 1, 0, 1, None)
        );
        assert_eq!(a.last_seen.as_deref(), Some("2026-01-01T00:00:02.000Z"));
    }
}
