//! What a log's entries amount to: the outcome that stands for each index, and what else was noted.

use super::log::Entry;
use super::wire::{Form, Gist};
use crate::queue::Attempts;
use crate::rulings::Disputes;
use std::collections::{BTreeMap, BTreeSet};

/// What an opened store, or a log that was read, holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents<R = Gist> {
    /// Recorded outcomes in index order, one an index.
    pub records: Vec<R>,
    /// Outcomes that came later than the one recorded first, and contradict it.
    pub conflicts: Vec<R>,
    /// Indices whose second run agreed.
    pub audited: BTreeSet<u64>,
    /// The runs that agreed with the outcome recorded first: index and worker.
    pub audits: Vec<(u64, String)>,
    /// Opinions on contested realisations; see [`crate::rulings`].
    pub disputes: Disputes,
    /// Outcomes that were recorded first and do not count any more, in index order.
    pub overruled: Vec<R>,
    /// Realisations to be run again by another worker: contested and undecided, or recorded by a worker set aside.
    pub doubtful: BTreeSet<u64>,
    /// Outcomes that were withdrawn, so that their realisations are run again.
    pub withdrawn: Vec<Withdrawal>,
    /// Attempts given out, by index; a log alone does not know them.
    pub attempts: BTreeMap<u64, Attempts>,
    /// What was damaged or had to be repaired, in words.
    pub notes: Vec<String>,
}

impl<R> Default for Contents<R> {
    fn default() -> Contents<R> {
        Contents {
            records: Vec::new(),
            conflicts: Vec::new(),
            audited: BTreeSet::new(),
            audits: Vec::new(),
            disputes: Disputes::new(),
            overruled: Vec::new(),
            doubtful: BTreeSet::new(),
            withdrawn: Vec::new(),
            attempts: BTreeMap::new(),
            notes: Vec::new(),
        }
    }
}

impl<R: Form> Contents<R> {
    /// The recorded outcome of this index.
    pub fn record(&self, index: u64) -> Option<&R> {
        let place = self.records.binary_search_by_key(&index, Form::index).ok()?;
        Some(&self.records[place])
    }
}

/// The name of a recorded outcome that counts no more.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Withdrawal {
    /// Realisation index.
    pub index: u64,
    /// Attempt that gave the outcome.
    pub attempt: u32,
    /// Its digest.
    pub digest: String,
}

impl Withdrawal {
    /// Whether it means this record.
    pub fn names(&self, record: &impl Form) -> bool {
        self.index == record.index() && self.attempt == record.attempt() && self.digest == record.digest()
    }
}

/// Entries in the order of the log, on their way to [`Contents`].
#[derive(Debug)]
pub struct Ledger<R> {
    records: Vec<R>,
    /// With each withdrawal, how many records stood before it.
    withdrawn: Vec<(usize, Withdrawal)>,
    conflicts: Vec<R>,
    audits: Vec<(u64, String)>,
}

impl<R: Form> Ledger<R> {
    /// Nothing yet.
    pub fn new() -> Ledger<R> {
        Ledger { records: Vec::new(), withdrawn: Vec::new(), conflicts: Vec::new(), audits: Vec::new() }
    }

    /// Takes the next entry.
    pub fn push(&mut self, entry: Entry<R>) {
        match entry {
            Entry::Outcome(record) => self.records.push(record),
            Entry::Conflict(record) => self.conflicts.push(record),
            Entry::Audit { index, worker } => self.audits.push((index, worker)),
            Entry::Withdrawn { index, attempt, digest } => {
                self.withdrawn.push((self.records.len(), Withdrawal { index, attempt, digest }));
            }
        }
    }

    /// The outcome that stands for each index until [`crate::rulings::apply`]: the last one, unless it was withdrawn
    /// after that.
    ///
    /// A coordinator records an index again only after a withdrawal. So a second record tells that there was one,
    /// also where its own line is damaged.
    pub fn finish(self) -> Contents<R> {
        let gone = self.gone();
        let Ledger { mut records, withdrawn, conflicts, audits } = self;
        // Stable, and fast where the order is nearly right, as it always is.
        records.sort_by_key(Form::index);
        records.dedup_by(|later, kept| {
            let same = later.index() == kept.index();
            if same {
                std::mem::swap(later, kept);
            }
            same
        });
        if !gone.is_empty() {
            records.retain(|record| !gone.contains(&record.index()));
        }
        let withdrawn = withdrawn.into_iter().map(|(_, withdrawal)| withdrawal).collect();
        let audited = audits.iter().map(|(index, _)| *index).collect();
        Contents { records, conflicts, audited, audits, withdrawn, ..Contents::default() }
    }

    /// Indices whose last record was withdrawn after it.
    fn gone(&self) -> BTreeSet<u64> {
        let mut last: BTreeMap<u64, usize> = BTreeMap::new();
        let named: BTreeSet<u64> = self.withdrawn.iter().map(|(_, w)| w.index).collect();
        if !named.is_empty() {
            let places = self.records.iter().enumerate();
            last.extend(
                places.map(|(place, record)| (record.index(), place)).filter(|(i, _)| named.contains(i)),
            );
        }
        let withdrawn = self.withdrawn.iter().filter(|(before, named)| {
            last.get(&named.index).is_some_and(|place| place < before && named.names(&self.records[*place]))
        });
        withdrawn.map(|(_, named)| named.index).collect()
    }
}

impl<R: Form> Default for Ledger<R> {
    fn default() -> Ledger<R> {
        Ledger::new()
    }
}
