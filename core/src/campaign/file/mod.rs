//! The campaign file as written: one struct a section, edge units, unknown keys refused.
//!
//! Nothing here is checked beyond its type; `check` turns it into a [`super::Campaign`].
//!
//! Coordinates in the file (layers, water table, obstacles, elevations) are those of the surface profile; without one
//! the toe is the origin. x points downhill, y up.

mod ground;
mod water;

pub use ground::{
    ContactText, CutoffText, FrictionText, LayerSection, LineText, MeshSection, ObstacleSection,
    SlopeSection, SofteningSection, SoilSection,
};
pub use water::{WaterSection, WaterTableText};

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The whole campaign file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CampaignFile {
    /// Name of the campaign, for people.
    pub name: String,
    /// Seed of every random stream (0 to 2^63 - 1).
    pub seed: u64,
    /// Where the measured properties stand; absent if every distribution is given in `[fit]`.
    pub site: Option<SiteSection>,
    /// How marginals and copula are chosen.
    pub fit: FitSection,
    /// Autocorrelation of the random fields.
    pub field: FieldSection,
    /// Geometry.
    pub slope: SlopeSection,
    /// Rigid obstacles.
    #[serde(default)]
    pub obstacles: Vec<ObstacleSection>,
    /// Background grid and material points.
    pub mesh: MeshSection,
    /// Material constants.
    pub soil: SoilSection,
    /// Layers, from top to bottom.
    #[serde(default)]
    pub layers: Vec<LayerSection>,
    /// Pore water and free water.
    pub water: WaterSection,
    /// Numerical analysis.
    pub analysis: AnalysisSection,
    /// What counts as a sample of runout.
    pub sample: SampleSection,
    /// When the campaign has enough realisations.
    pub stop: StopSection,
    /// Limits and behaviour of the run.
    pub run: RunSection,
}

/// `[site]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiteSection {
    /// CSV file with a header, relative to the campaign file.
    pub data: String,
    /// Column of each random property: `cohesion_kpa = "name in the header"`.
    pub columns: BTreeMap<String, String>,
    /// `"keep"`, `"drop"` or `{ floor = value }`.
    pub zeros: ZeroRuleText,
}

/// `zeros = "keep" | "drop" | { floor = value }`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ZeroRuleText {
    /// `"keep"` or `"drop"`.
    Word(String),
    /// `{ floor = value }` in the property's edge unit.
    Floor {
        /// The value put in place of zero.
        floor: f64,
    },
}

/// `[fit]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitSection {
    /// `"paper"` or `"likelihood"`.
    pub recipe: String,
    /// `"aic"` or `"bic"`: what picks among families.
    pub criterion: String,
    /// `[fit.marginals.<property>]`: a forced family or a given distribution.
    #[serde(default)]
    pub marginals: BTreeMap<String, MarginalChoiceText>,
    /// `[fit.copula]`: a forced family or a given copula.
    pub copula: Option<CopulaChoiceText>,
}

/// A forced family, or a distribution given by (p, q) or by (mean, sd).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarginalChoiceText {
    /// `"trunc-normal"`, `"lognormal"`, `"trunc-gumbel"` or `"weibull"`.
    pub family: String,
    /// First parameter of the paper's Table 1.
    pub p: Option<f64>,
    /// Second parameter of the paper's Table 1.
    pub q: Option<f64>,
    /// Mean, from which p and q follow by the method of moments (with `sd`).
    pub mean: Option<f64>,
    /// Standard deviation (with `mean`).
    pub sd: Option<f64>,
}

/// A forced copula family, or a given copula.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CopulaChoiceText {
    /// `"independent"`, `"gaussian"`, `"plackett"`, `"frank"`, `"no16"` or `"student-t"`.
    pub family: String,
    /// Parameter of a two-property copula; fitted if absent.
    pub theta: Option<f64>,
    /// Correlation matrix of a Gaussian or Student t copula, rows in property order; fitted if absent.
    pub correlation: Option<Vec<Vec<f64>>>,
    /// Degrees of freedom of a Student t copula; fitted if absent.
    pub degrees_of_freedom: Option<f64>,
}

/// `[field]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldSection {
    /// `"single-exponential"`, `"squared-exponential"`, `"second-order-markov"`, `"cosine-exponential"` or
    /// `"binary-noise"`.
    pub autocorrelation: String,
    /// Scale of fluctuation along the bedding, m.
    pub scale_of_fluctuation_horizontal_m: f64,
    /// Scale of fluctuation across the bedding, m.
    pub scale_of_fluctuation_vertical_m: f64,
    /// Dip of the bedding, degrees; positive turns the horizontal axis anticlockwise.
    pub rotation_deg: f64,
}

