//! Outcomes on disk until the coordinator has acknowledged them, so that a worker that is killed, or outlived by its
//! coordinator, loses no finished work.
//!
//! One file an outcome, in a folder per spec: the report as it travels, after its BLAKE3. Files of another process
//! may be delivered by whoever finds them: reports are idempotent.

use prost::Message;
use runout_proto::v1::ReportRequest;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const CHECKSUM_BYTES: usize = 32;
const ENDING: &str = "report";

/// The spool of one spec.
#[derive(Debug, Clone)]
pub struct Spool {
    folder: PathBuf,
}

impl Spool {
    /// The spool for the spec of this digest under `root`.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn open(root: &Path, spec_digest: &str) -> io::Result<Spool> {
        let folder = root.join(spec_digest);
        fs::create_dir_all(&folder)?;
        Ok(Spool { folder })
    }

    /// Writes a report to disk; returns its file.
    ///
    /// # Errors
    /// The disk is full or broken. The report can still be delivered from memory.
    pub fn keep(&self, report: &ReportRequest) -> io::Result<PathBuf> {
        let index = report.outcome.as_ref().map_or(0, |o| o.index);
        let stem = format!("{index}-{}-{}", report.attempt, std::process::id());
        let (temporary, path) =
            (self.folder.join(format!("{stem}.tmp")), self.folder.join(format!("{stem}.{ENDING}")));
        let body = report.encode_to_vec();
        let mut file = File::create(&temporary)?;
        file.write_all(blake3::hash(&body).as_bytes())?;
        file.write_all(&body)?;
        file.sync_all()?;
        fs::rename(&temporary, &path)?;
        Ok(path)
    }

    /// Forgets a report that was acknowledged.
    pub fn forget(&self, path: &Path) {
        // A file left behind is delivered once more and dropped by the coordinator.
        if let Err(error) = fs::remove_file(path) {
            tracing::debug!("{}: {error}", path.display());
        }
    }

    /// What lies there, sound files only; damaged ones are removed, since their realisations will be run again.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn left_behind(&self) -> io::Result<Vec<(PathBuf, ReportRequest)>> {
        let mut found = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            if path.extension().is_none_or(|e| e != ENDING) {
                continue;
            }
            match fs::read(&path).ok().as_deref().and_then(parse) {
                Some(report) => found.push((path, report)),
                None => self.forget(&path),
            }
        }
        found.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(found)
    }
}

fn parse(bytes: &[u8]) -> Option<ReportRequest> {
    let (sum, body) = bytes.split_at_checked(CHECKSUM_BYTES)?;
    if sum != blake3::hash(body).as_bytes() {
        return None;
    }
    ReportRequest::decode(body).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_found_and_damage_is_dropped() {
        let root = tempfile::tempdir().unwrap();
        let spool = Spool::open(root.path(), "abc").unwrap();
        let report = ReportRequest { attempt: 3, wall_s: 1.5, ..ReportRequest::default() };
        let kept = spool.keep(&report).unwrap();
        let torn = root.path().join("abc").join("9-1-1.report");
        fs::write(&torn, &fs::read(&kept).unwrap()[..35]).unwrap();
        assert_eq!(spool.left_behind().unwrap(), [(kept.clone(), report)]);
        assert!(!torn.exists());
        spool.forget(&kept);
        assert_eq!(spool.left_behind().unwrap(), []);
    }
}
