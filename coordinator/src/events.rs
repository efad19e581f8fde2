//! `events.log`: when what happened to which realisation and worker, one JSON object a line.
//!
//! For people (`runout explain`, `runout workers`) and scripts: no result rests on it. It is appended to and never
//! synced, so that a power cut may cost its last seconds; each line stands for itself. When it has grown to
//! [`LIMIT_BYTES`] it becomes `events.log.1`, which takes the place of an older one.

use crate::machine::Machine;
use crate::store::log::{Entry, Record};
use runout_core::outcome::Reason;
use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Name of the file in a run directory.
pub const EVENTS_FILE: &str = "events.log";
/// Name of the file before.
pub const OLD_EVENTS_FILE: &str = "events.log.1";
/// Size at which a new file is begun: more than a million realisations without a fault.
pub const LIMIT_BYTES: u64 = 256 << 20;

/// What happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum What {
    /// A coordinator began to work on the run directory; leases of the one before are over unless workers still
    /// hold them.
    Started {
        /// Its build.
        build: String,
        /// Outcomes recorded by then.
        outcomes: u64,
    },
    /// A worker registered.
    Registered {
        /// Its name.
        worker: String,
        /// Realisations at a time.
        slots: u32,
        /// Leases that it still holds from before.
        held: u64,
        /// What it runs on; absent if it did not tell.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        machine: Option<Machine>,
    },
    /// A worker left in good order.
    Left {
        /// Its name.
        worker: String,
    },
    /// A worker was given up: its process died, or its heartbeats are missing. Its leases are lost.
    WorkerLost {
        /// Its name.
        worker: String,
    },
    /// An index was leased to a worker.
    Leased {
        /// Realisation index.
        index: u64,
        /// Attempt.
        attempt: u32,
        /// Worker.
        worker: String,
    },
    /// A worker gave a lease back in good order, or because the computation broke.
    Released {
        /// Realisation index.
        index: u64,
        /// Attempt.
        attempt: u32,
        /// Worker.
        worker: String,
        /// How it broke; that is an unexpected loss.
        error: Option<String>,
    },
    /// A realisation took no more steps; its worker was told to end it. That is an unexpected loss.
    Hung {
        /// Realisation index.
        index: u64,
        /// Worker.
        worker: String,
    },
    /// An outcome was recorded.
    Recorded {
        /// Realisation index.
        index: u64,
        /// Attempt; 0 if the coordinator gave the index up.
        attempt: u32,
        /// Worker.
        worker: String,
        /// Why the analysis ended.
        reason: Reason,
        /// Wall time of the computation, s.
        wall_s: f64,
    },
    /// A second run of an index gave the same digest.
    Audited {
        /// Realisation index.
        index: u64,
        /// Worker.
        worker: String,
    },
    /// A second outcome of an index has another digest; the worker was set aside.
    Conflict {
        /// Realisation index.
        index: u64,
        /// Attempt.
        attempt: u32,
        /// Worker.
        worker: String,
    },
    /// An outcome arrived that was recorded before with the same digest.
    Duplicate {
        /// Realisation index.
        index: u64,
        /// Attempt.
        attempt: u32,
        /// Worker.
        worker: String,
    },
    /// An outcome arrived that nobody waits for.
    NotWanted {
        /// Realisation index.
        index: u64,
        /// Attempt.
        attempt: u32,
        /// Worker.
        worker: String,
    },
    /// An index took several workers down: it is recorded as failed.
    Poisoned {
        /// Realisation index.
        index: u64,
    },
    /// A recorded outcome was withdrawn by `runout retry`.
    Withdrawn {
        /// Realisation index.
        index: u64,
    },
}

impl What {
    /// The index that it is about.
    pub fn index(&self) -> Option<u64> {
        match self {
            What::Leased { index, .. }
            | What::Released { index, .. }
            | What::Hung { index, .. }
            | What::Recorded { index, .. }
            | What::Audited { index, .. }
            | What::Conflict { index, .. }
            | What::Duplicate { index, .. }
            | What::NotWanted { index, .. }
            | What::Poisoned { index }
            | What::Withdrawn { index } => Some(*index),
            What::Started { .. } | What::Registered { .. } | What::Left { .. } | What::WorkerLost { .. } => {
                None
            }
        }
    }

    /// The worker that it is about; the coordinator is none.
    pub fn worker(&self) -> Option<&str> {
        match self {
            What::Recorded { attempt: 0, .. } => None,
            What::Registered { worker, .. }
            | What::Left { worker }
            | What::WorkerLost { worker }
            | What::Leased { worker, .. }
            | What::Released { worker, .. }
            | What::Hung { worker, .. }
            | What::Recorded { worker, .. }
            | What::Audited { worker, .. }
            | What::Conflict { worker, .. }
            | What::Duplicate { worker, .. }
            | What::NotWanted { worker, .. } => Some(worker),
            What::Started { .. } | What::Poisoned { .. } | What::Withdrawn { .. } => None,
        }
    }
}

