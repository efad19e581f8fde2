//! A log line's JSON, read whole ([`Record`]) or only as far as a coordinator needs it to go on ([`Gist`]).
//!
//! The gist of a line costs a third of the time and memory of the whole: most of a line is energies and other numbers
//! that only tables show. Lines are read into one flat form, because serde keeps a copy of everything in an enum whose
//! tag stands among its fields.

use super::log::{Entry, Record};
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::sync::Arc;

/// What a coordinator needs of a recorded outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Gist {
    /// Realisation index.
    pub index: u64,
    /// What became of it.
    pub outcome: OutcomeKind,
    /// Why the analysis ended.
    pub reason: Reason,
    /// What moved.
    pub measures: Option<Measures>,
    /// Whether the balance of energy drifted beyond the limit.
    pub energy_drifted: bool,
    /// Digest, 32 hexadecimal digits as a number.
    pub digest: u128,
    /// Attempt that gave it.
    pub attempt: u32,
    /// Worker that ran it.
    pub worker: Arc<str>,
    /// Wall time of the computation, s.
    pub wall_s: f64,
}

impl Gist {
    /// The gist of a record; none if its digest is not of 32 hexadecimal digits.
    pub fn of(record: &Record) -> Option<Gist> {
        let Outcome { index, outcome, reason, measures, energy_drifted, ref digest, .. } = record.outcome;
        let part =
            OutcomeGist { index, outcome, reason, measures, energy_drifted, digest: digest_of(digest)? };
        Gist::new(part, record.attempt, &record.worker, record.wall_s)
    }

    /// The digest as it is written.
    pub fn digest_text(&self) -> String {
        format!("{:032x}", self.digest)
    }
}

/// A record in one of its two forms.
pub trait Form: Clone {
    /// The part of a line that holds the outcome.
    type Outcome: DeserializeOwned;

    /// Puts it together; none if it cannot be a record.
    fn new(outcome: Self::Outcome, attempt: u32, worker: &str, wall_s: f64) -> Option<Self>;

    /// Realisation index.
    fn index(&self) -> u64;

    /// Attempt that gave it.
    fn attempt(&self) -> u32;

    /// Digest of the outcome.
    fn digest(&self) -> Cow<'_, str>;

    /// Worker that ran it.
    fn worker(&self) -> &str;
}

impl Form for Record {
    type Outcome = Outcome;

    fn new(outcome: Outcome, attempt: u32, worker: &str, wall_s: f64) -> Option<Record> {
        Some(Record { outcome, attempt, worker: worker.to_owned(), wall_s })
    }

    fn index(&self) -> u64 {
        self.outcome.index
    }

    fn attempt(&self) -> u32 {
        self.attempt
    }

    fn digest(&self) -> Cow<'_, str> {
        Cow::Borrowed(&self.outcome.digest)
    }

    fn worker(&self) -> &str {
        &self.worker
    }
}

/// The part of an outcome that a [`Gist`] keeps.
#[derive(Debug, Deserialize)]
pub struct OutcomeGist {
    index: u64,
    outcome: OutcomeKind,
    reason: Reason,
    measures: Option<Measures>,
    energy_drifted: bool,
    #[serde(deserialize_with = "read_digest")]
    digest: u128,
}

fn read_digest<'de, D: Deserializer<'de>>(text: D) -> Result<u128, D::Error> {
    let wrong = || D::Error::custom("a digest has 32 hexadecimal digits");
    digest_of(<&str>::deserialize(text)?).ok_or_else(wrong)
}

fn digest_of(text: &str) -> Option<u128> {
    (text.len() == 32).then(|| u128::from_str_radix(text, 16).ok())?
}

impl Form for Gist {
    type Outcome = OutcomeGist;

    fn new(outcome: OutcomeGist, attempt: u32, worker: &str, wall_s: f64) -> Option<Gist> {
        let OutcomeGist { index, outcome, reason, measures, energy_drifted, digest } = outcome;
        let worker = Arc::from(worker);
        Some(Gist { index, outcome, reason, measures, energy_drifted, digest, attempt, worker, wall_s })
    }

    fn index(&self) -> u64 {
        self.index
    }

    fn attempt(&self) -> u32 {
        self.attempt
    }

    fn digest(&self) -> Cow<'_, str> {
        Cow::Owned(self.digest_text())
    }

    fn worker(&self) -> &str {
        &self.worker
    }
}

/// An entry as a coordinator will read it; none if it will not be readable.
pub fn gist(entry: &Entry) -> Option<Entry<Gist>> {
    Some(match entry {
        Entry::Outcome(record) => Entry::Outcome(Gist::of(record)?),
        Entry::Conflict(record) => Entry::Conflict(Gist::of(record)?),
        Entry::Audit { index, worker } => Entry::Audit { index: *index, worker: worker.clone() },
        Entry::Withdrawn { index, attempt, digest } => {
            Entry::Withdrawn { index: *index, attempt: *attempt, digest: digest.clone() }
        }
    })
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Outcome,
    Conflict,
    Audit,
    Withdrawn,
}

/// A line, whatever its kind.
#[derive(Deserialize)]
struct Flat<'a, O> {
    kind: Kind,
    outcome: Option<O>,
    attempt: Option<u32>,
    #[serde(borrow)]
    worker: Option<Cow<'a, str>>,
    wall_s: Option<f64>,
    index: Option<u64>,
    digest: Option<String>,
}

/// The entry in a line's JSON; none if its form is wrong.
pub(super) fn parse<R: Form>(json: &[u8]) -> Option<Entry<R>> {
    let flat: Flat<'_, R::Outcome> = serde_json::from_slice(json).ok()?;
    let Flat { kind, outcome, attempt, worker, wall_s, index, digest } = flat;
    Some(match kind {
        Kind::Outcome => Entry::Outcome(R::new(outcome?, attempt?, &worker?, wall_s?)?),
        Kind::Conflict => Entry::Conflict(R::new(outcome?, attempt?, &worker?, wall_s?)?),
        Kind::Audit => Entry::Audit { index: index?, worker: worker?.into_owned() },
        Kind::Withdrawn => Entry::Withdrawn { index: index?, attempt: attempt?, digest: digest? },
    })
}
