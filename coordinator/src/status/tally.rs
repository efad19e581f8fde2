//! An outcome log folded: everything that `runout status` tells of it, without its outcomes.
//!
//! The coordinator's engine folds the same entries for itself. A tally is folded where the log is written or read, so
//! that it always belongs to a place in the log.

use crate::essence::Essence;
use crate::queue;
use crate::run_directory::RunDirectoryError;
use crate::store::log::Entry;
use crate::store::scan::{Line, Place, scan_file};
use crate::store::wire::{self, Gist};
use crate::store::{self, Contents, LOG_FILE};
use runout_core::campaign::Campaign;
use runout_core::estimate::{Decision, Estimator};
use runout_core::outcome::{Outcome, Reason};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::cache;

/// A log, folded up to some place.
#[derive(Debug, Clone)]
pub struct Tally {
    pub(super) seed: u64,
    pub(super) audit_fraction: f64,
    pub(super) estimator: Estimator,
    /// Outcomes beyond the prefix, or beyond the one that decided.
    pub(super) ahead: BTreeMap<u64, Outcome>,
    /// Indices chosen for an audit and recorded, but not compared.
    pub(super) due: BTreeSet<u64>,
    pub(super) audited: BTreeSet<u64>,
    pub(super) conflicts: u64,
}

/// An outcome that was folded has been withdrawn or contradicted: the log must be read from its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reopened;

impl Tally {
    /// An empty log's.
    pub fn new(campaign: &Campaign) -> Tally {
        Tally {
            seed: campaign.seed,
            audit_fraction: campaign.run.audit_fraction,
            estimator: Estimator::new(&campaign.stop, &campaign.model.sample, &campaign.run),
            ahead: BTreeMap::new(),
            due: BTreeSet::new(),
            audited: BTreeSet::new(),
            conflicts: 0,
        }
    }

    /// Of a log that was read from its start.
    pub fn of(campaign: &Campaign, contents: &Contents) -> Tally {
        let mut tally = Tally::new(campaign);
        contents.records.iter().for_each(|record| tally.outcome(record));
        contents.audited.iter().for_each(|index| tally.audit(*index));
        tally.conflicts = contents.conflicts.len() as u64;
        tally.due.retain(|index| !contents.disputes.contains_key(index));
        tally.due.extend(&contents.doubtful);
        tally
    }

    /// Takes the next entry of the log.
    ///
    /// # Errors
    /// It takes back what was folded, or it or an earlier one contradicts that, so that [`crate::rulings`] on the whole
    /// log decide what counts; the tally is then of no more use.
    pub fn push(&mut self, entry: &Entry<Gist>) -> Result<(), Reopened> {
        match entry {
            _ if self.conflicts > 0 => return Err(Reopened),
            Entry::Outcome(record) => self.outcome(record),
            Entry::Audit { index, .. } => self.audit(*index),
            Entry::Conflict(_) | Entry::Withdrawn { .. } => return Err(Reopened),
        }
        Ok(())
    }

    /// The estimates over the prefix.
    pub fn estimator(&self) -> &Estimator {
        &self.estimator
    }

    /// Outcomes recorded beyond the prefix.
    pub fn ahead(&self) -> u64 {
        self.ahead.len() as u64
    }

    /// Outcomes that contradict a recorded one.
    pub fn conflicts(&self) -> u64 {
        self.conflicts
    }

    /// Realisations that were run twice and gave the same bits.
    pub fn audits_agreed(&self) -> u64 {
        self.audited.len() as u64
    }

    /// Realisations of the results chosen for that and not run twice: as the queue counts them.
    pub fn audits_due(&self) -> u64 {
        let over = self.estimator.decision() != Decision::Continue;
        let end = if over { self.estimator.realisations() } else { u64::MAX };
        self.due.range(..end).count() as u64
    }

    fn outcome(&mut self, record: &Gist) {
        let index = record.index;
        // The same outcome again, as in two logs put together.
        if index < self.estimator.realisations() || self.ahead.contains_key(&index) {
            return;
        }
        if record.reason != Reason::Poison && queue::is_audited(self.seed, self.audit_fraction, index) {
            self.due.insert(index);
        }
        let outcome = Essence::of_gist(record).outcome(index);
        if self.estimator.decision() != Decision::Continue || index != self.estimator.next_index() {
            self.ahead.insert(index, outcome);
            return;
        }
        let mut next = Some(outcome);
        while let Some(outcome) = next {
            self.estimator.push(&outcome).expect("the outcome is the next one");
            let goes_on = self.estimator.decision() == Decision::Continue;
            next = if goes_on { self.ahead.remove(&self.estimator.next_index()) } else { None };
        }
    }

    fn audit(&mut self, index: u64) {
        self.due.remove(&index);
        self.audited.insert(index);
    }
}

/// The tally of the log in the run directory `path`, and what is damaged of what was read: all of the log, or what
/// stands behind its cached estimates if there are any that match.
///
/// # Errors
/// The log cannot be read.
pub fn read(path: &Path, key: &str, campaign: &Campaign) -> Result<(Tally, Vec<String>), RunDirectoryError> {
    let log = path.join(LOG_FILE);
    let failed = |error| RunDirectoryError::File { path: log.clone(), error };
    if let Some((mut tally, from)) = cache::load(path, key, campaign) {
        let mut going_on = Ok(());
        let scan = scan_file(&log, from, |line: Line<'_, Gist>| {
            going_on = going_on.and_then(|()| tally.push(&line.entry));
            Ok(())
        });
        let scan = scan.map_err(failed)?;
        if going_on.is_ok() {
            return Ok((tally, scan.into_damage()));
        }
    }
    let (contents, scan) = store::read_log::<Gist>(&log).map_err(failed)?;
    Ok((Tally::of(campaign, &contents), scan.into_damage()))
}

/// Keeps the tally of a log that is being written, and caches it from time to time.
#[derive(Debug)]
pub struct Keeper {
    tally: Option<Tally>,
    key: String,
    cached: u64,
}

impl Keeper {
    /// Of a log that stands where `tally` was folded.
    pub fn new(tally: Tally, key: String) -> Keeper {
        Keeper { tally: Some(tally), key, cached: 0 }
    }

    /// Takes entries that are durable now; `end` is the log's end behind them.
    pub fn committed(&mut self, folder: &Path, entries: &[Entry], end: Place) {
        for entry in entries {
            if let Some(tally) = &mut self.tally
                && wire::gist(entry).is_none_or(|gist| tally.push(&gist).is_err())
            {
                self.tally = None;
            }
        }
        if end.bytes - self.cached.min(end.bytes) > cache::WORTHWHILE_BYTES {
            self.save(folder, end);
        }
    }

    /// The log is written no more.
    pub fn close(&mut self, folder: &Path, end: Place) {
        if end.bytes > cache::WORTHWHILE_BYTES {
            self.save(folder, end);
        }
    }

    fn save(&mut self, folder: &Path, end: Place) {
        let Some(tally) = &self.tally else { return };
        self.cached = end.bytes;
        if let Err(error) = cache::save(folder, &self.key, tally, end) {
            tracing::debug!("{}: {error}", cache::CACHE_FILE);
        }
    }
}
