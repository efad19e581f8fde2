//! The run directory: one directory, one campaign; portable to another machine.
//!
//! `campaign.toml`, `site.csv` and `profile.csv` as given, `spec.json` (the frozen spec, its digest, the build), `outcomes.log`,
//! `store/`, `coordinator.addr` while a coordinator listens, `coordinator.lock`, `spool/` of local workers.
//! `spec.json` is written last, so that a directory with it is complete.

use crate::difference;
use crate::store::log::Record;
use crate::store::{self, LOG_FILE, Withdrawal, write_atomically};
use runout_core::spec::{Spec, SpecError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

const CAMPAIGN_FILE: &str = "campaign.toml";
/// The site table as given.
pub(crate) const SITE_FILE: &str = "site.csv";
/// The surface profile as given.
pub(crate) const PROFILE_FILE: &str = "profile.csv";
/// The frozen spec.
pub(crate) const SPEC_FILE: &str = "spec.json";
const ADDRESS_FILE: &str = "coordinator.addr";
const LOCK_FILE: &str = "coordinator.lock";
/// What may lie in a directory that becomes a run directory: what a creation that was cut short leaves.
const BEFORE_CREATION: [&str; 4] = [CAMPAIGN_FILE, SITE_FILE, PROFILE_FILE, LOCK_FILE];

/// A run directory that cannot be used.
#[derive(Debug, Error)]
pub enum RunDirectoryError {
    /// Another coordinator works on it.
    #[error("{}: another coordinator is working on this run directory", .0.display())]
    Busy(PathBuf),
    /// It holds another campaign.
    #[error(
        "{}: this run directory holds another campaign; take another directory, or the campaign it was made \
         with (directory -> given):\n  {}",
        path.display(), differences.join("\n  ")
    )]
    OtherCampaign {
        /// The directory.
        path: PathBuf,
        /// What differs, a line each.
        differences: Vec<String>,
    },
    /// It holds something else.
    #[error("{}: not a run directory, and not empty (it holds {found})", path.display())]
    NotEmpty {
        /// The directory.
        path: PathBuf,
        /// A name in it.
        found: String,
    },
    /// It holds no campaign, or not a readable one.
    #[error("{}: {why}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// The system refused.
    #[error("{}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
}

/// What a run directory is made from.
#[derive(Debug, Clone, Copy)]
pub struct Contents<'a> {
    /// Text of the campaign file.
    pub campaign_text: &'a str,
    /// Text of the site data.
    pub site_text: Option<&'a str>,
    /// Text of the surface profile.
    pub profile_text: Option<&'a str>,
    /// The frozen spec.
    pub spec: &'a Spec,
}

/// A run directory that this process works on: nobody else can until it is dropped.
#[derive(Debug)]
pub struct RunDirectory {
    path: PathBuf,
    resumed: bool,
    /// Holds the lock.
    _lock: File,
}

#[derive(Serialize, Deserialize)]
struct FrozenSpec {
    digest: String,
    build: String,
    spec: serde_json::Value,
}

impl RunDirectory {
    /// Takes the directory at `path` for a campaign: creates it, or continues it if it holds the same spec.
    ///
    /// A campaign file that differs but freezes to the same spec (another stopping rule, say) replaces the old one.
    ///
    /// # Errors
    /// Another coordinator has it, it holds another campaign or something else, or the system refuses.
    pub fn open(path: &Path, contents: Contents<'_>) -> Result<RunDirectory, RunDirectoryError> {
        let file = |name: &str, error| RunDirectoryError::File { path: path.join(name), error };
        fs::create_dir_all(path).map_err(|error| RunDirectoryError::File { path: path.to_owned(), error })?;
        if !path.join(SPEC_FILE).exists() {
            refuse_unless_empty(path)?;
        }
        let lock = lock(path)?;

        let resumed = path.join(SPEC_FILE).exists();
        if resumed {
            compare(path, contents.spec)?;
        }
        let put = |name: &str, text: &str| {
            let same = fs::read(path.join(name)).is_ok_and(|old| old == text.as_bytes());
            if same { Ok(()) } else { write_atomically(&path.join(name), text.as_bytes()) }
                .map_err(|error| file(name, error))
        };
        put(CAMPAIGN_FILE, contents.campaign_text)?;
        if let Some(text) = contents.site_text {
            put(SITE_FILE, text)?;
        }
        if let Some(text) = contents.profile_text {
            put(PROFILE_FILE, text)?;
        }
        if !resumed {
            put(SPEC_FILE, &frozen(contents.spec))?;
        }
        Ok(RunDirectory { path: path.to_owned(), resumed, _lock: lock })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it held the campaign before.
    pub fn resumed(&self) -> bool {
        self.resumed
    }

    /// Says where the coordinator listens: its URL.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn announce(&self, url: &str) -> Result<(), RunDirectoryError> {
        let path = self.path.join(ADDRESS_FILE);
        write_atomically(&path, format!("{url}\n").as_bytes())
            .map_err(|error| RunDirectoryError::File { path, error })
    }

