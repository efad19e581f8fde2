//! The only reader of user files: campaign file, site table and surface profile in, checked campaign, fit and frozen
//! spec out.
//!
//! Every message names the file, and what is wrong in it down to key and value or line and column.

use crate::overrides::{self, Override};
use crate::run_directory::{PROFILE_FILE, SITE_FILE, SPEC_FILE};
use runout_core::campaign::profile::{self, ProfileError};
use runout_core::campaign::{self, Campaign, CampaignError};
use runout_core::fit::{self, Fit, FitError};
use runout_core::site::{self, SiteData, SiteError};
use runout_core::spec::{SPEC_FORMAT, Spec};
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A checked campaign with the texts it came from.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// The campaign.
    pub campaign: Campaign,
    /// The site table; absent if every distribution is given.
    pub site: Option<SiteData>,
    /// The campaign file as written.
    pub campaign_text: String,
    /// The site table as written.
    pub site_text: Option<String>,
    /// The surface profile as written; absent if the campaign names none.
    pub profile_text: Option<String>,
}

/// A campaign that is ready to run: read, checked, fitted and frozen.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The campaign.
    pub campaign: Campaign,
    /// The site table; absent if every distribution is given.
    pub site: Option<SiteData>,
    /// The campaign file as written.
    pub campaign_text: String,
    /// The site table as written.
    pub site_text: Option<String>,
    /// The surface profile as written; absent if the campaign names none.
    pub profile_text: Option<String>,
    /// The fit.
    pub fit: Fit,
    /// The frozen spec.
    pub spec: Spec,
}

/// A user's file that cannot be used.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file cannot be read at all.
    #[error("{}: {why}", path.display())]
    Unreadable {
        /// File.
        path: PathBuf,
        /// What the system said, or what to do.
        why: String,
    },
    /// An override fits no campaign.
    #[error("{}: {change}: {why}", path.display())]
    Override {
        /// Campaign file.
        path: PathBuf,
        /// The override.
        change: Override,
        /// What is wrong.
        why: String,
    },
    /// The campaign file is wrong.
    #[error("{}: {error}", path.display())]
    Campaign {
        /// File.
        path: PathBuf,
        /// What is wrong.
        error: CampaignError,
    },
    /// The site table is wrong.
    #[error("{}: {error}", path.display())]
    Site {
        /// File.
        path: PathBuf,
        /// What is wrong.
        error: SiteError,
    },
    /// The surface profile is wrong.
    #[error("{}: {error}", path.display())]
    Profile {
        /// File.
        path: PathBuf,
        /// What is wrong.
        error: ProfileError,
    },
    /// The data cannot be fitted as asked.
    #[error("{}: {error}", path.display())]
    Fit {
        /// Campaign file.
        path: PathBuf,
        /// What is wrong.
        error: FitError,
    },
}

/// Reads and checks the campaign file at `path` and its site table; fits; freezes.
///
/// # Errors
/// A file that cannot be read, that is wrong, or whose data cannot be fitted as asked.
pub fn load(path: &Path) -> Result<Loaded, LoadError> {
    fit_and_freeze(path, read(path)?)
}

/// As [`load`], with some keys of the campaign file changed before it is checked.
///
/// # Errors
/// As [`load`], or an override that fits no campaign.
pub fn load_with(path: &Path, changes: &[Override]) -> Result<Loaded, LoadError> {
    let text = overrides::apply(&read_text(path)?, changes).map_err(|(change, why)| LoadError::Override {
        path: path.to_owned(),
        change,
        why,
    })?;
    fit_and_freeze(path, read_tables(path, text)?)
}

/// Fits and freezes what [`read`] gave for the campaign file at `path`.
///
/// # Errors
/// Data that cannot be fitted as asked.
pub fn fit_and_freeze(path: &Path, inputs: Inputs) -> Result<Loaded, LoadError> {
    let Inputs { campaign, site, campaign_text, site_text, profile_text } = inputs;
    let fit = fit::fit(&campaign.random, site.as_ref(), &campaign.fit)
        .map_err(|error| LoadError::Fit { path: path.to_owned(), error })?;
    let spec = Spec {
        format: SPEC_FORMAT,
        seed: campaign.seed,
        random: fit.random(&campaign.random),
        copula: fit.copula.best.clone(),
        model: campaign.model.clone(),
    };
    Ok(Loaded { campaign, site, campaign_text, site_text, profile_text, fit, spec })
}

/// Reads and checks the campaign file at `path`, its site table and its surface profile.
///
/// # Errors
/// A file that cannot be read or that is wrong.
pub fn read(path: &Path) -> Result<Inputs, LoadError> {
    read_tables(path, read_text(path)?)
}

