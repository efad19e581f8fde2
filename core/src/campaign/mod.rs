//! The campaign file: raw ([`file::CampaignFile`]), then checked ([`Campaign`]).
//!
//! A [`Campaign`] cannot be wrong: every number is finite and in its range, every word is a variant, every unit is
//! SI but for the random properties, whose marginals stay in the units of the measured table. There are no
//! defaults for physics: a missing key is an error.

mod analysis;
mod check;
mod field;
pub mod file;
mod fitting;
mod ground;
mod polyline;
pub mod profile;
mod stopping;
mod water;

pub use analysis::{Analysis, Formulation, InitialStress, PointDomain, VelocityFilter, VolumetricStrain};
pub use field::{Autocorrelation, Field};
pub use fitting::{CopulaChoice, Criterion, FitSettings, MarginalChoice, Recipe};
pub use ground::{Contact, Layer, Mesh, Obstacle, Slope, Softening, Soil, Surface};
pub use polyline::{LineFault, MOST_POINTS, Polyline};
pub use stopping::{ExceedanceTarget, OnFailure, Run, RunoutMeasure, Sample, Stop, StopRule};
pub use water::{GroundSurface, InitialPorePressure, Water, WaterAboveTable, WaterTable};

use crate::site::{Property, ZeroRule};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A fault in a campaign file; the caller adds the file's name.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CampaignError {
    /// The text is not TOML of the right form: bad syntax, a missing or an unknown key, a wrong type.
    #[error("{message}{}", suggestion.as_ref().map(|s| format!("\ndid you mean `{s}`?")).unwrap_or_default())]
    Form {
        /// What the parser said, with line and column.
        message: String,
        /// The nearest known key.
        suggestion: Option<String>,
    },
    /// A value outside its range.
    #[error("{key} = {value} is not allowed; {allowed}")]
    Value {
        /// Full key, for example `field.scale_of_fluctuation_vertical_m`.
        key: String,
        /// The value found.
        value: String,
        /// What is allowed, in words.
        allowed: String,
    },
}

/// A checked campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Name, for people.
    pub name: String,
    /// Seed of every random stream.
    pub seed: u64,
    /// The site table; absent if every distribution is given.
    pub site: Option<Site>,
    /// How marginals and copula are chosen.
    pub fit: FitSettings,
    /// The random properties, in the order of [`Property::ALL`].
    pub random: Vec<Property>,
    /// What the realisations are made of.
    pub model: Model,
    /// When to stop.
    pub stop: Stop,
    /// Limits and behaviour.
    pub run: Run,
}

/// Everything but distributions and seed that an outcome depends on; SI units. Part of the frozen spec.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Autocorrelation of the fields.
    pub field: Field,
    /// Geometry.
    pub slope: Slope,
    /// Rigid obstacles.
    pub obstacles: Vec<Obstacle>,
    /// Grid and points.
    pub mesh: Mesh,
    /// Constants of the material that everything is made of where there are no layers.
    pub soil: Soil,
    /// Layers from top to bottom; none: the ground is of one material.
    pub layers: Vec<Layer>,
    /// Pore water and free water.
    pub water: Water,
    /// Numerical analysis.
    pub analysis: Analysis,
    /// What counts as a sample.
    pub sample: Sample,
    /// Most time steps of one realisation's failure stage.
    pub maximum_steps: u64,
}

impl Model {
    /// The materials in the order in which the points count them: the layers', or the one of the whole ground.
    pub fn materials(&self) -> Vec<&Soil> {
        if self.layers.is_empty() { vec![&self.soil] } else { self.layers.iter().map(|l| &l.soil).collect() }
    }
}

/// Where the measured properties stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// File name relative to the campaign file.
    pub data: String,
    /// Column of each property.
    pub columns: Vec<(Property, String)>,
    /// What to do with zeros.
    pub zeros: ZeroRule,
}

/// Parses and checks the text of a campaign without a surface profile.
///
/// # Errors
/// As [`parse_with_profile`].
pub fn parse(text: &str) -> Result<Campaign, CampaignError> {
    parse_with_profile(text, None)
}

/// Parses and checks campaign text; `profile` is the surface profile that it names, in the profile's coordinates.
///
/// # Errors
/// Bad TOML, missing or unknown keys (with a suggestion), values out of range; the message names the key, the
/// value and what is allowed.
pub fn parse_with_profile(text: &str, profile: Option<&Polyline>) -> Result<Campaign, CampaignError> {
    let file: file::CampaignFile = toml::from_str(text).map_err(|e| form_error(&e))?;
    check::check(&file, profile)
}

/// The file of the surface profile that campaign text names; none if it names none or is not of the right form, which
/// parsing it will tell.
pub fn profile_file(text: &str) -> Option<String> {
    let file: file::CampaignFile = toml::from_str(text).ok()?;
    file.slope.profile
}

fn form_error(error: &toml::de::Error) -> CampaignError {
    let message = error.to_string().trim_end().to_owned();
    let mut words = error.message().split('`').skip(1).step_by(2);
    let suggestion = words.next().filter(|_| error.message().starts_with("unknown")).and_then(|unknown| {
        words
            .map(|known| (strsim::jaro_winkler(unknown, known), known))
            .filter(|(likeness, _)| *likeness > 0.8)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, known)| known.to_owned())
    });
    CampaignError::Form { message, suggestion }
}
