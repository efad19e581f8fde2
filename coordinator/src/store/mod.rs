//! Outcomes that survive: every acknowledged outcome is in two synced places, sled and a plain log.
//!
//! The log ([`log`]) comes first and is what everybody else reads; sled ([`database`]) holds outcomes by index and
//! the attempts given out. At opening the two are reconciled, and sled is rebuilt from the log if it does not open.
//! Memory does not depend on the length of lines, and only [`wire::Gist`]s of the outcomes are kept.

mod blocks;
pub mod contents;
pub mod database;
pub mod log;
pub mod scan;
pub mod wire;

use crate::queue::Attempts;
use crate::rulings;
pub use contents::{Contents, Ledger, Withdrawal};
use database::Database;
use log::{Entry, Log};
use scan::Place;
use std::fs::{self, File};
use std::io::{self, Write};
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;
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

/// The open store of a run directory.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    log: Log,
    database: Database,
}

/// Outcomes that are copied from the log to sled in one go.
const BATCH: usize = 4096;

impl Store {
    /// Opens or creates the store in `folder`, repairing what can be repaired. The caller holds the folder's lock.
    ///
    /// # Errors
    /// The files cannot be read, written or synced.
    pub fn open(folder: &Path) -> Result<(Store, Contents), StoreError> {
        let log_path = folder.join(LOG_FILE);
        let in_log = |error| StoreError::File { path: log_path.clone(), error };
        let mut ledger = Ledger::new();
        // Both are read whole, which takes seconds where there are a million outcomes.
        let (read, opened) = thread::scope(|scope| {
            let database = scope.spawn(|| Database::open(&folder.join(DATABASE_FOLDER)));
            let read = Log::open(&log_path, |entry| ledger.push(entry));
            (read, database.join().unwrap_or_else(|panic| resume_unwind(panic)))
        });
        let (mut log, damage) = read.map_err(in_log)?;
        let (database, listing, notes) = opened?;
        let mut contents = ledger.finish();
        contents.notes.extend(damage.into_iter().map(|d| format!("{LOG_FILE}: {d}")));
        contents.notes.extend(notes);
        let (mut database, stored, note) = database.compare(listing, &contents)?;
        contents.notes.extend(note);
        contents.attempts = stored.attempts;

        if !stored.withdrawn.is_empty() {
            let known: Vec<Entry> = stored.withdrawn.iter().map(withdrawn).collect();
            database.commit(&known, &[])?;
        }
        if !stored.only_here.is_empty() {
            contents
                .notes
                .push(format!("{LOG_FILE}: {} outcomes restored from sled", stored.only_here.len()));
            // The reader of sled has checked their digests.
            contents.records.extend(stored.only_here.iter().filter_map(wire::Gist::of));
            contents.records.sort_by_key(|record| record.index);
            let restored: Vec<Entry> = stored.only_here.into_iter().map(Entry::Outcome).collect();
            log.append(&restored).map_err(in_log)?;
        }
        if !stored.missing.is_empty() {
            let restored = database.complete(&log_path, &stored.missing)?;
            contents.notes.push(format!("{DATABASE_FOLDER}: {restored} outcomes restored from {LOG_FILE}"));
        }
        rulings::apply(&mut contents);
        Ok((Store { folder: folder.to_owned(), log, database }, contents))
    }

    /// Makes entries and attempts durable, all in one go; when this returns they survive a power cut. An attempt number
    /// that is below the one kept changes nothing.
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

    /// Its folder: the run directory.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The end of the outcome log.
    pub fn end(&self) -> Place {
        self.log.end()
    }
}

/// The line that a withdrawal is in the log.
fn withdrawn(named: &Withdrawal) -> Entry {
    let Withdrawal { index, attempt, digest } = named.clone();
    Entry::Withdrawn { index, attempt, digest }
}

/// Reads the whole log at `path`: what it amounts to, and whether it is sound.
///
/// # Errors
/// Reading fails.
pub fn read_log<R: wire::Form + Send>(path: &Path) -> io::Result<(Contents<R>, scan::Scan)> {
    let mut ledger = Ledger::new();
    let scan = blocks::read_entries(path, |entry| ledger.push(entry))?;
    let mut contents = ledger.finish();
    rulings::apply(&mut contents);
    Ok((contents, scan))
}

/// Writes a file so that a reader or a crash sees the old or the new content, never a part.
///
/// # Errors
/// Writing, renaming or syncing fails; a temporary file is removed.
pub fn write_atomically(path: &Path, content: &[u8]) -> io::Result<()> {
    write_atomically_with(path, |file| file.write_all(content))
}

