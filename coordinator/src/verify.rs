//! Whether a run directory holds together: spec, outcome log, sled, cached estimates. Nothing is repaired or written.
//!
//! sled cannot be opened without writing, so a copy of the store is opened, in the system's temporary folder. While a
//! coordinator works on the directory the store changes under a reader: then only the log is read, and that is said.

use crate::engine;
use crate::load;
use crate::run_directory::{self, Frame};
use crate::status::{cache, tally::Tally};
use crate::store::log::{Entry, Record};
use crate::store::scan::{Line, Place, Scan, scan_file};
use crate::store::wire::{Form, Gist};
use crate::store::{self, DATABASE_FOLDER, LOG_FILE, database};
use runout_core::campaign::Campaign;
use runout_core::estimate::Decision;
use runout_core::outcome::{OutcomeKind, Reason};
use runout_proto::{check, convert};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{fs, io};

/// Most indices that one finding names.
const MOST_NAMED: usize = 20;
/// Most findings of one sort; the rest are counted.
const MOST_FINDINGS: usize = 100;

/// What was looked at, and what is off.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Verification {
    /// Name of the campaign; absent if its file cannot be read.
    pub campaign: Option<String>,
    /// Digest of the spec; absent if it cannot be read.
    pub digest: Option<String>,
    /// Lines of the outcome log.
    pub lines: u64,
    /// Realisations with a standing outcome.
    pub outcomes: u64,
    /// Second runs that agreed.
    pub audits: u64,
    /// Outcomes that contradict a recorded one.
    pub conflicts: u64,
    /// Withdrawn outcomes.
    pub withdrawn: u64,
    /// Realisations of the contiguous prefix, up to the one that decided: the results.
    pub results: u64,
    /// Standing outcomes beyond them.
    pub beyond: u64,
    /// Outcomes in sled; absent if it was not read.
    pub stored: Option<u64>,
    /// What was not looked at, and why.
    pub not_checked: Vec<String>,
    /// What is off.
    pub findings: Vec<String>,
}

impl Verification {
    /// Whether nothing is off.
    pub fn is_sound(&self) -> bool {
        self.findings.is_empty()
    }
}

/// Looks at the run directory `path`.
///
/// # Errors
/// A file that is there cannot be read, or there is no room for the store's copy.
pub fn verify(path: &Path) -> io::Result<Verification> {
    let mut found = Verification::default();
    let frame = match run_directory::read_frame(path) {
        Ok(frame) => frame,
        Err(error) => {
            found.findings.push(error.to_string());
            return Ok(found);
        }
    };
    found.digest = Some(frame.spec.digest());
    let campaign = campaign(path, &frame, &mut found);
    // Held while log and store are read, so that no coordinator changes one between the other.
    let lock = run_directory::lock_for_reading(path);
    let log = Log::read(path, campaign.as_ref(), lock.is_err(), &mut found)?;
    match &lock {
        Ok(_) => compare_store(path, &log, &mut found)?,
        Err(error) => found.not_checked.push(format!("{DATABASE_FOLDER}: {error}; only the log was read")),
    }
    drop(lock);
    if let Some(campaign) = &campaign {
        estimates(path, &frame, campaign, &mut found)?;
    }
    Ok(found)
}

/// The campaign of the directory's texts, which must freeze to its spec.
fn campaign(path: &Path, frame: &Frame, found: &mut Verification) -> Option<Campaign> {
    let Frame { campaign_text, site_text, profile_text, .. } = frame.clone();
    match load::load_texts(&path.join("campaign.toml"), campaign_text, site_text, profile_text) {
        Ok(loaded) => {
            if loaded.spec.digest() != frame.spec.digest() {
                found.findings.push("campaign.toml and its tables do not freeze to spec.json".to_owned());
            }
            found.campaign = Some(loaded.campaign.name.clone());
            Some(loaded.campaign)
        }
        Err(error) => {
            found.findings.push(error.to_string());
            None
        }
    }
}

/// The standing outcomes of the log, each as its attempt, its digest and a checksum of its record.
#[derive(Default)]
struct Log {
    standing: BTreeMap<u64, Standing>,
}

struct Standing {
    attempt: u32,
    digest: String,
    record: [u8; 32],
}

impl Standing {
    fn of(record: &Record) -> Standing {
        Standing { attempt: record.attempt, digest: record.outcome.digest.clone(), record: checksum(record) }
    }
}

