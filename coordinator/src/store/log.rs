//! The outcome log: append-only, one line an entry, readable by people and scripts.
//!
//! A line is a checksum (BLAKE3 of the JSON, its first 16 hexadecimal digits), a tab, and the entry as JSON. Each
//! line stands for itself, so that damage (a torn last line, zeroed blocks after a power cut) costs the lines it
//! hits and no others. [`super::scan`] reads it.

use super::blocks::read_entries;
use super::scan::{self, Line, Place, Scan};
use super::wire::Form;
use runout_core::outcome::Outcome;
use serde::Serialize;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

pub(super) const CHECKSUM_DIGITS: usize = 16;

/// An outcome and what depends on the machine or on luck.
#[derive(Debug, Clone, PartialEq, Serialize, serde::Deserialize)]
pub struct Record {
    /// The outcome.
    pub outcome: Outcome,
    /// Attempt that gave it, from 1; 0 for a realisation given up by the coordinator.
    pub attempt: u32,
    /// Worker that ran it.
    pub worker: String,
    /// Wall time of the computation, s.
    pub wall_s: f64,
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Entry<R = Record> {
    /// The recorded outcome of an index.
    Outcome(R),
    /// A later outcome of the same index with another digest.
    Conflict(R),
    /// A second worker computed the same digest.
    Audit {
        /// Realisation index.
        index: u64,
        /// The second worker.
        worker: String,
    },
    /// The outcome recorded before counts no more: its realisation is open again.
    Withdrawn {
        /// Realisation index.
        index: u64,
        /// Attempt that gave the outcome.
        attempt: u32,
        /// Its digest.
        digest: String,
    },
}

/// The line of an entry, with its line end.
pub fn line(entry: &Entry) -> String {
    let json = serde_json::to_string(entry).expect("an entry holds only numbers, words and lists");
    format!("{}\t{json}\n", checksum(json.as_bytes()))
}

pub(super) fn checksum(json: &[u8]) -> String {
    blake3::hash(json).to_hex()[..CHECKSUM_DIGITS].to_owned()
}

/// The log, open for appending by the one coordinator of its run directory.
#[derive(Debug)]
pub struct Log {
    file: File,
    end: Place,
}

impl Log {
    /// Opens or creates the log at `path` and gives every sound entry to `each`. A damaged log is set aside under
    /// another name, and what is sound of it is written anew; the returned notes say so.
    ///
    /// # Errors
    /// Reading, writing or syncing fails.
    pub fn open<R: Form + Send>(
        path: &Path,
        mut each: impl FnMut(Entry<R>),
    ) -> io::Result<(Log, Vec<String>)> {
        let mut lines = 0;
        let scan = read_entries(path, |entry| {
            each(entry);
            lines += 1;
        })?;
        let notes = mend(path, scan)?;
        let file = OpenOptions::new().append(true).create(true).open(path)?;
        file.sync_all()?;
        super::sync_folder_of(path)?;
        let end = Place { bytes: file.metadata()?.len(), lines };
        Ok((Log { file, end }, notes))
    }

    /// Appends entries; they are on the disk when this returns.
    ///
    /// # Errors
    /// Writing or syncing fails; a torn line may then be left, which the next [`Log::open`] removes.
    pub fn append(&mut self, entries: &[Entry]) -> io::Result<()> {
        let text: String = entries.iter().map(line).collect();
        self.file.write_all(text.as_bytes())?;
        self.file.sync_data()?;
        self.end.bytes += text.len() as u64;
        self.end.lines += entries.len() as u64;
        Ok(())
    }

    /// Behind its last line.
    pub fn end(&self) -> Place {
        self.end
    }
}

/// Writes what is sound of a damaged log anew; says what was done.
fn mend(path: &Path, scan: Scan) -> io::Result<Vec<String>> {
    let (torn, missing_end) = (scan.unfinished_bytes, scan.missing_line_end);
    let mut notes = scan.into_damage();
    if missing_end {
        notes.push("the last line end is missing; the line is whole".to_owned());
    }
    if torn > 0 {
        notes.push(format!("the last line is torn ({torn} bytes)"));
    }
    if notes.is_empty() {
        return Ok(notes);
    }
    let aside = free_name(path);
    fs::copy(path, &aside)?;
    super::write_atomically_with(path, |file| {
        let mut sound = BufWriter::new(file);
        // The record's form does not matter here, and its gist is read fastest.
        scan::scan_file(path, Place::default(), |line: Line<'_, super::wire::Gist>| {
            sound.write_all(line.bytes)
        })?;
        sound.flush()
    })?;
    notes.push(format!("the damaged log is kept as {}", aside.display()));
    Ok(notes)
}

