//! What a coordinator has seen, beside where the campaign stands: counters of this process, the latest and the longest
//! slides, failed analyses, times. For the live page and the metrics; nothing depends on it, and all of it is bounded.

use crate::essence::Essence;
use crate::queue::Event;
use crate::store::log::Record;
use crate::store::wire::Gist;
use runout_core::campaign::RunoutMeasure;
use runout_core::outcome::{Outcome, OutcomeKind};
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Latest slides kept.
const LATEST: usize = 8;
/// Longest slides kept.
const LONGEST: usize = 8;
/// Latest failed analyses kept.
const FAILURES: usize = 20;
/// Workers whose work is added up by name; local workers that are replaced get new names.
const WORKERS: usize = 4096;

/// Upper bounds of the classes of [`Latency`], s.
pub const LATENCY_BOUNDS_S: [f64; 12] =
    [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0];

/// A realisation as the page shows it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Slide {
    /// Index.
    pub index: u64,
    /// What became of it.
    pub outcome: OutcomeKind,
    /// Why its analysis ended, or how it is marked.
    pub remark: &'static str,
    /// The campaign's measure of runout, m; absent if the analysis failed.
    pub runout_m: Option<f64>,
    /// Advance of the toe, m; absent if the analysis failed.
    pub toe_advance_m: Option<f64>,
    /// Who computed it.
    pub worker: String,
    /// In which attempt.
    pub attempt: u32,
    /// Wall time, s.
    pub wall_s: f64,
}

/// Times from the arrival of a report to its answer, in classes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Latency {
    /// How many fell into each class of [`LATENCY_BOUNDS_S`]; the last one is beyond all bounds.
    pub counts: [u64; LATENCY_BOUNDS_S.len() + 1],
    /// Their sum, s.
    pub sum_s: f64,
}

/// What one worker has done since the coordinator started.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// Outcomes recorded from it.
    pub outcomes: u64,
    /// Wall time that these took, s.
    pub wall_s: f64,
    /// Time steps that these took.
    pub steps: u64,
}

/// How a call ended, as far as the counters are concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Answer {
    /// The outcome was recorded.
    Recorded,
    /// It was recorded before, and equal.
    Duplicate,
    /// It contradicts a recorded one.
    Conflict,
    /// It was of no use.
    NotWanted,
    /// The report was refused: not valid, of another campaign, or of an unknown worker; or it could not be stored.
    Refused,
}

impl Answer {
    /// The name used in metrics.
    pub fn name(self) -> &'static str {
        match self {
            Answer::Recorded => "recorded",
            Answer::Duplicate => "duplicate",
            Answer::Conflict => "conflict",
            Answer::NotWanted => "not-wanted",
            Answer::Refused => "refused",
        }
    }
}

/// What was seen.
#[derive(Debug, Clone)]
pub struct Seen {
    measure: RunoutMeasure,
    /// The latest slides, the last one first.
    pub latest: VecDeque<Slide>,
    /// The longest slides, the longest one first.
    pub longest: Vec<Slide>,
    /// The latest failed analyses, the last one first.
    pub failures: VecDeque<Slide>,
    /// Answers to reports.
    pub reports: BTreeMap<Answer, u64>,
    /// How long the answers took.
    pub latency: Latency,
    /// Workers that were refused.
    pub refused_workers: u64,
    /// Workers that were lost.
    pub lost_workers: u64,
    /// Leases taken back because their realisation took no more steps.
    pub hung: u64,
    /// Realisations given up as poison.
    pub poisoned: u64,
    /// Workers set aside because they compute other bits than others.
    pub set_aside: u64,
    /// Outcomes replaced because the one recorded first was overruled.
    pub corrected: u64,
    /// Realisations that broke on their worker (a panic, say).
    pub broken: u64,
    /// What each worker has done, by name.
    pub work: BTreeMap<String, Work>,
}

impl Seen {
    /// Nothing seen yet; runout is `measure`.
    pub fn new(measure: RunoutMeasure) -> Seen {
        Seen {
            measure,
            latest: VecDeque::new(),
            longest: Vec::new(),
            failures: VecDeque::new(),
            reports: BTreeMap::new(),
            latency: Latency::default(),
            refused_workers: 0,
            lost_workers: 0,
            hung: 0,
            poisoned: 0,
            set_aside: 0,
            corrected: 0,
            broken: 0,
            work: BTreeMap::new(),
        }
    }

    /// An outcome that an earlier session recorded; in index order.
    pub fn restored(&mut self, record: &Gist) {
        self.add(
            &Essence::of_gist(record).outcome(record.index),
            record.attempt,
            &record.worker,
            record.wall_s,
        );
    }

