//! The campaign file: raw ([`file::CampaignFile`]), then checked ([`Campaign`]).
//!
//! A [`Campaign`] cannot be wrong: every number is finite and in its range, every word is a variant, every unit is
//! SI but for the random properties, whose marginals stay in the units of the measured table. There are no
//! defaults for physics: a missing key is an error.

mod check;
pub mod file;

use crate::copula;
use crate::marginal;
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
    /// Grid and points.
    pub mesh: Mesh,
    /// Material constants.
    pub soil: Soil,
    /// Pore water.
    pub water: Water,
    /// Numerical analysis.
    pub analysis: Analysis,
    /// What counts as a sample.
    pub sample: Sample,
    /// Most time steps of one realisation's failure stage.
    pub maximum_steps: u64,
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

/// Fitting recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recipe {
    /// As the paper's printed numbers: moments, inversion of Kendall's tau, ordinal ranks.
    Paper,
    /// Maximum likelihood throughout, average ranks.
    Likelihood,
}

/// Criterion that picks among families.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// Akaike's.
    Aic,
    /// Bayesian.
    Bic,
}

/// How marginals and copula are chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// Recipe.
    pub recipe: Recipe,
    /// Criterion.
    pub criterion: Criterion,
    /// One entry per random property, in property order.
    pub marginals: Vec<MarginalChoice>,
    /// The copula.
    pub copula: CopulaChoice,
}

/// How one marginal is chosen.
#[derive(Debug, Clone, PartialEq)]
pub enum MarginalChoice {
    /// Best family by the criterion.
    Auto,
    /// This family, fitted.
    Family(marginal::Family),
    /// Given: this distribution.
    Given(marginal::Marginal),
    /// This family with p and q from mean and standard deviation by Table 1's moments.
    Moments {
        /// Family.
        family: marginal::Family,
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sd: f64,
    },
}

/// How the copula is chosen.
#[derive(Debug, Clone, PartialEq)]
pub enum CopulaChoice {
    /// Best family by the criterion.
    Auto,
    /// This family, fitted, but for the parameters that are given.
    Family {
        /// Family.
        family: copula::Family,
        /// Given theta (two-property families).
        theta: Option<f64>,
        /// Given correlation matrix (Gaussian, Student t).
        correlation: Option<Vec<Vec<f64>>>,
        /// Given degrees of freedom (Student t).
        degrees_of_freedom: Option<f64>,
    },
}

/// Autocorrelation family. All are separable: the product of a function of the lag in each direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Autocorrelation {
    /// exp(-2 d / delta): the paper's Eq. 16.
    SingleExponential,
    /// exp(-pi (d / delta)^2).
    SquaredExponential,
    /// (1 + 4 d / delta) exp(-4 d / delta).
    SecondOrderMarkov,
    /// exp(-d / delta) cos(d / delta).
    CosineExponential,
    /// 1 - d / delta for d < delta, else 0.
    BinaryNoise,
}

/// Autocorrelation of the random fields.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Family.
    pub autocorrelation: Autocorrelation,
    /// Scale of fluctuation along the bedding, m.
    pub scale_horizontal_m: f64,
    /// Scale of fluctuation across the bedding, m.
    pub scale_vertical_m: f64,
    /// Dip of the bedding, rad.
    pub rotation_rad: f64,
}

/// Slope geometry. The toe is the origin; the soil stands at x < 0 and runs out towards x > 0; y is up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slope {
    /// Height from toe to crest, m.
    pub height_m: f64,
    /// Slope angle above the horizontal, rad.
    pub angle_rad: f64,
    /// Width of the crest behind the edge, m.
    pub crest_width_m: f64,
    /// Depth of the soil below toe level, m.
    pub foundation_depth_m: f64,
    /// Room in front of the toe, m.
    pub runout_plain_m: f64,
}

/// Background grid and material points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Side of a square cell, m.
    pub cell_size_m: f64,
    /// Points per cell and direction.
    pub points_per_cell_side: u32,
}

impl Mesh {
    /// Distance between neighbouring material points at the start, m.
    pub fn point_spacing_m(&self) -> f64 {
        self.cell_size_m / f64::from(self.points_per_cell_side)
    }
}

