//! The outcome log: append-only, one line an entry, readable by people and scripts.
//!
//! A line is a checksum (BLAKE3 of the JSON, its first 16 hexadecimal digits), a tab, and the entry as JSON. Each
//! line stands for itself, so that damage (a torn last line, zeroed blocks after a power cut) costs the lines it
//! hits and no others.

use runout_core::outcome::Outcome;
use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const CHECKSUM_DIGITS: usize = 16;

/// An outcome and what depends on the machine or on luck.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Entry {
    /// The recorded outcome of an index.
    Outcome(Record),
    /// A later outcome of the same index with another digest.
    Conflict(Record),
    /// A second worker computed the same digest.
    Audit {
        /// Realisation index.
        index: u64,
        /// The second worker.
        worker: String,
    },
}

/// What could be read of a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LogContents {
    /// Sound entries in the order in which they were written.
    pub entries: Vec<Entry>,
    /// What is damaged, in words; empty for a sound log.
    pub damage: Vec<String>,
    /// Bytes after the last line end: a line being written, or torn.
    pub unfinished_bytes: usize,
}

/// The line of an entry, with its line end.
pub fn line(entry: &Entry) -> String {
    let json = serde_json::to_string(entry).expect("an entry holds only numbers, words and lists");
    format!("{}\t{json}\n", checksum(json.as_bytes()))
}

/// Reads a log's bytes as far as they are sound.
pub fn parse(bytes: &[u8]) -> LogContents {
    let mut contents = LogContents::default();
    let end = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |p| p + 1);
    contents.unfinished_bytes = bytes.len() - end;
    let lines = bytes[..end].split_inclusive(|b| *b == b'\n');
    for (number, line) in lines.enumerate() {
        // A zeroed block holds no line end: what stands behind it may be a sound line.
        let sound = line.iter().rposition(|b| *b == 0).map_or(0, |last| last + 1);
        if sound > 0 {
            let zeros = line.iter().filter(|b| **b == 0).count();
            contents.damage.push(format!("line {}: {zeros} zero bytes", number + 1));
        }
        if sound > 0 && sound == line.len() - 1 {
            continue;
        }
        match parse_line(&line[sound..line.len() - 1]) {
            Some(entry) => contents.entries.push(entry),
            None => contents.damage.push(format!("line {}: checksum or form is wrong", number + 1)),
        }
    }
    contents
}

fn parse_line(line: &[u8]) -> Option<Entry> {
    let (sum, rest) = line.split_at_checked(CHECKSUM_DIGITS)?;
    let json = rest.strip_prefix(b"\t")?;
    if sum != checksum(json).as_bytes() {
        return None;
    }
    serde_json::from_slice(json).ok()
}

fn checksum(json: &[u8]) -> String {
    blake3::hash(json).to_hex()[..CHECKSUM_DIGITS].to_owned()
}

/// The log, open for appending by the one coordinator of its run directory.
#[derive(Debug)]
pub struct Log {
    file: File,
}

impl Log {
    /// Opens or creates the log at `path` and reads it. A damaged log is set aside under another name, and what
    /// is sound of it is written anew; the returned contents say so.
    ///
    /// # Errors
    /// Reading, writing or syncing fails.
    pub fn open(path: &Path) -> io::Result<(Log, LogContents)> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(e) => return Err(e),
        };
        let mut contents = parse(&bytes);
        if contents.unfinished_bytes > 0 {
            let torn = contents.unfinished_bytes;
            contents.damage.push(format!("the last line is torn ({torn} bytes)"));
        }
        if !contents.damage.is_empty() {
            let aside = free_name(path);
            fs::copy(path, &aside)?;
            let sound: String = contents.entries.iter().map(line).collect();
            super::write_atomically(path, sound.as_bytes())?;
            contents.damage.push(format!("the damaged log is kept as {}", aside.display()));
        }
        let file = OpenOptions::new().append(true).create(true).open(path)?;
        file.sync_all()?;
        super::sync_folder_of(path)?;
        Ok((Log { file }, contents))
    }

    /// Appends entries; they are on the disk when this returns.
    ///
    /// # Errors
    /// Writing or syncing fails; a torn line may then be left, which the next [`Log::open`] removes.
    pub fn append(&mut self, entries: &[Entry]) -> io::Result<()> {
        let text: String = entries.iter().map(line).collect();
        self.file.write_all(text.as_bytes())?;
        self.file.sync_data()
    }
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

    #[test]
    fn entries_are_read_back_to_the_bit() {
        let mut all = entries(5);
        all.push(Entry::Audit { index: 3, worker: "b".into() });
        all.push(Entry::Conflict(record(4)));
        let text: String = all.iter().map(line).collect();
        assert_eq!(parse(text.as_bytes()), LogContents { entries: all, ..LogContents::default() });
    }

    #[test]
    fn a_torn_last_line_is_removed_and_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("outcomes.log");
        let text: String = entries(3).iter().map(line).collect();
        fs::write(&path, &text[..text.len() - 10]).unwrap();
        let (mut log, contents) = Log::open(&path).unwrap();
        assert_eq!(contents.entries, entries(2));
        assert!(contents.damage[0].starts_with("the last line is torn"), "{:?}", contents.damage);
        log.append(&entries(3)[2..]).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
        assert!(folder.path().join("outcomes.log.damaged-1").exists());
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
            prop_assert_eq!(parse(&bytes).entries, untouched);
        }
    }
}