impl Log {
    fn read(
        path: &Path,
        campaign: Option<&Campaign>,
        being_written: bool,
        found: &mut Verification,
    ) -> io::Result<Log> {
        let mut log = Log::default();
        let mut findings = Findings::default();
        let mut number = 0;
        let scan = scan_file(&path.join(LOG_FILE), Place::default(), |line: Line<'_, Record>| {
            number += 1;
            log.take(number, line.entry, campaign, found, &mut findings);
            Ok(())
        })?;
        found.lines = scan.end.lines;
        found.outcomes = log.standing.len() as u64;
        torn(&scan, being_written, &mut findings);
        for damage in scan.into_damage() {
            findings.add(damage);
        }
        findings.into(LOG_FILE, found);
        Ok(log)
    }

    fn take(
        &mut self,
        number: u64,
        entry: Entry,
        campaign: Option<&Campaign>,
        found: &mut Verification,
        findings: &mut Findings,
    ) {
        let mut off = |what: String| findings.add(format!("sound line {number}: {what}"));
        match entry {
            Entry::Outcome(record) => {
                let index = record.outcome.index;
                ranges(&record, campaign).into_iter().for_each(&mut off);
                if self.standing.insert(index, Standing::of(&record)).is_some() {
                    off(format!("realisation {index} is recorded again, and was not withdrawn before"));
                }
            }
            Entry::Conflict(record) => {
                found.conflicts += 1;
                ranges(&record, campaign).into_iter().for_each(&mut off);
                let index = record.outcome.index;
                off(format!(
                    "realisation {index} gave another digest on worker {} (attempt {}): one of the machines \
                     computes wrongly",
                    record.worker, record.attempt
                ));
                if self.standing.get(&index).is_none_or(|first| first.digest == record.outcome.digest) {
                    off(format!("the conflict of realisation {index} contradicts nothing"));
                }
            }
            Entry::Audit { index, .. } => {
                found.audits += 1;
                if !self.standing.contains_key(&index) {
                    off(format!("an audit of realisation {index}, which is not recorded"));
                }
            }
            Entry::Withdrawn { index, attempt, digest } => {
                found.withdrawn += 1;
                match self.standing.remove(&index) {
                    Some(was) if was.attempt == attempt && was.digest == digest => {}
                    Some(was) => {
                        self.standing.insert(index, was);
                        off(format!("a withdrawal of another outcome of realisation {index}"));
                    }
                    None => off(format!("a withdrawal of realisation {index}, which is not recorded")),
                }
            }
        }
    }
}

fn torn(scan: &Scan, being_written: bool, findings: &mut Findings) {
    if being_written {
        return;
    }
    if scan.unfinished_bytes > 0 {
        findings.add(format!("the last line is torn ({} bytes)", scan.unfinished_bytes));
    }
    if scan.missing_line_end {
        findings.add("the last line end is missing".to_owned());
    }
}

/// What of a record is out of its range.
fn ranges(record: &Record, campaign: Option<&Campaign>) -> Vec<String> {
    let Record { outcome, attempt, worker, wall_s } = record;
    let index = outcome.index;
    let mut off = Vec::new();
    // The wire's own checks: what arrived passed them.
    if let Err(error) = convert::decode_outcome(Some(convert::encode_outcome(outcome))) {
        off.push(error.to_string());
    }
    if let Err(error) = check::name("worker", worker) {
        off.push(error.to_string());
    }
    if let Err(error) = convert::non_negative("wall_s", *wall_s) {
        off.push(error.to_string());
    }
    let of_failure = matches!(
        outcome.reason,
        Reason::NonFinite | Reason::LeftGrid | Reason::StepLimit | Reason::BadMaterial | Reason::Poison
    );
    if of_failure != (outcome.outcome == OutcomeKind::Failed) {
        off.push(format!("{} does not end as {}", outcome.outcome.name(), outcome.reason.name()));
    }
    if outcome.reason == Reason::Poison {
        let given_up = matches!(engine::poison(index), Entry::Outcome(poison) if poison.outcome == *outcome);
        if !given_up || *attempt != 0 {
            off.push("it is no outcome that a coordinator gives up".to_owned());
        }
    }
    if let (Some(campaign), Some(measures)) = (campaign, &outcome.measures) {
        let sample = &campaign.model.sample;
        let failed = sample.measure.of(measures) > sample.threshold_m;
        if failed != (outcome.outcome == OutcomeKind::Runout) {
            off.push(format!("it is {}, and its runout says otherwise", outcome.outcome.name()));
        }
    }
    off.into_iter().map(|what| format!("realisation {index}: {what}")).collect()
}