/// `[analysis]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnalysisSection {
    /// `"one-phase"` (total unit weight, no water) or `"two-phase"`.
    pub formulation: String,
    /// Gravity, m/s2.
    pub gravity_m_s2: f64,
    /// Time step over the critical one.
    pub courant_number: f64,
    /// `"cell-average"` (B-bar) or `"point"`: which volumetric strain increment the stresses see.
    pub volumetric_strain: String,
    /// Rate at which a point's pore pressure relaxes to its cell's mean, 1/s; 0 for none.
    pub pressure_relaxation_rate_per_s: f64,
    /// Rate at which point velocities relax to the grid's (PIC share), 1/s; 0 is pure FLIP.
    pub pic_rate_per_s: f64,
    /// Which part of the point velocities decays at that rate: `"pic"`, all that the grid does not see, or `"xpic"`,
    /// the same filtered twice, so that smooth motion loses less.
    pub velocity_filter: String,
    /// Local damping in the failure stage, as a share of the unbalanced force; 0 for none.
    pub local_damping: f64,
    /// Rate at which all velocities decay in the failure stage, 1/s; 0 for none.
    pub damping_rate_per_s: f64,
    /// `"uniform"` (uGIMP) or `"stretched"` (cpGIMP: the points' domains follow their stretch).
    pub point_domain: String,
    /// `"gravity"`, a stage of its own that brings the elastic, drained ground to rest under its weight, or
    /// `{ k0 = 0.5 }`: vertical effective stress from the weight of the column above less the pore pressure, horizontal
    /// effective stress k0 times that, no shear. The latter is not in equilibrium under inclined ground.
    pub initial_stress: InitialStressText,
    /// Local damping of the gravity stage, as a share of the unbalanced force; not used with `k0`.
    pub gravity_stage_damping: f64,
    /// Duration of the gravity stage, s; not used with `k0`.
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
    /// Rest, absolute, two phases: at its present rate the pore pressure (root mean square over the points) would
    /// change by less than this in the time left, kPa.
    pub rest_pore_pressure_change_kpa: f64,
    /// Share of the available energy by which the balance of energy may drift before a realisation is marked.
    pub energy_drift_limit: f64,
}

/// `initial_stress = "gravity" | { k0 = value }`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged, expecting = "it must be \"gravity\" or { k0 = value }")]
pub enum InitialStressText {
    /// `"gravity"`.
    Word(String),
    /// `{ k0 = value }`.
    K0(K0Text),
}

/// `{ k0 = value }`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct K0Text {
    /// Horizontal over vertical effective stress.
    pub k0: f64,
}

/// `[sample]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampleSection {
    /// `"displacement_q999"`, `"max_displacement"` or `"toe_advance"`.
    pub measure: String,
    /// A realisation is a sample of runout if its measure is above this, m.
    pub threshold_m: f64,
    /// Whether every realisation records its profile along the ground; absent: it does not. It moves nothing.
    #[serde(default)]
    pub profile: bool,
}

/// `[stop]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StopSection {
    /// `"paper"` (Eqs. 22-23) or `"interval"`.
    pub rule: String,
    /// Fewest realisations.
    pub minimum_realisations: u64,
    /// Most realisations.
    pub maximum_realisations: u64,
    /// Paper's rule: largest change of mean (m) and variance (m2) by the last sample.
    pub tolerance: Option<f64>,
    /// Paper's rule: whether the tolerance is a share of the mean and of the variance.
    pub relative: Option<bool>,
    /// Paper's rule: how many samples in a row must meet it.
    pub patience: Option<u64>,
    /// Interval rule: confidence level.
    pub confidence: Option<f64>,
    /// Interval rule: half-width of the mean's interval over the mean.
    pub mean_half_width: Option<f64>,
    /// Interval rule: half-width of the standard deviation's interval over the standard deviation.
    pub sd_half_width: Option<f64>,
    /// Interval rule: exceedance probabilities that must be known well enough.
    #[serde(default)]
    pub exceedance: Vec<ExceedanceTargetText>,
}

/// `[[stop.exceedance]]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExceedanceTargetText {
    /// Runout distance, m.
    pub distance_m: f64,
    /// Half-width of the interval of the exceedance probability (absolute).
    pub half_width: f64,
}

/// `[run]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSection {
    /// Most time steps of one realisation's failure stage.
    pub maximum_steps: u64,
    /// `"exclude"` (count failed realisations and go on) or `"abort"`.
    pub on_failure: String,
    /// Share of realisations, chosen by the seed, that are run twice and compared bit for bit: on another worker, or
    /// by the same one again where it is alone, which still finds faulty memory. What is due when the campaign ends
    /// is run then, within a time limit; what is not run after all is counted.
    pub audit_fraction: f64,
}