    fn add(&mut self, outcome: &Outcome, attempt: u32, worker: &str, wall_s: f64) {
        let mark = outcome.mark();
        let slide = Slide {
            index: outcome.index,
            outcome: outcome.outcome,
            remark: if mark.is_empty() { outcome.reason.name() } else { mark },
            runout_m: outcome.measures.as_ref().map(|m| self.measure.of(m)),
            toe_advance_m: outcome.measures.as_ref().map(|m| m.toe_advance_m),
            worker: worker.to_owned(),
            attempt,
            wall_s,
        };
        match slide.outcome {
            OutcomeKind::Failed => push(&mut self.failures, slide, FAILURES),
            OutcomeKind::Stable => {}
            OutcomeKind::Runout => {
                let place = self.longest.partition_point(|other| other.runout_m >= slide.runout_m);
                if place < LONGEST {
                    self.longest.insert(place, slide.clone());
                    self.longest.truncate(LONGEST);
                }
                push(&mut self.latest, slide, LATEST);
            }
        }
    }

    /// An outcome was recorded.
    pub fn recorded(&mut self, record: &Record) {
        self.add(&record.outcome, record.attempt, &record.worker, record.wall_s);
        if self.work.len() < WORKERS || self.work.contains_key(&record.worker) {
            let work = self.work.entry(record.worker.clone()).or_default();
            work.outcomes += 1;
            work.wall_s += record.wall_s;
            work.steps += record.outcome.steps;
        }
    }

    /// A report was answered after `took`.
    pub fn reported(&mut self, answer: Answer, took: Duration) {
        *self.reports.entry(answer).or_default() += 1;
        let seconds = took.as_secs_f64();
        self.latency.counts[LATENCY_BOUNDS_S.partition_point(|bound| *bound < seconds)] += 1;
        self.latency.sum_s += seconds;
    }

    /// Something happened by itself.
    pub fn happened(&mut self, event: &Event) {
        match event {
            Event::WorkerLost { .. } => self.lost_workers += 1,
            Event::Hung { .. } => self.hung += 1,
            Event::Poisoned { .. } => self.poisoned += 1,
            Event::SetAside { .. } => self.set_aside += 1,
            Event::Corrected { .. } => self.corrected += 1,
        }
    }
}

fn push(slides: &mut VecDeque<Slide>, slide: Slide, most: usize) {
    slides.push_front(slide);
    slides.truncate(most);
}

#[cfg(test)]
mod tests {
    use super::*;
    use runout_core::outcome::Reason;

    fn record(index: u64, kind: OutcomeKind, runout_m: f64) -> Record {
        let essence = Essence {
            kind,
            reason: if kind == OutcomeKind::Failed { Reason::NonFinite } else { Reason::AtRest },
            energy_drifted: false,
            distances_m: (kind != OutcomeKind::Failed).then_some([2.0 * runout_m, runout_m, 0.5 * runout_m]),
        };
        let outcome = Outcome { steps: 10, ..essence.outcome(index) };
        Record { outcome, attempt: 1, worker: format!("w{}", index % 2), wall_s: 0.5 }
    }

    #[test]
    fn the_latest_and_the_longest_are_kept_and_no_more() {
        let mut seen = Seen::new(RunoutMeasure::DisplacementQ999);
        for index in 0..100 {
            // Rises and falls: the longest are in the middle.
            let runout = 50.0 - (index as f64 - 50.0).abs();
            seen.recorded(&record(index, OutcomeKind::Runout, runout));
            seen.recorded(&record(index, OutcomeKind::Stable, 0.0));
            seen.recorded(&record(index, OutcomeKind::Failed, 0.0));
        }
        let indices = |slides: &[Slide]| slides.iter().map(|s| s.index).collect::<Vec<_>>();
        assert_eq!(indices(seen.latest.make_contiguous()), [99, 98, 97, 96, 95, 94, 93, 92]);
        // Of two equal ones the earlier comes first.
        assert_eq!(indices(&seen.longest), [50, 49, 51, 48, 52, 47, 53, 46]);
        assert_eq!((seen.failures.len(), seen.failures[0].remark), (FAILURES, "non-finite"));
        let work = Work { outcomes: 150, wall_s: 75.0, steps: 1500 };
        assert_eq!(seen.work["w0"], work);
    }

    #[test]
    fn a_time_belongs_to_the_first_class_that_holds_it() {
        let mut seen = Seen::new(RunoutMeasure::ToeAdvance);
        for ms in [1, 2, 10_000] {
            seen.reported(Answer::Recorded, Duration::from_millis(ms));
        }
        assert_eq!((seen.latency.counts[0], seen.latency.counts[1]), (1, 1));
        assert_eq!(seen.latency.counts[LATENCY_BOUNDS_S.len()], 1);
        assert!((seen.latency.sum_s - 10.003).abs() < 1e-12);
    }
}