/// Checks a campaign's text and reads its surface profile and site table; `path` is the campaign file.
fn read_tables(path: &Path, campaign_text: String) -> Result<Inputs, LoadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let profile = match campaign::profile_file(&campaign_text) {
        None => None,
        Some(named) => {
            let section = file_of(folder, &named, PROFILE_FILE);
            Some((read_text(&section)?, section))
        }
    };
    let campaign = parse(path, &campaign_text, profile.as_ref())?;
    let (site, site_text) = match &campaign.site {
        None => (None, None),
        Some(section) => {
            let table = file_of(folder, &section.data, SITE_FILE);
            let text = read_text(&table)?;
            let data = site::parse(&text, &section.columns, section.zeros)
                .map_err(|error| LoadError::Site { path: table, error })?;
            (Some(data), Some(text))
        }
    };
    let profile_text = profile.map(|(text, _)| text);
    Ok(Inputs { campaign, site, campaign_text, site_text, profile_text })
}

/// Parses campaign text with the text of its surface profile and the file that this is from.
///
/// # Errors
/// Texts that are wrong; `path` names the campaign file in messages.
pub fn parse(path: &Path, text: &str, profile: Option<&(String, PathBuf)>) -> Result<Campaign, LoadError> {
    let line = profile
        .map(|(text, section)| {
            profile::parse(text).map_err(|error| LoadError::Profile { path: section.clone(), error })
        })
        .transpose()?;
    campaign::parse_with_profile(text, line.as_ref())
        .map_err(|error| LoadError::Campaign { path: path.to_owned(), error })
}

/// As [`load`], from the texts that a run directory keeps; `path` names the campaign file in messages.
///
/// # Errors
/// Texts that are wrong, or whose data cannot be fitted as asked.
pub fn load_texts(
    path: &Path,
    campaign_text: String,
    site_text: Option<String>,
    profile_text: Option<String>,
) -> Result<Loaded, LoadError> {
    let missing = |name: &str| {
        let why = "there is no such file, and the campaign needs it".to_owned();
        LoadError::Unreadable { path: path.with_file_name(name), why }
    };
    let profile = match (campaign::profile_file(&campaign_text), &profile_text) {
        (None, _) => None,
        (Some(_), None) => return Err(missing(PROFILE_FILE)),
        (Some(_), Some(text)) => Some((text.clone(), path.with_file_name(PROFILE_FILE))),
    };
    let campaign = parse(path, &campaign_text, profile.as_ref())?;
    let site = match (&campaign.site, &site_text) {
        (Some(section), Some(text)) => {
            let table = path.with_file_name(SITE_FILE);
            Some(
                site::parse(text, &section.columns, section.zeros)
                    .map_err(|error| LoadError::Site { path: table, error })?,
            )
        }
        (Some(_), None) => return Err(missing(SITE_FILE)),
        (None, _) => None,
    };
    fit_and_freeze(path, Inputs { campaign, site, campaign_text, site_text, profile_text })
}

/// Where a file that a campaign file in `folder` names is. A run directory keeps it under a name of its own, whatever
/// the campaign file, kept as written, calls it.
fn file_of(folder: &Path, named: &str, kept: &str) -> PathBuf {
    let kept = folder.join(kept);
    if folder.join(SPEC_FILE).is_file() && kept.is_file() { kept } else { folder.join(named) }
}

/// Likeness (Jaro and Winkler's, 1 for equal ones) from which a name may have been meant.
const LIKE: f64 = 0.85;

/// The name in the same folder that is most like that of `path`, if one is.
fn nearest(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy();
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let names =
        std::fs::read_dir(folder).ok()?.flatten().map(|e| e.file_name().to_string_lossy().into_owned());
    names
        .map(|other| (strsim::jaro_winkler(&name, &other), other))
        .filter(|(likeness, _)| *likeness > LIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, other)| other)
}

fn read_text(path: &Path) -> Result<String, LoadError> {
    let unreadable = |why: String| LoadError::Unreadable { path: path.to_owned(), why };
    if path.is_dir() {
        let inside = path.join("campaign.toml");
        return Err(unreadable(if inside.is_file() {
            format!("it is a directory; did you mean {}?", inside.display())
        } else {
            "it is a directory, and a file is needed".to_owned()
        }));
    }
    let bytes = std::fs::read(path).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => unreadable(match nearest(path) {
            Some(name) => format!("there is no such file; did you mean {name}?"),
            None => "there is no such file".to_owned(),
        }),
        io::ErrorKind::PermissionDenied => unreadable("it may not be read (permission denied)".to_owned()),
        _ => unreadable(e.to_string()),
    })?;
    String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
        unreadable(format!("line {line}: it is not UTF-8 text"))
    })
}
