//! Reading an outcome log line by line, as far as it is sound, in memory of one line.
//!
//! Each line stands for itself: damage costs the lines it hits and no others.

use super::log::{CHECKSUM_DIGITS, Entry, checksum};
use super::wire::Form;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Most places of damage that are described one by one; the rest are counted.
const MOST_DESCRIBED: usize = 100;
/// Size of the buffer for reading, bytes.
const BUFFER_BYTES: usize = 1 << 18;

/// A line's start or end in a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Place {
    /// Bytes before it.
    pub bytes: u64,
    /// Lines before it.
    pub lines: u64,
}

/// How far a log was sound.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Scan {
    /// Where reading ended: behind the last line, sound or not.
    pub end: Place,
    /// What is damaged, in words; empty for a sound log.
    pub damage: Vec<String>,
    /// Places of damage beyond those described.
    pub more_damage: u64,
    /// Bytes after the last line end that are no whole entry: a line being written, or torn.
    pub unfinished_bytes: u64,
    /// Whether the last entry is whole but for its line end.
    pub missing_line_end: bool,
}

impl Scan {
    /// Whether every line is sound; a line that is being written is no damage.
    pub fn is_sound(&self) -> bool {
        self.damage.is_empty()
    }

    /// What is damaged, with a last line for what is not described one by one.
    pub fn into_damage(mut self) -> Vec<String> {
        if self.more_damage > 0 {
            self.damage.push(format!("and {} more places", self.more_damage));
        }
        self.damage
    }

    fn damaged(&mut self, what: &str) {
        if self.damage.len() < MOST_DESCRIBED {
            self.damage.push(format!("line {}: {what}", self.end.lines));
        } else {
            self.more_damage += 1;
        }
    }

    /// Takes the scan of what follows in the same log.
    pub(super) fn append(&mut self, later: Scan) {
        let Scan { end, damage, more_damage, unfinished_bytes, missing_line_end } = later;
        let room = MOST_DESCRIBED - self.damage.len();
        self.more_damage += more_damage + damage.len().saturating_sub(room) as u64;
        self.damage.extend(damage.into_iter().take(room));
        (self.end, self.unfinished_bytes, self.missing_line_end) = (end, unfinished_bytes, missing_line_end);
    }
}

/// A sound line: the entry, and the line's bytes with its end.
#[derive(Debug)]
pub struct Line<'a, R> {
    /// What it says.
    pub entry: Entry<R>,
    /// As written, the line end included.
    pub bytes: &'a [u8],
}

/// Reads the log at `path` from a line's start; one that does not exist is empty.
///
/// # Errors
/// Reading fails, or `each` does.
pub fn scan_file<R: Form>(
    path: &Path,
    from: Place,
    each: impl FnMut(Line<'_, R>) -> io::Result<()>,
) -> io::Result<Scan> {
    match File::open(path) {
        Ok(mut file) => {
            file.seek(SeekFrom::Start(from.bytes))?;
            scan(file, from, each)
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(Scan::default()),
        Err(e) => Err(e),
    }
}

/// Reads a log from the place at which `reader` stands and gives every sound line to `each`.
///
/// # Errors
/// Reading fails, or `each` does.
pub fn scan<R: Form>(
    reader: impl Read,
    from: Place,
    each: impl FnMut(Line<'_, R>) -> io::Result<()>,
) -> io::Result<Scan> {
    scan_lines(BufReader::with_capacity(BUFFER_BYTES, reader), from, each)
}

/// As [`scan`], from what has a buffer of its own.
pub(super) fn scan_lines<R: Form>(
    mut reader: impl BufRead,
    from: Place,
    mut each: impl FnMut(Line<'_, R>) -> io::Result<()>,
) -> io::Result<Scan> {
    let mut scan = Scan { end: from, ..Scan::default() };
    let mut line = Vec::new();
    loop {
        line.clear();
        let read = reader.read_until(b'\n', &mut line)?;
        if read == 0 {
            return Ok(scan);
        }
        let ended = line.last() == Some(&b'\n');
        if !ended {
            line.push(b'\n');
        }
        // A zeroed block holds no line end: what stands behind it may be a sound line.
        let holed = line.contains(&0);
        let sound = if holed { line.iter().rposition(|b| *b == 0).map_or(0, |last| last + 1) } else { 0 };
        let entry = parse_line::<R>(&line[sound..line.len() - 1]);
        if !ended && entry.is_none() {
            scan.unfinished_bytes = read as u64;
            return Ok(scan);
        }
        scan.missing_line_end = !ended;
        scan.end = Place { bytes: scan.end.bytes + read as u64, lines: scan.end.lines + 1 };
        if sound > 0 {
            let zeros = line.iter().filter(|b| **b == 0).count();
            scan.damaged(&format!("{zeros} zero bytes"));
        }
        match entry {
            Some(entry) => each(Line { entry, bytes: &line[sound..] })?,
            None if sound > 0 && sound == line.len() - 1 => {}
            None => scan.damaged("checksum or form is wrong"),
        }
    }
}

/// The entry of a line without its line end; none if checksum or form is wrong.
fn parse_line<R: Form>(line: &[u8]) -> Option<Entry<R>> {
    let (sum, rest) = line.split_at_checked(CHECKSUM_DIGITS)?;
    let json = rest.strip_prefix(b"\t")?;
    if sum != checksum(json).as_bytes() {
        return None;
    }
    super::wire::parse(json)
}
