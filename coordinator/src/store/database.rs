//! The sled database, opened and written with the care that sled 0.34.7 needs.
//!
//! * `flush` is not durable over a power cut (`sync_file_range` only), so every commit also syncs the `db` file, and
//!   the folders are synced once at creation. The background flush is off.
//! * A kill while opening can leave an empty `snap.*.generating`, after which no open succeeds: it is removed.
//! * After a kill -9 the lock can stay busy for a moment: opening is retried for some seconds.
//! * A damaged database can make `open` panic: caught, set aside, and rebuilt by the caller from the outcome log.

use super::contents::{Contents, Withdrawal};
use super::log::{Entry, Record};
use super::scan::{Line, Place, scan_file};
use super::{BATCH, StoreError, sync_folder_of};
use crate::queue::Attempts;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

/// Page cache: sled's default of 1 GiB is far more than a campaign's outcomes.
const CACHE_BYTES: u64 = 64 << 20;
/// How long a busy lock is waited for: a killed process's lock goes with its last file handle.
const LOCK_PATIENCE: Duration = Duration::from_secs(10);
const LOCK_RETRY: Duration = Duration::from_millis(50);

/// How what the database holds compares with the log.
#[derive(Debug, Default)]
pub(super) struct Stored {
    /// Outcomes that the log has not.
    pub(super) only_here: Vec<Record>,
    /// Outcomes that the log has withdrawn.
    pub(super) withdrawn: Vec<Withdrawal>,
    /// Indices of which the log has an outcome and the database none, or another one.
    pub(super) missing: BTreeSet<u64>,
    /// Attempts given out.
    pub(super) attempts: BTreeMap<u64, Attempts>,
}

#[derive(Debug)]
pub(super) struct Database {
    folder: PathBuf,
    sled: sled::Db,
    outcomes: sled::Tree,
    attempts: sled::Tree,
    /// sled's own data file, for syncing.
    file: File,
}

/// What a database holds, without the outcomes themselves.
#[derive(Debug, Default)]
pub(super) struct Listing {
    /// Indices in order, each with its outcome's digest if that can be read.
    outcomes: Vec<(u64, Option<[u8; 16]>)>,
    attempts: BTreeMap<u64, Attempts>,
}

impl Database {
    /// Opens or creates the database and reads all of it, so that every page's own checksum is checked; one that does
    /// not open is set aside and replaced by an empty one. The notes say what was done.
    pub(super) fn open(folder: &Path) -> Result<(Database, Listing, Vec<String>), StoreError> {
        let in_folder = |error| StoreError::File { path: folder.to_owned(), error };
        let mut notes = Vec::new();
        if remove_stale_snapshots(folder).map_err(in_folder)? > 0 {
            notes.push("store: a stale snapshot, left by a kill, is removed".to_owned());
        }
        match guarded("opening", || open_and_list(folder)) {
            Ok((database, listing)) => Ok((database, listing, notes)),
            Err(failure) => {
                let (database, listing, note) = replace(folder, failure)?;
                notes.push(note);
                Ok((database, listing, notes))
            }
        }
    }

    /// Holds what was listed against the log's records. A database with an outcome that the log lacks and that cannot be
    /// read is set aside and replaced by an empty one; the note says so.
    pub(super) fn compare(
        self,
        listing: Listing,
        log: &Contents,
    ) -> Result<(Database, Stored, Option<String>), StoreError> {
        let failure = match guarded("reading", || self.differences(listing, log)) {
            Ok(stored) => return Ok((self, stored, None)),
            Err(failure) => failure,
        };
        let folder = self.folder.clone();
        drop(self);
        let (database, listing, note) = replace(&folder, failure)?;
        let stored = database.differences(listing, log).map_err(|failure| failure.into_error(&folder))?;
        Ok((database, stored, Some(note)))
    }