/// As [`write_atomically`], with what `write` writes.
///
/// # Errors
/// As [`write_atomically`], or `write` fails.
pub fn write_atomically_with<T>(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<T>,
) -> io::Result<()> {
    write_atomically_unsynced(path, |file| {
        write(file)?;
        file.sync_all()
    })?;
    sync_folder_of(path)
}

/// As [`write_atomically_with`], for what may be lost or torn by a power cut.
///
/// # Errors
/// Writing or renaming fails; a temporary file is removed.
pub fn write_atomically_unsynced(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".tmp");
    let temporary = path.with_file_name(name);
    let written = File::create(&temporary).and_then(|mut file| write(&mut file));
    let renamed = written.and_then(|()| fs::rename(&temporary, path));
    if renamed.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    renamed
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
    use super::log::Record;
    use super::*;
    use runout_core::gimp::Energy;
    use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
    use runout_core::profile::Profile;
    use std::collections::{BTreeMap, BTreeSet};

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
            profile: index.is_multiple_of(2).then(|| Profile {
                column_m: 0.5,
                depth_mm: vec![index as u32, 7],
                speed_mm_s: vec![1],
            }),
            digest: format!("{index:032x}"),
        };
        Record { outcome, attempt: 1, worker: "a".into(), wall_s: 0.5 }
    }

    fn outcomes(range: std::ops::Range<u64>) -> Vec<Entry> {
        range.map(|index| Entry::Outcome(record(index))).collect()
    }

    fn indices(contents: &Contents) -> Vec<u64> {
        contents.records.iter().map(|record| record.index).collect()
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
        assert_eq!(contents.records[299], wire::Gist::of(&record(299)).unwrap());
        assert_eq!(contents.attempts, BTreeMap::from([(7, attempts)]));
        assert_eq!(contents.audited, BTreeSet::from([2]));
        assert_eq!(contents.conflicts, [wire::Gist::of(&record(3)).unwrap()]);
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
        let (read, scan) = read_log::<Record>(&log).unwrap();
        assert!(scan.is_sound());
        assert_eq!(read.records, (0..10).map(record).collect::<Vec<_>>());
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

    fn withdrawal(of: &Record) -> Entry {
        let (index, digest) = (of.outcome.index, of.outcome.digest.clone());
        Entry::Withdrawn { index, attempt: of.attempt, digest }
    }

    #[test]
    fn what_was_withdrawn_is_open_until_it_is_recorded_again() {
        let folder = tempfile::tempdir().unwrap();
        let again = Record { attempt: 2, ..record(4) };
        let mut store = Store::open(folder.path()).unwrap().0;
        store.commit(&outcomes(0..10), &[]).unwrap();
        store.commit(&[withdrawal(&record(4))], &[]).unwrap();
        drop(store);
        let (mut store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(contents.notes, Vec::<String>::new());
        assert_eq!(indices(&contents), [0, 1, 2, 3, 5, 6, 7, 8, 9]);
        assert_eq!(contents.withdrawn.len(), 1);
        store.commit(&[Entry::Outcome(again.clone())], &[]).unwrap();
        drop(store);
        let (_store, contents) = Store::open(folder.path()).unwrap();
        assert_eq!(contents.notes, Vec::<String>::new());
        assert_eq!((contents.records.len(), contents.records[4].attempt), (10, 2));

        // Without the withdrawal's line, the later outcome still stands.
        let log = folder.path().join(LOG_FILE);
        let text = fs::read_to_string(&log).unwrap();
        fs::write(&log, text.replace("withdrawn", "withdrawm")).unwrap();
        let (read, scan) = read_log::<Record>(&log).unwrap();
        assert!(!scan.is_sound());
        assert_eq!(read.records[4], again);
    }

    #[test]
    fn a_withdrawal_that_reached_only_the_log_is_completed_in_sled() {
        let folder = tempfile::tempdir().unwrap();
        Store::open(folder.path()).unwrap().0.commit(&outcomes(0..3), &[]).unwrap();
        let mut log = fs::OpenOptions::new().append(true).open(folder.path().join(LOG_FILE)).unwrap();
        log.write_all(log::line(&withdrawal(&record(1))).as_bytes()).unwrap();
        for _ in 0..2 {
            let (_store, contents) = Store::open(folder.path()).unwrap();
            assert_eq!(contents.notes, Vec::<String>::new());
            assert_eq!(indices(&contents), [0, 2]);
        }
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