impl From<&Entry> for What {
    /// That an entry of the outcome log was recorded.
    fn from(entry: &Entry) -> What {
        match entry {
            Entry::Outcome(Record { outcome, attempt, worker, wall_s }) => What::Recorded {
                index: outcome.index,
                attempt: *attempt,
                worker: worker.clone(),
                reason: outcome.reason,
                wall_s: *wall_s,
            },
            Entry::Conflict(Record { outcome, attempt, worker, .. }) => {
                What::Conflict { index: outcome.index, attempt: *attempt, worker: worker.clone() }
            }
            Entry::Audit { index, worker } => What::Audited { index: *index, worker: worker.clone() },
            Entry::Withdrawn { index, .. } => What::Withdrawn { index: *index },
        }
    }
}

/// A line of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Noted {
    /// When, in UTC: 2026-11-23T15:04:05.123Z.
    pub at: String,
    /// What happened.
    #[serde(flatten)]
    pub what: What,
}

/// The file, open for appending.
#[derive(Debug)]
pub struct Events {
    folder: PathBuf,
    open: Mutex<Option<Open>>,
}

#[derive(Debug)]
struct Open {
    file: File,
    bytes: u64,
}

impl Events {
    /// Opens or creates the file in `folder`. One that cannot be written is said once and left.
    pub fn open(folder: &Path) -> Events {
        let open = Open::new(folder);
        if let Err(error) = &open {
            tracing::warn!("{EVENTS_FILE}: {error}; the history of this session is not kept");
        }
        Events { folder: folder.to_owned(), open: Mutex::new(open.ok()) }
    }

    /// Notes that something has happened now.
    pub fn note(&self, what: What) {
        let noted = Noted { at: utc(SystemTime::now()), what };
        let line = serde_json::to_string(&noted).expect("an event holds only numbers and words") + "\n";
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let written = match &mut *open {
            Some(open) => open.write(&self.folder, line.as_bytes()),
            None => Ok(()),
        };
        if let Err(error) = written {
            tracing::warn!("{EVENTS_FILE}: {error}; the history of this session is kept no further");
            *open = None;
        }
    }
}

impl Open {
    fn new(folder: &Path) -> io::Result<Open> {
        let path = folder.join(EVENTS_FILE);
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
        let mut bytes = file.metadata()?.len();
        // A line that a power cut has torn must not take the next one with it.
        if bytes > 0 && !ends_with_line_end(&file, bytes)? {
            file.write_all(b"\n")?;
            bytes += 1;
        }
        Ok(Open { file, bytes })
    }

    fn write(&mut self, folder: &Path, line: &[u8]) -> io::Result<()> {
        if self.bytes + line.len() as u64 > LIMIT_BYTES {
            fs::rename(folder.join(EVENTS_FILE), folder.join(OLD_EVENTS_FILE))?;
            *self = Open::new(folder)?;
        }
        self.bytes += line.len() as u64;
        self.file.write_all(line)
    }
}

fn ends_with_line_end(file: &File, bytes: u64) -> io::Result<bool> {
    use std::os::unix::fs::FileExt;
    let mut last = [0];
    file.read_exact_at(&mut last, bytes - 1)?;
    Ok(last == *b"\n")
}

/// Gives every readable event of the run directory `folder` to `each`, oldest first; returns how many lines are not
/// readable. A directory without events has none.
///
/// # Errors
/// A file that is there cannot be read.
pub fn read(folder: &Path, mut each: impl FnMut(Noted)) -> io::Result<u64> {
    let mut unreadable = 0;
    for name in [OLD_EVENTS_FILE, EVENTS_FILE] {
        let file = match File::open(folder.join(name)) {
            Ok(file) => file,
            Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
            Err(e) => return Err(e),
        };
        let mut reader = BufReader::new(file);
        let mut line = Vec::new();
        while reader.read_until(b'\n', &mut line)? > 0 {
            match serde_json::from_slice(&line) {
                Ok(noted) => each(noted),
                Err(_) if line.iter().all(u8::is_ascii_whitespace) => {}
                Err(_) => unreadable += 1,
            }
            line.clear();
        }
    }
    Ok(unreadable)
}