    /// Inserts the outcomes of the `missing` indices from the log at `path`; returns how many were.
    pub(super) fn complete(&mut self, path: &Path, missing: &BTreeSet<u64>) -> Result<usize, StoreError> {
        let mut batch: Vec<Entry> = Vec::new();
        let mut failed = None;
        let read = scan_file(path, Place::default(), |line: Line<'_, Record>| {
            // A later outcome of the same index takes the place of an earlier one, as it does in the log.
            if matches!(&line.entry, Entry::Outcome(record) if missing.contains(&record.outcome.index)) {
                batch.push(line.entry);
            }
            if batch.len() >= BATCH {
                failed = self.commit(&std::mem::take(&mut batch), &[]).err();
            }
            if failed.is_some() { Err(io::ErrorKind::Interrupted.into()) } else { Ok(()) }
        });
        if let Some(error) = failed {
            return Err(error);
        }
        read.map_err(|error| StoreError::File { path: path.to_owned(), error })?;
        self.commit(&batch, &[])?;
        Ok(missing.len())
    }

    pub(super) fn commit(
        &mut self,
        entries: &[Entry],
        attempts: &[(u64, Attempts)],
    ) -> Result<(), StoreError> {
        guarded("writing", || self.write(entries, attempts))
            .map_err(|failure| failure.into_error(&self.folder))
    }

    fn write(&self, entries: &[Entry], attempts: &[(u64, Attempts)]) -> Result<(), Failure> {
        for entry in entries {
            match entry {
                Entry::Outcome(record) => {
                    let value = serde_json::to_vec(record).expect("a record holds only numbers and words");
                    self.outcomes.insert(record.outcome.index.to_be_bytes(), value)?;
                }
                Entry::Withdrawn { index, .. } => {
                    self.outcomes.remove(index.to_be_bytes())?;
                }
                Entry::Conflict(_) | Entry::Audit { .. } => {}
            }
        }
        for (index, attempts) in attempts {
            // A reservation may come after what it was made for.
            let before =
                self.attempts.get(index.to_be_bytes())?.map(|value| read_attempts(&value)).transpose()?;
            if before.is_some_and(|before| before.attempt > attempts.attempt) {
                continue;
            }
            let mut value = [0; 8];
            value[..4].copy_from_slice(&attempts.attempt.to_be_bytes());
            value[4..].copy_from_slice(&attempts.losses.to_be_bytes());
            self.attempts.insert(index.to_be_bytes(), value.to_vec())?;
        }
        self.sled.flush()?;
        self.file.sync_data()?;
        Ok(())
    }

    fn list(&self) -> Result<Listing, Failure> {
        let mut listing = Listing::default();
        for item in &self.outcomes {
            let (key, value) = item?;
            listing.outcomes.push((read_index(&key)?, digest_in(&value).map(u128::to_be_bytes)));
        }
        for item in &self.attempts {
            let (key, value) = item?;
            listing.attempts.insert(read_index(&key)?, read_attempts(&value)?);
        }
        Ok(listing)
    }

    /// Walks the listing beside the log's records. An outcome is parsed only where the log has none for its index.
    fn differences(&self, listing: Listing, log: &Contents) -> Result<Stored, Failure> {
        let mut stored = Stored { attempts: listing.attempts, ..Stored::default() };
        let mut records = log.records.iter().peekable();
        for (index, digest) in listing.outcomes {
            while let Some(record) = records.next_if(|record| record.index < index) {
                stored.missing.insert(record.index);
            }
            match records.next_if(|record| record.index == index) {
                Some(record) if digest == Some(record.digest.to_be_bytes()) => {}
                Some(record) => {
                    stored.missing.insert(record.index);
                }
                None => {
                    let value = self.outcomes.get(index.to_be_bytes())?;
                    let gone = || Failure::Damaged("an outcome that was listed is gone".to_owned());
                    let record = read_record(index, &value.ok_or_else(gone)?)?;
                    match log.withdrawn.iter().find(|named| named.names(&record)) {
                        Some(named) => stored.withdrawn.push(named.clone()),
                        None => stored.only_here.push(record),
                    }
                }
            }
        }
        stored.missing.extend(records.map(|record| record.index));
        Ok(stored)
    }
}

/// Every outcome of the database in `folder`, which nobody else uses.
///
/// # Errors
/// It does not open, or something in it is damaged, in words.
pub(crate) fn read_all(folder: &Path, mut each: impl FnMut(Record)) -> Result<(), String> {
    let read = guarded("opening", || {
        let database = open_when_unlocked(folder)?;
        for item in &database.outcomes {
            let (key, value) = item?;
            each(read_record(read_index(&key)?, &value)?);
        }
        Ok(())
    });
    read.map_err(|failure| match failure {
        Failure::System(error) => error.to_string(),
        Failure::Damaged(message) => message,
    })
}

/// The digest of a stored outcome. It is the only text of so many digits in it but the worker's name, which does not
/// stand behind this key.
fn digest_in(value: &[u8]) -> Option<u128> {
    const KEY: &[u8] = b"\"digest\":\"";
    let place = value.windows(KEY.len()).rposition(|window| window == KEY)?;
    let digits = value.get(place + KEY.len()..place + KEY.len() + 32)?;
    u128::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()
}