/// Material constants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Soil {
    /// Young's modulus of the skeleton, Pa.
    pub youngs_modulus_pa: f64,
    /// Poisson's ratio of the skeleton.
    pub poissons_ratio: f64,
    /// Cohesion, Pa, if not random.
    pub cohesion_pa: Option<f64>,
    /// Friction angle, rad, if not random.
    pub friction_angle_rad: Option<f64>,
    /// Saturated unit weight, N/m3, if not random.
    pub unit_weight_n_m3: Option<f64>,
    /// Dilation angle, rad.
    pub dilation_angle_rad: f64,
    /// Tension cut-off, Pa; absent: the Mohr-Coulomb apex alone limits tension.
    pub tension_cutoff_pa: Option<f64>,
    /// Porosity.
    pub porosity: f64,
    /// Hydraulic conductivity, m/s.
    pub permeability_m_s: f64,
}

/// Where the water table stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaterTable {
    /// At the ground surface everywhere.
    GroundSurface,
    /// At this elevation above the toe, m (at the ground surface where that is lower).
    ElevationM(f64),
}

/// Pore pressure at the start of the failure stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialPorePressure {
    /// Zero everywhere: only excess pore pressure develops.
    None,
    /// Water unit weight times the vertical depth below the water table, zero above it.
    Hydrostatic(WaterTable),
}

/// Hydraulic condition of the ground surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GroundSurface {
    /// Pore pressure zero (natural condition).
    Drained,
    /// No flow through it: water moves with the soil there.
    Closed,
}

/// Pore water.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Water {
    /// Density, kg/m3.
    pub density_kg_m3: f64,
    /// Bulk modulus used in the analysis, Pa.
    pub bulk_modulus_pa: f64,
    /// Pore pressure at the start.
    pub initial_pore_pressure: InitialPorePressure,
    /// Hydraulic condition of the ground surface.
    pub ground_surface: GroundSurface,
    /// Largest suction the water can carry, Pa.
    pub cavitation_suction_pa: f64,
}

/// One-phase or two-phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Formulation {
    /// Total unit weight, no water.
    OnePhase,
    /// Skeleton and water, v-w.
    TwoPhase,
}

/// Which volumetric strain increment the stresses see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VolumetricStrain {
    /// The cell's mean (B-bar): avoids locking.
    CellAverage,
    /// Each point's own.
    Point,
}

/// Which part of the point velocities decays at the PIC rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VelocityFilter {
    /// All that the grid does not see: the difference to the grid's velocity (PIC).
    Pic,
    /// The same, filtered twice, so that smooth motion loses less (XPIC(2); Hammerquist & Nairn 2017).
    Xpic,
}

/// How the domains of the points follow the deformation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointDomain {
    /// They keep their size (uGIMP).
    Uniform,
    /// Their sides follow the stretch along the axes, up to one cell (cpGIMP), against numerical fracture.
    Stretched,
}

/// Numerical analysis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Analysis {
    /// One-phase or two-phase.
    pub formulation: Formulation,
    /// Gravity, m/s2.
    pub gravity_m_s2: f64,
    /// Time step over the critical one.
    pub courant_number: f64,
    /// Which volumetric strain increment the stresses see.
    pub volumetric_strain: VolumetricStrain,
    /// Rate at which a point's pore pressure relaxes to its cell's mean, 1/s.
    pub pressure_relaxation_rate_per_s: f64,
    /// PIC share as a rate, 1/s: per step 1 - exp(-rate dt).
    pub pic_rate_per_s: f64,
    /// Which part of the point velocities decays at that rate.
    pub velocity_filter: VelocityFilter,
    /// Local damping in the failure stage, share of the unbalanced force (independent of the time step).
    pub local_damping: f64,
    /// Rate at which all velocities decay in the failure stage, 1/s.
    pub damping_rate_per_s: f64,
    /// Whether the points' domains follow their stretch.
    pub point_domain: PointDomain,
    /// Local damping of the gravity stage.
    pub gravity_stage_damping: f64,
    /// Duration of the gravity stage, s.
    pub gravity_stage_s: f64,
    /// Longest simulated time of the failure stage, s.
    pub duration_s: f64,
    /// Whether to stop once the material is at rest.
    pub stop_at_rest: bool,
    /// Rest, relative: kinetic energy below this share of its maximum.
    pub rest_kinetic_energy_share: f64,
    /// Rest, absolute: root mean square of the points' net velocity over several windows of `rest_hold_s` below
    /// this, m/s (see [`crate::gimp::RestRule`]).
    pub rest_velocity_m_s: f64,
    /// How long a rule for rest must hold, s.
    pub rest_hold_s: f64,
    /// Rest, absolute, two phases: change of pore pressure (root mean square over the points) in the time left, at its
    /// present rate, below which it has settled, Pa.
    pub rest_pore_pressure_change_pa: f64,
}