    /// Takes the address back; a file that is not there is no error.
    fn withdraw(&self) {
        // A stale address is recognised by its readers, so that a failure here does no harm.
        let _ = fs::remove_file(self.path.join(ADDRESS_FILE));
    }

    /// Where local workers spool.
    pub fn spool(&self) -> PathBuf {
        self.path.join("spool")
    }
}

impl Drop for RunDirectory {
    /// Nobody listens any more, however the coordinator ended.
    fn drop(&mut self) {
        self.withdraw();
    }
}

/// Takes the lock of the run directory at `path`: no coordinator works on it until the file is dropped.
///
/// # Errors
/// A coordinator works on it, or the system refuses.
pub fn lock(path: &Path) -> Result<File, RunDirectoryError> {
    let file = |error| RunDirectoryError::File { path: path.join(LOCK_FILE), error };
    let lock = File::options().create(true).truncate(false).write(true).open(path.join(LOCK_FILE));
    let lock = lock.map_err(file)?;
    lock.try_lock().map_err(|e| match e {
        TryLockError::WouldBlock => RunDirectoryError::Busy(path.to_owned()),
        TryLockError::Error(error) => file(error),
    })?;
    Ok(lock)
}

/// Keeps coordinators away from the directory at `path` until the returned file is dropped, without writing to it; none
/// if there never was one.
///
/// # Errors
/// A coordinator works on it, or the system refuses.
pub fn lock_for_reading(path: &Path) -> Result<Option<File>, RunDirectoryError> {
    let file = |error| RunDirectoryError::File { path: path.join(LOCK_FILE), error };
    let lock = match File::open(path.join(LOCK_FILE)) {
        Ok(lock) => lock,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(file(e)),
    };
    match lock.try_lock_shared() {
        Ok(()) => Ok(Some(lock)),
        Err(TryLockError::WouldBlock) => Err(RunDirectoryError::Busy(path.to_owned())),
        Err(TryLockError::Error(error)) => Err(file(error)),
    }
}

/// A run directory without its outcomes.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The frozen spec.
    pub spec: Spec,
    /// Text of the campaign file.
    pub campaign_text: String,
    /// Text of the site data, if the campaign has any.
    pub site_text: Option<String>,
    /// Text of the surface profile, if the campaign has one.
    pub profile_text: Option<String>,
    /// Where the coordinator listens, or listened when it was killed.
    pub address: Option<String>,
}

/// Whether `path` looks like a run directory, however damaged.
pub fn is_one(path: &Path) -> bool {
    path.join(SPEC_FILE).is_file()
}

/// Reads a run directory but for its outcomes, without locks, whether or not a coordinator works on it.
///
/// # Errors
/// It holds no campaign, or files that cannot be read.
pub fn read_frame(path: &Path) -> Result<Frame, RunDirectoryError> {
    let text = |name: &str| {
        fs::read_to_string(path.join(name))
            .map_err(|error| RunDirectoryError::File { path: path.join(name), error })
    };
    let if_there = |name: &str| path.join(name).exists().then(|| text(name)).transpose();
    Ok(Frame {
        spec: read_spec(path)?,
        campaign_text: text(CAMPAIGN_FILE)?,
        site_text: if_there(SITE_FILE)?,
        profile_text: if_there(PROFILE_FILE)?,
        address: fs::read_to_string(path.join(ADDRESS_FILE)).ok().map(|a| a.trim().to_owned()),
    })
}

/// What a reader sees of a run directory.
#[derive(Debug, Clone, PartialEq)]
pub struct RunView {
    /// The frozen spec.
    pub spec: Spec,
    /// Text of the campaign file.
    pub campaign_text: String,
    /// Text of the site data, if the campaign has any.
    pub site_text: Option<String>,
    /// Text of the surface profile, if the campaign has one.
    pub profile_text: Option<String>,
    /// Every recorded outcome, in index order, gaps and outcomes beyond the stopping index included.
    pub records: Vec<Record>,
    /// Outcomes that contradict the one recorded first.
    pub conflicts: Vec<Record>,
    /// Indices that were run twice with equal results.
    pub audited: BTreeSet<u64>,
    /// Outcomes that were withdrawn, so that their realisations are run again.
    pub withdrawn: Vec<Withdrawal>,
    /// What is damaged, in words.
    pub damage: Vec<String>,
    /// Where the coordinator listens, or listened when it was killed.
    pub address: Option<String>,
}