fn read_record(index: u64, value: &[u8]) -> Result<Record, Failure> {
    let record: Record = serde_json::from_slice(value)
        .map_err(|e| Failure::Damaged(format!("an outcome does not parse: {e}")))?;
    if record.outcome.index == index {
        Ok(record)
    } else {
        Err(Failure::Damaged("an outcome stands under another index".to_owned()))
    }
}

enum Failure {
    System(io::Error),
    Damaged(String),
}

impl Failure {
    fn into_error(self, folder: &Path) -> StoreError {
        let path = folder.to_owned();
        match self {
            Failure::System(error) => StoreError::File { path, error },
            Failure::Damaged(message) => StoreError::Database { path, message },
        }
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Failure {
        Failure::System(error)
    }
}

impl From<sled::Error> for Failure {
    fn from(error: sled::Error) -> Failure {
        match error {
            // sled reports a truncated file as an unexpected end, which is damage, not the system's refusal.
            sled::Error::Io(e) if e.kind() != io::ErrorKind::UnexpectedEof => Failure::System(e),
            other => Failure::Damaged(other.to_string()),
        }
    }
}

fn open_and_list(folder: &Path) -> Result<(Database, Listing), Failure> {
    fs::create_dir_all(folder)?;
    let database = open_when_unlocked(folder)?;
    let listing = database.list()?;
    Ok((database, listing))
}

/// What `work` gives; damage if sled panics in it.
fn guarded<T>(doing: &str, work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    let panicked = |_| Err(Failure::Damaged(format!("sled panicked while {doing}")));
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(panicked)
}

/// Sets a damaged database aside and opens an empty one in its place; says so.
fn replace(folder: &Path, failure: Failure) -> Result<(Database, Listing, String), StoreError> {
    let in_folder = |error| StoreError::File { path: folder.to_owned(), error };
    let message = match failure {
        Failure::Damaged(message) => message,
        // No room or no right to write: a new database would fare no better.
        Failure::System(error) => return Err(in_folder(error)),
    };
    let aside = set_aside(folder).map_err(in_folder)?;
    let note = format!("store: sled did not open ({message}); it is kept as {} and rebuilt", aside.display());
    let opened = guarded("opening", || open_and_list(folder));
    let (database, listing) = opened.map_err(|failure| failure.into_error(folder))?;
    Ok((database, listing, note))
}

fn open_when_unlocked(folder: &Path) -> Result<Database, Failure> {
    let started = Instant::now();
    let config = sled::Config::new().path(folder).cache_capacity(CACHE_BYTES).flush_every_ms(None);
    let sled = loop {
        match config.open() {
            Ok(sled) => break sled,
            // sled gives a busy lock as an error of kind Other with this text.
            Err(sled::Error::Io(e))
                if e.to_string().contains("lock") && started.elapsed() < LOCK_PATIENCE =>
            {
                thread::sleep(LOCK_RETRY);
            }
            Err(e) => return Err(e.into()),
        }
    };
    let (outcomes, attempts) = (sled.open_tree("outcomes")?, sled.open_tree("attempts")?);
    sled.flush()?;
    let file = File::open(folder.join("db"))?;
    file.sync_all()?;
    File::open(folder)?.sync_all()?;
    sync_folder_of(folder)?;
    Ok(Database { folder: folder.to_owned(), sled, outcomes, attempts, file })
}

/// Removes what a kill while sled opened has left; returns how many files that were.
fn remove_stale_snapshots(folder: &Path) -> io::Result<usize> {
    let mut removed = 0;
    let entries = match fs::read_dir(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(0),
        other => other?,
    };
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with("snap.") && name.ends_with(".generating") {
            fs::remove_file(&path)?;
            removed += 1;
        }
    }
    Ok(removed)
}

fn set_aside(folder: &Path) -> io::Result<PathBuf> {
    let aside = (1_u32..)
        .map(|n| folder.with_extension(format!("damaged-{n}")))
        .find(|p| !p.exists())
        .expect("some number is free");
    fs::rename(folder, &aside)?;
    Ok(aside)
}

fn read_index(key: &[u8]) -> Result<u64, Failure> {
    let bytes = key.try_into().map_err(|_| Failure::Damaged("a key is not an index".to_owned()))?;
    Ok(u64::from_be_bytes(bytes))
}

fn read_attempts(value: &[u8]) -> Result<Attempts, Failure> {
    let word = |range: std::ops::Range<usize>| {
        let bytes = value.get(range).and_then(|b| b.try_into().ok());
        bytes.map(u32::from_be_bytes).ok_or_else(|| Failure::Damaged("attempts do not parse".to_owned()))
    };
    Ok(Attempts { attempt: word(0..4)?, losses: word(4..8)? })
}
