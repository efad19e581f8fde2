//! The only reader of user files: campaign file and site data in, frozen spec out.

use runout_core::campaign::{self, Campaign, CampaignError, CopulaChoice, MarginalChoice};
use runout_core::copula::{Copula, Family};
use runout_core::site::{self, SiteData, SiteError};
use runout_core::spec::{RandomProperty, SPEC_FORMAT, Spec};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A campaign with everything it names.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The checked campaign.
    pub campaign: Campaign,
    /// The site data.
    pub site: Option<SiteData>,
    /// Text of the campaign file.
    pub campaign_text: String,
    /// Text of the site data.
    pub site_text: Option<String>,
    /// The frozen spec.
    pub spec: Spec,
}

/// User files that cannot be used.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The system refused.
    #[error("{}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
    /// The campaign file is wrong.
    #[error("{}: {error}", path.display())]
    Campaign {
        /// The file.
        path: PathBuf,
        /// How.
        error: CampaignError,
    },
    /// The site data is wrong.
    #[error("{}: {error}", path.display())]
    Site {
        /// The file.
        path: PathBuf,
        /// How.
        error: SiteError,
    },
}

/// Reads the campaign at `path` and what it names.
///
/// # Errors
/// A file that is missing or wrong.
pub fn load(path: &Path) -> Result<Loaded, LoadError> {
    let read = |path: &Path| {
        fs::read_to_string(path).map_err(|error| LoadError::File { path: path.to_owned(), error })
    };
    let campaign_text = read(path)?;
    let campaign = campaign::parse(&campaign_text)
        .map_err(|error| LoadError::Campaign { path: path.to_owned(), error })?;
    let mut site_text = None;
    let mut site = None;
    if let Some(wanted) = &campaign.site {
        let data = path.with_file_name(&wanted.data);
        let text = read(&data)?;
        let parsed = site::parse(&text, &wanted.columns, wanted.zeros);
        site = Some(parsed.map_err(|error| LoadError::Site { path: data, error })?);
        site_text = Some(text);
    }
    let marginals = campaign.random.iter().zip(&campaign.fit.marginals);
    let random = marginals
        .map(|(property, choice)| match choice {
            MarginalChoice::Given(marginal) => RandomProperty { property: *property, marginal: *marginal },
            _ => unreachable!("only given distributions"),
        })
        .collect();
    let copula = match &campaign.fit.copula {
        CopulaChoice::Family { family: Family::Frank, theta: Some(theta), .. } => {
            Copula::Frank { theta: *theta }
        }
        _ => Copula::Independent { dimension: campaign.random.len() },
    };
    let spec =
        Spec { format: SPEC_FORMAT, seed: campaign.seed, random, copula, model: campaign.model.clone() };
    Ok(Loaded { campaign, site, campaign_text, site_text, spec })
}
