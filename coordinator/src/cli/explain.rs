//! `runout explain`: the history of one realisation, as far as the run directory knows it.

use super::{Failure, index, print, print_json};
use crate::events::{self, Noted, What};
use crate::history::{Attempt, Follower};
use crate::queue;
use crate::run_directory::{self, Frame};
use crate::status::{self, tally::Tally};
use crate::store::log::{Entry, Record};
use crate::store::scan::{Line, Place, scan_file};
use crate::store::wire::Gist;
use crate::store::{LOG_FILE, read_log};
use clap::Args;
use runout_core::campaign::Campaign;
use runout_core::estimate::Decision;
use runout_core::outcome::{OutcomeKind, Reason};
use runout_core::profile::Profile;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// `runout explain DIR INDEX [--json]`
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// Run directory
    dir: PathBuf,
    /// Index of the realisation
    #[arg(value_parser = index, allow_negative_numbers = true)]
    index: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Everything known of a realisation.
#[derive(Debug, Serialize)]
struct Explanation {
    index: u64,
    /// The outcome that stands; absent if the realisation is open.
    record: Option<Record>,
    /// What it is to the campaign, in words.
    place: String,
    /// Whether it is one of the results.
    in_results: bool,
    /// Whether it is a sample of the runout.
    sample: bool,
    /// Whether the seed chose it to be run twice.
    audit_chosen: bool,
    /// Workers whose second run gave the same digest.
    audits: Vec<String>,
    /// Outcomes that contradict it.
    conflicts: Vec<Record>,
    /// Outcomes that were withdrawn.
    withdrawn: Vec<Record>,
    /// Attempts in the order of their ends; open ones last.
    attempts: Vec<Attempt>,
    /// When it was given up or withdrawn.
    turns: Vec<Noted>,
    /// Unexpected losses.
    losses: usize,
    /// What may be missing here.
    notes: Vec<String>,
}

pub(super) fn explain(arguments: &ExplainArguments) -> Result<(), Failure> {
    let ExplainArguments { dir, index, json } = arguments;
    let frame = run_directory::read_frame(dir).map_err(|e| Failure::Input(e.to_string()))?;
    let campaign = status::campaign_of_frame(&frame, dir)?;
    let explanation = Explanation::of(dir, &frame, &campaign, *index)?;
    if explanation.record.is_none()
        && explanation.attempts.is_empty()
        && *index >= campaign.stop.maximum_realisations
    {
        let most = campaign.stop.maximum_realisations;
        return Err(Failure::Input(format!(
            "realisation {index} is none of this campaign: it has at most {most}, from 0"
        )));
    }
    if *json { print_json(&explanation) } else { print(&explanation.text()) }
}