/// A moment in UTC to the millisecond, as RFC 3339 has it.
pub fn utc(at: SystemTime) -> String {
    let since = at.duration_since(UNIX_EPOCH).unwrap_or_default();
    let (days, of_day) = (since.as_secs() / 86_400, since.as_secs() % 86_400);
    let (year, month, day) = date(days);
    let (hours, minutes, seconds) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    let milliseconds = since.subsec_millis();
    format!("{year:04}-{month:02}-{day:02}T{hours:02}:{minutes:02}:{seconds:02}.{milliseconds:03}Z")
}

/// The moment that [`utc`] has written; none if the text is of another form.
pub fn from_utc(text: &str) -> Option<SystemTime> {
    let field = |range: std::ops::Range<usize>| text.get(range)?.parse::<u64>().ok();
    let form: String = text.chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
    if form != "0000-00-00T00:00:00.000Z" {
        return None;
    }
    let (year, month, day) = (field(0..4)?, field(5..7)?, field(8..10)?);
    let seconds = field(11..13)? * 3600 + field(14..16)? * 60 + field(17..19)?;
    let sound = (1970..=9999).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    let days = sound.then(|| days_before(year, month) + day - 1)?;
    Some(UNIX_EPOCH + Duration::from_secs(days * 86_400 + seconds) + Duration::from_millis(field(20..23)?))
}

/// Year, month and day (from 1) of the Gregorian calendar, so many days after 1 January 1970.
fn date(days: u64) -> (u64, u64, u64) {
    // No year has more than 366 days, none fewer than 365.
    let mut year = 1970 + days / 366;
    while days_before(year + 1, 1) <= days {
        year += 1;
    }
    let month = (2..=12).take_while(|month| days_before(year, *month) <= days).last().unwrap_or(1);
    (year, month, days - days_before(year, month) + 1)
}

/// Days from 1 January 1970 to the first of a month.
fn days_before(year: u64, month: u64) -> u64 {
    const BEFORE_MONTH: [u64; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];
    let leap = year.is_multiple_of(4) && !year.is_multiple_of(100) || year.is_multiple_of(400);
    let leap_years = |before: u64| (before - 1) / 4 - (before - 1) / 100 + (before - 1) / 400;
    let leap_days = leap_years(year) - leap_years(1970) + u64::from(leap && month > 2);
    365 * (year - 1970) + leap_days + BEFORE_MONTH[month as usize - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against `date -u -d @SECONDS`.
    #[test]
    fn moments_are_written_and_read() {
        let cases = [
            (0, "1970-01-01T00:00:00.000Z"),
            (951_782_400, "2000-02-29T00:00:00.000Z"),
            (951_868_799, "2000-02-29T23:59:59.000Z"),
            (1_735_689_599, "2024-12-31T23:59:59.000Z"),
            (1_735_689_600, "2025-01-01T00:00:00.000Z"),
            (4_107_542_400, "2100-03-01T00:00:00.000Z"),
        ];
        for (seconds, text) in cases {
            let at = UNIX_EPOCH + Duration::from_secs(seconds);
            assert_eq!(utc(at), text);
            assert_eq!(from_utc(text), Some(at));
        }
        let at = UNIX_EPOCH + Duration::from_millis(1_790_000_000_123);
        assert_eq!(from_utc(&utc(at)), Some(at));
        for wrong in ["", "2026-11-23", "2026-13-01T00:00:00.000Z", "2026-11-23T15:04:05.123+"] {
            assert_eq!(from_utc(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn what_was_noted_is_read_again_and_torn_lines_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let leased = What::Leased { index: 3, attempt: 1, worker: "w".into() };
        let recorded =
            What::Recorded { index: 3, attempt: 1, worker: "w".into(), reason: Reason::AtRest, wall_s: 0.5 };
        Events::open(folder.path()).note(leased.clone());
        let path = folder.path().join(EVENTS_FILE);
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        file.write_all(b"{\"at\":\"2026").unwrap();
        Events::open(folder.path()).note(recorded.clone());
        let mut read_again = Vec::new();
        let unreadable = read(folder.path(), |noted| read_again.push(noted.what)).unwrap();
        assert_eq!((read_again, unreadable), (vec![leased, recorded], 1));
    }

    #[test]
    fn a_full_file_makes_room_for_a_new_one() {
        let folder = tempfile::tempdir().unwrap();
        let events = Events::open(folder.path());
        events.note(What::Poisoned { index: 1 });
        events.open.lock().unwrap().as_mut().unwrap().bytes = LIMIT_BYTES;
        events.note(What::Poisoned { index: 2 });
        let mut indices = Vec::new();
        read(folder.path(), |noted| indices.extend(noted.what.index())).unwrap();
        assert_eq!(indices, [1, 2]);
        assert!(folder.path().join(OLD_EVENTS_FILE).exists());
    }
}
