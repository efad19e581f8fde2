//! Outcomes that survive: every acknowledged outcome is in two synced places, sled and a plain log.
//!
//! The log ([`log`]) comes first and is what everybody else reads; sled ([`database`]) holds outcomes by index and
//! the attempts given out. At opening the two are reconciled, and sled is rebuilt from the log if it does not open.

pub mod database;
pub mod log;

use crate::queue::Attempts;
use crate::rulings::{self, Disputes};
use database::Database;
use log::{Entry, Log, Record};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Name of the outcome log in a run directory.
pub const LOG_FILE: &str = "outcomes.log";
/// Name of the sled database in a run directory.
pub const DATABASE_FOLDER: &str = "store";

/// A store that cannot be opened or written.
#[derive(Debug, Error)]
pub enum StoreError {
    /// Reading, writing or syncing a file failed.
    #[error("{}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// sled failed, and rebuilding it did not help.
    #[error("{}: {message}", path.display())]
    Database {
        /// Its folder.
        path: PathBuf,
        /// What sled said.
        message: String,
    },
}

/// What an opened store holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Contents {
    /// Recorded outcomes by index.
    pub records: BTreeMap<u64, Record>,
    /// Outcomes that came later than the one recorded first, and contradict it.
    pub conflicts: Vec<Record>,
    /// Indices whose second run agreed.
    pub audited: BTreeSet<u64>,
    /// The runs that agreed with the outcome recorded first: index and worker.
    pub audits: Vec<(u64, String)>,
    /// Opinions on contested realisations; see [`rulings`].
    pub disputes: Disputes,
    /// Outcomes that were recorded first and do not count any more.
    pub overruled: BTreeMap<u64, Record>,
    /// Realisations to be run again by another worker: contested and undecided, or recorded by a worker set aside.
    pub doubtful: BTreeSet<u64>,
    /// Attempts given out, by index.
    pub attempts: BTreeMap<u64, Attempts>,
    /// What was damaged or had to be repaired, in words.
    pub notes: Vec<String>,
}

/// The open store of a run directory.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    log: Log,
    database: Database,
}

impl Store {
    /// Opens or creates the store in `folder`, repairing what can be repaired. The caller holds the folder's lock.
    ///
    /// # Errors
    /// The files cannot be read, written or synced.
    pub fn open(folder: &Path) -> Result<(Store, Contents), StoreError> {
        let log_path = folder.join(LOG_FILE);
        let in_log = |error| StoreError::File { path: log_path.clone(), error };
        let (mut log, read) = Log::open(&log_path).map_err(in_log)?;
        let mut contents = collect(read.entries);
        contents.notes.extend(read.damage.into_iter().map(|d| format!("{LOG_FILE}: {d}")));
        let (mut database, stored, notes) = Database::open(&folder.join(DATABASE_FOLDER))?;
        contents.notes.extend(notes);
        contents.attempts = stored.attempts;

        let only_stored: Vec<Entry> = stored
            .records
            .into_iter()
            .filter(|(index, _)| !contents.records.contains_key(index))
            .map(|(_, record)| Entry::Outcome(record))
            .collect();
        if !only_stored.is_empty() {
            contents.notes.push(format!("{LOG_FILE}: {} outcomes restored from sled", only_stored.len()));
            log.append(&only_stored).map_err(in_log)?;
            contents.records.extend(collect(only_stored).records);
        }
        let restored = database.complete(&contents.records)?;
        if restored > 0 {
            contents.notes.push(format!("{DATABASE_FOLDER}: {restored} outcomes restored from {LOG_FILE}"));
        }
        rulings::apply(&mut contents);
        Ok((Store { folder: folder.to_owned(), log, database }, contents))
    }

    /// Makes entries and attempts durable, all in one go; when this returns they survive a power cut.
    ///
    /// # Errors
    /// The disk is full or broken. The store must then be opened anew.
    pub fn commit(&mut self, entries: &[Entry], attempts: &[(u64, Attempts)]) -> Result<(), StoreError> {
        if !entries.is_empty() {
            let failed = |error| StoreError::File { path: self.folder.join(LOG_FILE), error };
            self.log.append(entries).map_err(failed)?;
        }
        self.database.commit(entries, attempts)
    }
}

/// Sorts a log's entries. The first outcome of an index counts, until [`rulings::apply`].
pub fn collect(entries: Vec<Entry>) -> Contents {
    let mut contents = Contents::default();
    for entry in entries {
        match entry {
            Entry::Outcome(record) => {
                contents.records.entry(record.outcome.index).or_insert(record);
            }
            Entry::Conflict(record) => contents.conflicts.push(record),
            Entry::Audit { index, worker } => {
                contents.audited.insert(index);
                contents.audits.push((index, worker));
            }
        }
    }
    contents
}