/// Reads a run directory without locks, whether or not a coordinator works on it.
///
/// # Errors
/// It holds no campaign, or files that cannot be read.
pub fn read(path: &Path) -> Result<RunView, RunDirectoryError> {
    let Frame { spec, campaign_text, site_text, profile_text, address } = read_frame(path)?;
    let log = path.join(LOG_FILE);
    let (contents, scan) =
        store::read_log::<Record>(&log).map_err(|error| RunDirectoryError::File { path: log, error })?;
    Ok(RunView {
        spec,
        campaign_text,
        site_text,
        profile_text,
        records: contents.records,
        conflicts: contents.conflicts,
        audited: contents.audited,
        withdrawn: contents.withdrawn,
        damage: scan.into_damage(),
        address,
    })
}

/// Where the coordinator of a run directory listens, if one does, and the digest of its spec.
///
/// # Errors
/// It holds no campaign.
pub fn announced(path: &Path) -> Result<(Option<String>, String), RunDirectoryError> {
    Ok((address(path), read_frozen(path)?.digest))
}

fn address(path: &Path) -> Option<String> {
    fs::read_to_string(path.join(ADDRESS_FILE)).ok().map(|a| a.trim().to_owned())
}

fn frozen(spec: &Spec) -> String {
    let frozen = FrozenSpec {
        digest: spec.digest(),
        build: runout_proto::identity::build(),
        spec: spec_value(&spec.to_json()),
    };
    serde_json::to_string_pretty(&frozen).expect("a spec is JSON") + "\n"
}

fn spec_value(json: &str) -> serde_json::Value {
    serde_json::from_str(json).expect("the canonical form is JSON")
}

fn read_frozen(path: &Path) -> Result<FrozenSpec, RunDirectoryError> {
    let path = path.join(SPEC_FILE);
    let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => RunDirectoryError::Unreadable {
            path: path.clone(),
            why: "not found: this is no run directory (make one with `runout run` or `runout serve`)"
                .to_owned(),
        },
        io::ErrorKind::NotADirectory => RunDirectoryError::Unreadable {
            path: path.parent().unwrap_or(&path).to_owned(),
            why: "it is a file, and a run directory is needed".to_owned(),
        },
        _ => RunDirectoryError::File { path: path.clone(), error },
    })?;
    serde_json::from_str(&text)
        .map_err(|e| RunDirectoryError::Unreadable { path, why: format!("not a frozen spec: {e}") })
}

fn read_spec(path: &Path) -> Result<Spec, RunDirectoryError> {
    let frozen = read_frozen(path)?;
    let unreadable = |why: String| RunDirectoryError::Unreadable { path: path.join(SPEC_FILE), why };
    let build = runout_proto::identity::build();
    let spec = Spec::from_json(&frozen.spec.to_string()).map_err(|e: SpecError| {
        unreadable(match frozen.build == build {
            true => e.to_string(),
            false => format!("{e}; it was written by build {}, and this is build {build}", frozen.build),
        })
    })?;
    if spec.digest() != frozen.digest {
        return Err(unreadable("its digest is not the spec's: the file was changed".to_owned()));
    }
    Ok(spec)
}

fn compare(path: &Path, given: &Spec) -> Result<(), RunDirectoryError> {
    let frozen = read_frozen(path)?;
    if frozen.digest == given.digest() {
        return read_spec(path).map(|_| ());
    }
    let differences = difference::lines(&frozen.spec, &spec_value(&given.to_json()));
    Err(RunDirectoryError::OtherCampaign { path: path.to_owned(), differences })
}

fn refuse_unless_empty(path: &Path) -> Result<(), RunDirectoryError> {
    let failed = |error| RunDirectoryError::File { path: path.to_owned(), error };
    for entry in fs::read_dir(path).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        let ours = BEFORE_CREATION.iter().any(|n| name == *n || name == format!("{n}.tmp"));
        if !ours && name != format!("{SPEC_FILE}.tmp") {
            return Err(RunDirectoryError::NotEmpty { path: path.to_owned(), found: name });
        }
    }
    Ok(())
}