/// sled against the log, both ways.
fn compare_store(path: &Path, log: &Log, found: &mut Verification) -> io::Result<()> {
    let store = path.join(DATABASE_FOLDER);
    if !store.is_dir() {
        found.findings.push(format!("{DATABASE_FOLDER}: there is no such folder; {}", cure()));
        return Ok(());
    }
    let copy = tempfile::Builder::new().prefix("runout-verify-").tempdir()?;
    copy_files(&store, copy.path())?;
    let mut stored = 0;
    let mut differing = Vec::new();
    let mut only_stored = Vec::new();
    let mut unseen: BTreeSet<u64> = log.standing.keys().copied().collect();
    let read = database::read_all(copy.path(), |record| {
        stored += 1;
        let index = record.outcome.index;
        unseen.remove(&index);
        match log.standing.get(&index) {
            None => only_stored.push(index),
            Some(standing) if standing.record != checksum(&record) => differing.push(index),
            Some(_) => {}
        }
    });
    found.stored = Some(stored);
    let mut off = |what: String| found.findings.push(format!("{DATABASE_FOLDER}: {what}"));
    if let Err(error) = read {
        off(format!("sled does not read ({error}); {}", cure()));
        return Ok(());
    }
    if !only_stored.is_empty() {
        off(format!("{} outcomes that {LOG_FILE} has not: {}", only_stored.len(), named(&only_stored)));
    }
    if !unseen.is_empty() {
        let missing: Vec<u64> = unseen.into_iter().collect();
        off(format!("lacks {} outcomes of {LOG_FILE}: {}; {}", missing.len(), named(&missing), cure()));
    }
    if !differing.is_empty() {
        off(format!("{} outcomes differ from {LOG_FILE}: {}", differing.len(), named(&differing)));
    }
    Ok(())
}

fn cure() -> &'static str {
    "the next coordinator rebuilds it from the log"
}

fn copy_files(from: &Path, to: &Path) -> io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            fs::create_dir(&target)?;
            copy_files(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

/// The estimates over the log, and whether those that are cached are the same.
fn estimates(path: &Path, frame: &Frame, campaign: &Campaign, found: &mut Verification) -> io::Result<()> {
    let log = path.join(LOG_FILE);
    let (contents, _) = store::read_log::<Gist>(&log)?;
    let tally = Tally::of(campaign, &contents);
    found.results = tally.estimator().realisations();
    found.beyond = tally.ahead();
    let missing = first_missing(&contents.records);
    if tally.estimator().decision() == Decision::Continue && missing != found.results {
        found.findings.push(format!("{LOG_FILE}: the prefix ends at {}, not at {missing}", found.results));
    }
    let key = cache::key(frame);
    if let Some((mut cached, from)) = cache::load(path, &key, campaign) {
        let mut goes_on = true;
        scan_file(&log, from, |line: Line<'_, Gist>| {
            goes_on = goes_on && cached.push(&line.entry).is_ok();
            Ok(())
        })?;
        // A coordinator may have written more between the two readings.
        let comparable = cached.estimator().realisations() == tally.estimator().realisations();
        if goes_on && comparable && cached.estimator().estimate() != tally.estimator().estimate() {
            found.findings.push(format!("{}: not the log's estimates; delete it", cache::CACHE_FILE));
        }
    }
    Ok(())
}

fn first_missing(records: &[Gist]) -> u64 {
    (0..).zip(records).find(|(n, record)| record.index() != *n).map_or(records.len() as u64, |(n, _)| n)
}

fn checksum(record: &Record) -> [u8; 32] {
    let json = serde_json::to_vec(record).expect("a record holds only numbers and words");
    blake3::hash(&json).into()
}

fn named(indices: &[u64]) -> String {
    let mut text: Vec<String> = indices.iter().take(MOST_NAMED).map(u64::to_string).collect();
    if indices.len() > MOST_NAMED {
        text.push("...".to_owned());
    }
    text.join(", ")
}

/// Findings of one file, bounded.
#[derive(Default)]
struct Findings {
    listed: Vec<String>,
    more: u64,
}

impl Findings {
    fn add(&mut self, what: String) {
        if self.listed.len() < MOST_FINDINGS {
            self.listed.push(what);
        } else {
            self.more += 1;
        }
    }

    fn into(mut self, file: &str, found: &mut Verification) {
        if self.more > 0 {
            self.listed.push(format!("and {} more", self.more));
        }
        found.findings.extend(self.listed.into_iter().map(|what| format!("{file}: {what}")));
    }
}