fn free_name(path: &Path) -> PathBuf {
    (1_u32..)
        .map(|n| path.with_extension(format!("log.damaged-{n}")))
        .find(|p| !p.exists())
        .expect("some number is free")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::tests::record;
    use proptest::prelude::*;

    fn entries(count: u64) -> Vec<Entry> {
        (0..count).map(|index| Entry::Outcome(record(index))).collect()
    }

    fn read(bytes: &[u8]) -> (Vec<Entry>, Scan) {
        let mut entries = Vec::new();
        let scan = scan::scan(bytes, Place::default(), |line: Line<'_, Record>| {
            entries.push(line.entry);
            Ok(())
        });
        (entries, scan.unwrap())
    }

    #[test]
    fn entries_are_read_back_to_the_bit() {
        let mut all = entries(5);
        all.push(Entry::Audit { index: 3, worker: "b\"\\".into() });
        all.push(Entry::Conflict(record(4)));
        all.push(Entry::Withdrawn { index: 2, attempt: 1, digest: "d".into() });
        let text: String = all.iter().map(line).collect();
        let (read, scan) = read(text.as_bytes());
        assert_eq!(read, all);
        assert_eq!(scan, Scan { end: Place { bytes: text.len() as u64, lines: 8 }, ..Scan::default() });
    }

    /// A run directory from before outcomes could have a profile stays sound: its lines are read, and written the same.
    #[test]
    fn a_line_without_profile_is_read_and_written_the_same() {
        let text = include_str!("testdata/outcome-without-profile.log");
        let (entries, scan) = read(text.as_bytes());
        let [Entry::Outcome(found)] = &entries[..] else { panic!("{scan:?}") };
        assert_eq!((found.outcome.points, &found.outcome.profile), (1302, &None));
        assert_eq!(line(&entries[0]), text);
    }

    #[test]
    fn a_torn_last_line_is_removed_and_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("outcomes.log");
        let text: String = entries(3).iter().map(line).collect();
        fs::write(&path, &text[..text.len() - 10]).unwrap();
        let mut read = Vec::new();
        let (mut log, notes) = Log::open(&path, |entry| read.push(entry)).unwrap();
        assert_eq!(read, entries(2));
        assert!(notes[0].starts_with("the last line is torn"), "{notes:?}");
        log.append(&entries(3)[2..]).unwrap();
        assert_eq!(log.end(), Place { bytes: text.len() as u64, lines: 3 });
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
        assert!(folder.path().join("outcomes.log.damaged-1").exists());
    }

    #[test]
    fn a_line_that_lacks_only_its_end_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("outcomes.log");
        let text: String = entries(3).iter().map(line).collect();
        fs::write(&path, &text[..text.len() - 1]).unwrap();
        let mut read = Vec::new();
        let (_log, notes) = Log::open(&path, |entry| read.push(entry)).unwrap();
        assert_eq!(read, entries(3));
        assert!(notes[0].starts_with("the last line end is missing"), "{notes:?}");
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn a_heavily_damaged_log_is_described_briefly() {
        let bytes = b"no line\n".repeat(1000);
        let (read, scan) = read(&bytes);
        assert!(read.is_empty() && !scan.is_sound());
        let damage = scan.into_damage();
        assert_eq!(damage.len(), 101);
        assert_eq!(damage[100], "and 900 more places");
    }

    proptest! {
        /// Zeroing any stretch costs at most the lines it touches.
        #[test]
        fn zeroed_blocks_cost_only_the_lines_they_hit(start in 0_usize..4000, length in 1_usize..2000) {
            let lines: Vec<String> = entries(12).iter().map(line).collect();
            let mut bytes = lines.concat().into_bytes();
            let (start, end) = (start.min(bytes.len() - 1), (start + length).min(bytes.len()));
            bytes[start..end].fill(0);
            let mut at = 0;
            let mut untouched = Vec::new();
            for (text, entry) in lines.iter().zip(entries(12)) {
                if at + text.len() <= start || at >= end {
                    untouched.push(entry);
                }
                at += text.len();
            }
            // A stretch that ends with a line leaves zeros in front of the next one, which survives.
            prop_assert_eq!(read(&bytes).0, untouched);
        }
    }
}
