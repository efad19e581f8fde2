//! The sled database, opened and written with the care that sled 0.34.7 needs.
//!
//! * `flush` is not durable over a power cut (`sync_file_range` only), so every commit also syncs the `db` file, and
//!   the folders are synced once at creation. The background flush is off.
//! * A kill while opening can leave an empty `snap.*.generating`, after which no open succeeds: it is removed.
//! * After a kill -9 the lock can stay busy for a moment: opening is retried for some seconds.
//! * A damaged database can make `open` panic: caught, set aside, and rebuilt by the caller from the outcome log.

use super::log::{Entry, Record};
use super::{StoreError, sync_folder_of};
use crate::queue::Attempts;
use std::collections::BTreeMap;
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

/// What the database holds.
#[derive(Debug, Default)]
pub(super) struct Stored {
    pub(super) records: BTreeMap<u64, Record>,
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

impl Database {
    /// Opens or creates the database; one that does not open is set aside and replaced by an empty one.
    pub(super) fn open(folder: &Path) -> Result<(Database, Stored, Vec<String>), StoreError> {
        let mut notes = Vec::new();
        let first = open_and_read(folder);
        let (database, stored) = match first {
            Ok(opened) => opened,
            // No room or no right to write: a new database would fare no better.
            Err(Failure::System(error)) => {
                return Err(StoreError::File { path: folder.to_owned(), error });
            }
            Err(Failure::Damaged(message)) => {
                let aside =
                    set_aside(folder).map_err(|error| StoreError::File { path: folder.to_owned(), error })?;
                notes.push(format!(
                    "store: sled did not open ({message}); it is kept as {} and rebuilt",
                    aside.display()
                ));
                open_and_read(folder).map_err(|failure| failure.into_error(folder))?
            }
        };
        Ok((database, stored, notes))
    }

    /// Inserts what is missing of `records`; returns how many were.
    pub(super) fn complete(&mut self, records: &BTreeMap<u64, Record>) -> Result<usize, StoreError> {
        let missing: Vec<Entry> = records
            .iter()
            .filter(|(index, _)| !self.outcomes.contains_key(index.to_be_bytes()).unwrap_or(false))
            .map(|(_, record)| Entry::Outcome(record.clone()))
            .collect();
        if !missing.is_empty() {
            self.commit(&missing, &[])?;
        }
        Ok(missing.len())
    }

    pub(super) fn commit(
        &mut self,
        entries: &[Entry],
        attempts: &[(u64, Attempts)],
    ) -> Result<(), StoreError> {
        let written = catch_unwind(AssertUnwindSafe(|| self.write(entries, attempts)));
        written
            .unwrap_or_else(|_| Err(Failure::Damaged("sled panicked while writing".to_owned())))
            .map_err(|failure| failure.into_error(&self.folder))
    }

    fn write(&self, entries: &[Entry], attempts: &[(u64, Attempts)]) -> Result<(), Failure> {
        for entry in entries {
            if let Entry::Outcome(record) = entry {
                let value = serde_json::to_vec(record).expect("a record holds only numbers and words");
                self.outcomes.insert(record.outcome.index.to_be_bytes(), value)?;
            }
        }
        for (index, attempts) in attempts {
            let mut value = [0; 8];
            value[..4].copy_from_slice(&attempts.attempt.to_be_bytes());
            value[4..].copy_from_slice(&attempts.losses.to_be_bytes());
            self.attempts.insert(index.to_be_bytes(), value.to_vec())?;
        }
        self.sled.flush()?;
        self.file.sync_data()?;
        Ok(())
    }

    fn read(&self) -> Result<Stored, Failure> {
        let mut stored = Stored::default();
        for item in &self.outcomes {
            let (key, value) = item?;
            let record: Record = serde_json::from_slice(&value)
                .map_err(|e| Failure::Damaged(format!("an outcome does not parse: {e}")))?;
            if key.as_ref() != record.outcome.index.to_be_bytes() {
                return Err(Failure::Damaged("an outcome stands under another index".to_owned()));
            }
            stored.records.insert(record.outcome.index, record);
        }
        for item in &self.attempts {
            let (key, value) = item?;
            stored.attempts.insert(read_index(&key)?, read_attempts(&value)?);
        }
        Ok(stored)
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

fn open_and_read(folder: &Path) -> Result<(Database, Stored), Failure> {
    fs::create_dir_all(folder)?;
    remove_stale_snapshots(folder)?;
    let opened = catch_unwind(|| {
        let database = open_when_unlocked(folder)?;
        let stored = database.read()?;
        Ok((database, stored))
    });
    opened.unwrap_or_else(|_| Err(Failure::Damaged("sled panicked while opening".to_owned())))
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

fn remove_stale_snapshots(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with("snap.") && name.ends_with(".generating") {
            fs::remove_file(&path)?;
        }
    }
    Ok(())
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