impl Explanation {
    fn of(dir: &Path, frame: &Frame, campaign: &Campaign, index: u64) -> Result<Explanation, Failure> {
        let log = dir.join(LOG_FILE);
        let failed = |e| Failure::work(log.display(), e);
        let (contents, scan) = read_log::<Gist>(&log).map_err(failed)?;
        let tally = Tally::of(campaign, &contents);
        let mut explanation = Explanation {
            index,
            record: None,
            place: String::new(),
            in_results: index < tally.estimator().realisations(),
            sample: false,
            audit_chosen: queue::is_audited(frame.spec.seed, campaign.run.audit_fraction, index),
            audits: Vec::new(),
            conflicts: Vec::new(),
            withdrawn: Vec::new(),
            attempts: Vec::new(),
            turns: Vec::new(),
            losses: 0,
            notes: Vec::new(),
        };
        scan_file(&log, Place::default(), |line: Line<'_, Record>| {
            explanation.entry(line.entry);
            Ok(())
        })
        .map_err(failed)?;
        explanation.notes.extend(scan.into_damage().into_iter().map(|d| format!("{LOG_FILE}: {d}")));
        explanation.events(dir)?;
        let kind = explanation.record.as_ref().map(|record| record.outcome.outcome);
        explanation.sample = explanation.in_results && kind == Some(OutcomeKind::Runout);
        explanation.place = explanation.place_in(&tally);
        Ok(explanation)
    }

    fn entry(&mut self, entry: Entry) {
        match entry {
            Entry::Outcome(record) if record.outcome.index == self.index => self.record = Some(record),
            Entry::Conflict(record) if record.outcome.index == self.index => self.conflicts.push(record),
            Entry::Audit { index, worker } if index == self.index => self.audits.push(worker),
            Entry::Withdrawn { index, .. } if index == self.index => {
                self.withdrawn.extend(self.record.take())
            }
            _ => {}
        }
    }

    fn events(&mut self, dir: &Path) -> Result<(), Failure> {
        let mut follower = Follower::default();
        let mut known = false;
        let unreadable = events::read(dir, |noted| {
            known = true;
            let ended = follower.follow(&noted);
            self.attempts.extend(ended.into_iter().filter(|attempt| attempt.index == self.index));
            let turn = matches!(noted.what, What::Poisoned { .. } | What::Withdrawn { .. });
            if turn && noted.what.index() == Some(self.index) {
                self.turns.push(noted);
            }
        });
        let unreadable = unreadable.map_err(|e| Failure::work(dir.join(events::EVENTS_FILE).display(), e))?;
        let index = self.index;
        self.attempts.extend(follower.into_open().filter(|attempt| attempt.index == index));
        self.losses =
            self.attempts.iter().filter(|a| a.end.as_ref().is_some_and(|end| end.is_loss())).count();
        if !known {
            self.notes.push(format!(
                "{}: there is none, so that times and losses are not known",
                events::EVENTS_FILE
            ));
        }
        if unreadable > 0 {
            self.notes.push(format!("{}: {unreadable} lines cannot be read", events::EVENTS_FILE));
        }
        Ok(())
    }

    /// Where the realisation lies in the campaign.
    fn place_in(&self, tally: &Tally) -> String {
        let estimator = tally.estimator();
        let end = estimator.realisations();
        let decided = estimator.decision() != Decision::Continue;
        let Some(record) = &self.record else {
            return match (decided, self.in_results || self.index < end) {
                (true, _) => {
                    format!("open, and not needed: the campaign was decided by realisations 0 to {}", end - 1)
                }
                (false, _) if self.index == end => {
                    "open; it is the first one missing, and estimates wait for it".to_owned()
                }
                (false, _) => "open".to_owned(),
            };
        };
        if !self.in_results {
            return if decided {
                format!("recorded, but no result: the campaign was decided by realisations 0 to {}", end - 1)
            } else {
                format!(
                    "recorded; estimates take it in when realisation {end}, the first one missing, is there"
                )
            };
        }
        let counted = match record.outcome.outcome {
            OutcomeKind::Runout => "counted as a sample of the runout",
            OutcomeKind::Stable => "counted as a slope that stood",
            OutcomeKind::Failed if record.outcome.reason == Reason::Poison => {
                "counted as failed: it was given up after taking workers down (`runout retry` re-opens it)"
            }
            OutcomeKind::Failed => "counted as failed",
        };
        format!("one of the {end} results, {counted}")
    }

    fn text(&self) -> String {
        let mut text = format!("realisation {}: {}\n", self.index, self.place);
        if let Some(record) = &self.record {
            text += &format!("  outcome: {}\n", in_words(record));
        }
        for attempt in &self.attempts {
            let number = attempt.attempt.map_or("?".to_owned(), |n| n.to_string());
            let from = attempt.from.as_deref().unwrap_or("(not noted)");
            let end = match (&attempt.end, &attempt.until) {
                (Some(end), Some(until)) => format!("to {until}: {}", end.words()),
                _ => "and no more is known: it runs, or its coordinator was killed".to_owned(),
            };
            text += &format!("  attempt {number} on {}: from {from} {end}\n", attempt.worker);
        }
        for turn in &self.turns {
            let what =
                if matches!(turn.what, What::Poisoned { .. }) { "given up as poison" } else { "withdrawn" };
            text += &format!("  {what} at {}\n", turn.at);
        }
        for record in &self.withdrawn {
            text += &format!("  withdrawn outcome: {}\n", in_words(record));
        }
        for record in &self.conflicts {
            text += &format!("  CONFLICT: {}; one of the machines computes wrongly\n", in_words(record));
        }
        let audits = match (self.audit_chosen, self.audits.as_slice()) {
            (_, [first, ..]) => format!("run twice with the same bits, the second time on {first}"),
            (true, []) => "chosen to be run twice, and not yet compared".to_owned(),
            (false, []) => "not chosen to be run twice".to_owned(),
        };
        text += &format!("  audit: {audits}\n  unexpected losses: {}\n", self.losses);
        self.notes.iter().for_each(|note| text += &format!("  note: {note}\n"));
        text
    }
}

fn in_words(record: &Record) -> String {
    let Record { outcome, attempt, worker, wall_s } = record;
    let mark = if outcome.mark().is_empty() { String::new() } else { format!(", marked {}", outcome.mark()) };
    let moved = outcome.measures.as_ref().map_or(String::new(), |m| {
        format!(", 99.9 % of the points moved at most {:.3} m", m.displacement_q999_m)
    });
    let along = outcome.profile.as_ref().map_or(String::new(), in_front);
    format!(
        "{} ({}){moved}{along}{mark}; digest {}; attempt {attempt} on {worker}, {wall_s:.2} s",
        outcome.outcome.name(),
        outcome.reason.name(),
        outcome.digest
    )
}

/// What it did to the ground in front of the toe.
fn in_front(profile: &Profile) -> String {
    let highest = |columns: usize, of: &dyn Fn(usize) -> f64| (0..columns).map(of).fold(0.0, f64::max);
    let depth_m = highest(profile.depth_mm.len(), &|column| profile.depth_m(column));
    let speed_m_s = highest(profile.speed_mm_s.len(), &|column| profile.speed_m_s(column));
    if depth_m == 0.0 && speed_m_s == 0.0 {
        return ", nothing came to lie or passed in front of the toe".to_owned();
    }
    format!(
        ", deposits up to {:.1} m in front of the toe, at most {depth_m:.2} m deep, passed at up to {speed_m_s:.2} m/s",
        profile.depth_mm.len() as f64 * profile.column_m
    )
}