/// Writes a file so that a reader or a crash sees the old or the new content, never a part.
///
/// # Errors
/// Writing, renaming or syncing fails; a temporary file is removed.
pub fn write_atomically(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".tmp");
    let temporary = path.with_file_name(name);
    let written = File::create(&temporary).and_then(|mut file| {
        file.write_all(content)?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| fs::rename(&temporary, path));
    if renamed.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    renamed?;
    sync_folder_of(path)
}

/// Makes the entry of `path` in its folder durable.
///
/// # Errors
/// The folder cannot be opened or synced.
pub fn sync_folder_of(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    File::open(folder)?.sync_all()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use runout_core::gimp::Energy;
    use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};

    pub(crate) fn record(index: u64) -> Record {
        let x = (index as f64 + 0.1) / 3.0;
        let measures = Measures {
            max_displacement_m: x,
            displacement_q999_m: x,
            toe_advance_m: x,
            crest_retreat_m: x,
            moved_area_m2: x,
            deposit_height_at_toe_m: x,
            time_to_rest_s: Some(x),
        };
        let outcome = Outcome {
            index,
            outcome: OutcomeKind::Runout,
            reason: Reason::AtRest,
            measures: Some(measures),
            energy: Some(Energy { outer_work_j: x, ..Energy::default() }),
            energy_drifted: false,
            simulated_s: x,
            steps: index,
            points: 100,
            digest: format!("{index:032x}"),
        };
        Record { outcome, attempt: 1, worker: "a".into(), wall_s: 0.5 }
    }

    fn outcomes(range: std::ops::Range<u64>) -> Vec<Entry> {
        range.map(|index| Entry::Outcome(record(index))).collect()
    }

    fn indices(contents: &Contents) -> Vec<u64> {
        contents.records.keys().copied().collect()
    }

    #[test]
    fn what_was_committed_is_there_again() {
        let folder = tempfile::tempdir().unwrap();
        let attempts = Attempts { attempt: 2, losses: 1 };
        {
            let (mut store, contents) = Store::open(folder.path()).unwrap();
            assert_eq!(contents, Contents::default());
            store.commit(&outcomes(0..300), &[(7, attempts)]).unwrap();
            store.commit(&[Entry::Audit { index: 2, worker: "b".into() }], &[]).unwrap();
            store.commit(&[Entry::Conflict(record(3))], &[]).unwrap();
        }
        let (_store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(contents.notes, Vec::<String>::new());
        assert_eq!(indices(&contents), (0..300).collect::<Vec<_>>());
        assert_eq!(contents.records[&299], record(299));
        assert_eq!(contents.attempts, BTreeMap::from([(7, attempts)]));
        assert_eq!(contents.audited, BTreeSet::from([2]));
        assert_eq!(contents.conflicts, [record(3)]);
    }

    #[test]
    fn each_place_is_restored_from_the_other() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join(LOG_FILE);
        Store::open(folder.path()).unwrap().0.commit(&outcomes(0..10), &[]).unwrap();
        fs::remove_file(&log).unwrap();
        let (store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(indices(&contents), (0..10).collect::<Vec<_>>());
        assert_eq!(contents.notes, ["outcomes.log: 10 outcomes restored from sled"]);
        drop(store);
        fs::remove_dir_all(folder.path().join(DATABASE_FOLDER)).unwrap();
        let (_store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(contents.notes, ["store: 10 outcomes restored from outcomes.log"]);
        assert_eq!(log::parse(&fs::read(&log).unwrap()).entries, outcomes(0..10));
    }

    #[test]
    fn a_database_that_does_not_open_is_rebuilt() {
        let folder = tempfile::tempdir().unwrap();
        let database = folder.path().join(DATABASE_FOLDER);
        Store::open(folder.path()).unwrap().0.commit(&outcomes(0..10), &[]).unwrap();
        let size = fs::metadata(database.join("conf")).unwrap().len();
        fs::write(database.join("conf"), vec![0x5a; size as usize]).unwrap();
        let (_store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(indices(&contents), (0..10).collect::<Vec<_>>());
        assert!(contents.notes.iter().any(|n| n.contains("rebuilt")), "{:?}", contents.notes);
    }

    #[test]
    fn a_database_whose_data_is_gone_is_completed() {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join(DATABASE_FOLDER).join("db");
        Store::open(folder.path()).unwrap().0.commit(&outcomes(0..10), &[]).unwrap();
        // What a power cut leaves of a file that was not synced: its length, without its content.
        let size = fs::metadata(&data).unwrap().len();
        fs::write(&data, vec![0; size as usize]).unwrap();
        let (store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(indices(&contents), (0..10).collect::<Vec<_>>());
        drop(store);
        let (_store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(contents.notes, Vec::<String>::new());
    }

    #[test]
    fn a_stale_snapshot_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        Store::open(folder.path()).unwrap().0.commit(&outcomes(0..3), &[]).unwrap();
        let stale = folder.path().join(DATABASE_FOLDER).join("snap.0000000000000000.generating");
        fs::write(&stale, b"").unwrap();
        let (_store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(indices(&contents), [0, 1, 2]);
        assert!(!stale.exists());
    }
}