/// Which measure is the runout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunoutMeasure {
    /// 99.9 % quantile of displacement over the points.
    #[serde(rename = "displacement_q999")]
    DisplacementQ999,
    /// Largest displacement of any point (the paper's).
    MaxDisplacement,
    /// Advance of the contiguous front.
    ToeAdvance,
}

impl RunoutMeasure {
    /// This measure of `measures`, m.
    pub fn of(self, measures: &crate::outcome::Measures) -> f64 {
        match self {
            RunoutMeasure::DisplacementQ999 => measures.displacement_q999_m,
            RunoutMeasure::MaxDisplacement => measures.max_displacement_m,
            RunoutMeasure::ToeAdvance => measures.toe_advance_m,
        }
    }

    /// The name used in campaign files.
    pub fn name(self) -> &'static str {
        match self {
            RunoutMeasure::DisplacementQ999 => "displacement_q999",
            RunoutMeasure::MaxDisplacement => "max_displacement",
            RunoutMeasure::ToeAdvance => "toe_advance",
        }
    }
}

/// What counts as a sample of runout.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// Which measure is the runout.
    pub measure: RunoutMeasure,
    /// Threshold, m.
    pub threshold_m: f64,
}

/// When the campaign has enough realisations. Not part of the spec's identity: it moves no outcome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// The rule.
    pub rule: StopRule,
    /// Fewest realisations.
    pub minimum_realisations: u64,
    /// Most realisations.
    pub maximum_realisations: u64,
}

/// A stopping rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopRule {
    /// The paper's Eqs. 22-23: the last sample changed mean and variance by less than the tolerance.
    Paper {
        /// Tolerance, m for the mean and m2 for the variance, or a share of each if `relative`.
        tolerance: f64,
        /// Whether the tolerance is a share.
        relative: bool,
        /// How many samples in a row must meet it.
        patience: u64,
    },
    /// Confidence intervals narrow enough.
    Interval {
        /// Confidence level, in (0, 1).
        confidence: f64,
        /// Half-width over the mean.
        mean_half_width: Option<f64>,
        /// Half-width over the standard deviation.
        sd_half_width: Option<f64>,
        /// Exceedance probabilities that must be known well enough.
        exceedance: Vec<ExceedanceTarget>,
    },
}

/// An exceedance probability that must be known well enough.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExceedanceTarget {
    /// Runout distance, m.
    pub distance_m: f64,
    /// Half-width of the interval of the exceedance probability.
    pub half_width: f64,
}

/// What a failed realisation does to the campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnFailure {
    /// It is counted, shown and left out of the estimates.
    Exclude,
    /// It ends the campaign.
    Abort,
}

/// Behaviour of the run. Not part of the spec's identity: it moves no outcome.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// What a failed realisation does.
    pub on_failure: OnFailure,
    /// Share of realisations run twice and compared, on another worker if there is one.
    pub audit_fraction: f64,
}

/// Parses and checks campaign text.
///
/// # Errors
/// Bad TOML, missing or unknown keys (with a suggestion), values out of range; the message names the key, the
/// value and what is allowed.
pub fn parse(text: &str) -> Result<Campaign, CampaignError> {
    let file: file::CampaignFile = toml::from_str(text).map_err(|e| form_error(&e))?;
    check::check(&file)
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
