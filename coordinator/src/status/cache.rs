//! `estimates.cache`: the tally of a long outcome log up to some place in it, so that `runout status` reads the rest only.
//!
//! Nothing rests on it: it may be missing, old or damaged, and is never synced. It is taken only if its own checksum is
//! right, the campaign file is the one it was folded under, and the log is at least as long as then and has the same
//! bytes in places spread over that length and at its end. Damage elsewhere in the log is found by whoever reads all of
//! it: `runout verify`, `results`, and every coordinator when it starts.

use super::tally::Tally;
use crate::run_directory::Frame;
use crate::store::scan::Place;
use crate::store::{LOG_FILE, write_atomically_unsynced};
use runout_core::campaign::Campaign;
use runout_core::estimate::Estimator;
use runout_core::estimate::saved::Saved;
use runout_core::outcome::Outcome;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Name of the cache in a run directory.
pub const CACHE_FILE: &str = "estimates.cache";
/// A log is cached anew when it has grown by this, bytes: it is read in some 20 ms.
pub const WORTHWHILE_BYTES: u64 = 4 << 20;
/// Raised when the meaning of the file changes.
const FORMAT: u32 = 1;
/// Blocks of the log that are compared, and their size, bytes.
const PROBES: u64 = 16;
const PROBE_BYTES: u64 = 4096;
/// Bytes in front of the place that are compared.
const END_BYTES: u64 = 65_536;
/// Hexadecimal digits of a BLAKE3 checksum.
const CHECKSUM_DIGITS: usize = 64;

/// All but the samples, which stand behind it as little-endian doubles.
#[derive(Serialize, Deserialize)]
struct Header {
    format: u32,
    key: String,
    place: Place,
    probe: String,
    fold: Saved,
    samples: usize,
    ahead: Vec<Outcome>,
    due: BTreeSet<u64>,
    audited: BTreeSet<u64>,
    conflicts: u64,
}

/// What estimates depend on beside the log: a cache of another key is not taken.
pub fn key(frame: &Frame) -> String {
    key_of(&frame.spec.digest(), &frame.campaign_text)
}

/// As [`key`], from the spec's digest and the campaign file.
pub fn key_of(digest: &str, campaign_text: &str) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(digest.as_bytes()).update(b"\n").update(campaign_text.as_bytes());
    hasher.finalize().to_hex().to_string()
}

/// Writes the tally of the log in `folder` up to `place`.
///
/// # Errors
/// The file cannot be written, or the log not be read.
pub fn save(folder: &Path, key: &str, tally: &Tally, place: Place) -> io::Result<()> {
    let header = Header {
        format: FORMAT,
        key: key.to_owned(),
        place,
        probe: probe(&File::open(folder.join(LOG_FILE))?, place.bytes)?,
        fold: tally.estimator.save(),
        samples: tally.estimator.samples_m().len(),
        ahead: tally.ahead.values().cloned().collect(),
        due: tally.due.clone(),
        audited: tally.audited.clone(),
        conflicts: tally.conflicts,
    };
    let mut body = serde_json::to_vec(&header).expect("a header holds only numbers, words and lists");
    body.push(b'\n');
    body.extend(tally.estimator.samples_m().iter().flat_map(|sample| sample.to_le_bytes()));
    write_atomically_unsynced(&folder.join(CACHE_FILE), |file| {
        writeln!(file, "{}", blake3::hash(&body).to_hex())?;
        file.write_all(&body)
    })
}

/// The tally of the log in `folder` up to a place, if there is one to be trusted.
pub fn load(folder: &Path, key: &str, campaign: &Campaign) -> Option<(Tally, Place)> {
    let bytes = fs::read(folder.join(CACHE_FILE)).ok()?;
    let (checksum, rest) = bytes.split_at_checked(CHECKSUM_DIGITS)?;
    let body = rest.strip_prefix(b"\n")?;
    if blake3::hash(body).to_hex().as_bytes() != checksum {
        return None;
    }
    let end = body.iter().position(|b| *b == b'\n')?;
    let header: Header = serde_json::from_slice(&body[..end]).ok()?;
    let log = File::open(folder.join(LOG_FILE)).ok()?;
    let matches = header.format == FORMAT
        && header.key == key
        && log.metadata().ok()?.len() >= header.place.bytes
        && probe(&log, header.place.bytes).ok()? == header.probe;
    if !matches {
        return None;
    }
    let (numbers, rest) = body[end + 1..].as_chunks::<8>();
    if !rest.is_empty() || numbers.len() != header.samples {
        return None;
    }
    let samples_m = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let estimator =
        Estimator::restore(&campaign.stop, &campaign.model.sample, &campaign.run, header.fold, samples_m)?;
    let tally = Tally {
        estimator,
        ahead: header.ahead.into_iter().map(|outcome| (outcome.index, outcome)).collect(),
        due: header.due,
        audited: header.audited,
        conflicts: header.conflicts,
        ..Tally::new(campaign)
    };
    Some((tally, header.place))
}

/// A checksum of blocks spread over the first `bytes` of the log and of what stands before their end.
fn probe(log: &File, bytes: u64) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    let mut block = vec![0; END_BYTES as usize];
    let spread = (0..PROBES).map(|n| (bytes / PROBES * n, PROBE_BYTES));
    for (from, length) in spread.chain([(bytes.saturating_sub(END_BYTES), END_BYTES)]) {
        let length = length.min(bytes - from) as usize;
        log.read_exact_at(&mut block[..length], from)?;
        hasher.update(&block[..length]);
    }
    Ok(hasher.finalize().to_hex().to_string())
}
