//! The ground's sections: `[slope]`, `[[obstacles]]`, `[mesh]`, `[soil]`, `[[layers]]`.

use serde::{Deserialize, Serialize};

/// `[slope]`: either height, angle and crest width, or a profile with the positions of toe and crest.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlopeSection {
    /// Height from toe to crest, m.
    pub height_m: Option<f64>,
    /// Slope angle above the horizontal, degrees.
    pub angle_deg: Option<f64>,
    /// Width of the crest behind the edge, m.
    pub crest_width_m: Option<f64>,
    /// CSV file of the ground surface (columns `x_m` and `y_m`, from uphill to downhill; the same x twice is a vertical
    /// step), relative to the campaign file. The left wall stands at its first point.
    pub profile: Option<String>,
    /// With a profile: where the toe's advance counts from, m; its elevation is the profile's (at a step, the lower
    /// side's).
    pub toe_x_m: Option<f64>,
    /// With a profile: where the crest's retreat counts from, m; its elevation is the profile's.
    pub crest_x_m: Option<f64>,
    /// Depth of the soil below toe level, m; 0 puts the rigid base at toe level.
    pub foundation_depth_m: f64,
    /// Room in front of the toe, m. A profile that ends earlier goes on level; one that is longer is cut.
    pub runout_plain_m: f64,
    /// How the rigid base holds the soil: `"fixed"` or `{ friction = coefficient }`. Friction acts from the start of the
    /// failure stage; in the gravity stage the base is fixed.
    pub base: ContactText,
}

/// `"fixed" | { friction = coefficient }`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged, expecting = "it must be \"fixed\" or { friction = coefficient }")]
pub enum ContactText {
    /// `"fixed"`.
    Word(String),
    /// `{ friction = coefficient }`.
    Friction(FrictionText),
}

/// `{ friction = coefficient }`
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionText {
    /// Coulomb friction coefficient: the tangent of the angle of wall friction.
    pub friction: f64,
}

/// `[[obstacles]]`: a rigid rectangle in the way of the slide, for example a wall. It is there from the start of the
/// failure stage on.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSection {
    /// Smallest and largest x, m.
    pub x_m: [f64; 2],
    /// Smallest and largest y, m.
    pub y_m: [f64; 2],
    /// How its sides hold what touches them: `"fixed"` or `{ friction = coefficient }`.
    pub contact: ContactText,
}

/// `[mesh]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshSection {
    /// Side of a square grid cell, m.
    pub cell_size_m: f64,
    /// Material points per cell and direction (2 gives four points a cell).
    pub points_per_cell_side: u32,
}

/// `[soil]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoilSection {
    /// Young's modulus of the skeleton, MPa.
    pub youngs_modulus_mpa: f64,
    /// Poisson's ratio of the skeleton.
    pub poissons_ratio: f64,
    /// Cohesion, kPa; only if it is not a random property.
    pub cohesion_kpa: Option<f64>,
    /// Friction angle, degrees; only if it is not a random property.
    pub friction_angle_deg: Option<f64>,
    /// Saturated (total) unit weight, kN/m3; only if it is not a random property.
    pub unit_weight_kn_m3: Option<f64>,
    /// Dilation angle, degrees.
    pub dilation_angle_deg: f64,
    /// Tension cut-off, kPa, or `"apex"` for none but the Mohr-Coulomb apex.
    pub tension_cutoff_kpa: CutoffText,
    /// `[soil.softening]`: decay of strength with plastic strain; absent, the soil is perfectly plastic.
    pub softening: Option<SofteningSection>,
    /// Porosity.
    pub porosity: f64,
    /// Hydraulic conductivity, m/s.
    pub permeability_m_s: f64,
}

/// `tension_cutoff_kpa = number | "apex"`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged)]
pub enum CutoffText {
    /// Largest tensile principal stress, kPa.
    Value(f64),
    /// `"apex"`.
    Word(String),
}

/// `[soil.softening]` and `[layers.softening]`: from peak to residual as exp(-d / displacement_m) with the shear
/// displacement d across a band one cell wide, so that the energy a band takes does not hang on the cell's size.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SofteningSection {
    /// Residual over peak cohesion, from 0 to 1 (1 does not soften).
    pub residual_cohesion_ratio: f64,
    /// Residual over peak friction angle, from 0 to 1.
    pub residual_friction_ratio: f64,
    /// Residual over peak dilation angle, from 0 to 1.
    pub residual_dilation_ratio: f64,
    /// Shear displacement over which the difference to the residual falls to 1/e, m.
    pub displacement_m: f64,
}

/// `[[layers]]`, from top to bottom: a point belongs to the first layer whose bottom lies below it. A constant that a
/// layer does not give is that of `[soil]`, softening included. The random properties follow `random`: all layers
/// with `random = true` are cut out of the same random fields and give none of these properties, all others give each of
/// them.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayerSection {
    /// Its name, for people; each layer another one.
    pub name: String,
    /// Its lower boundary: an elevation, m, or a line `[[x, y], ...]`, level beyond its ends. The last layer has none.
    pub bottom: Option<LineText>,
    /// Whether the random properties are the random fields here.
    pub random: bool,
    /// Young's modulus of the skeleton, MPa.
    pub youngs_modulus_mpa: Option<f64>,
    /// Poisson's ratio of the skeleton.
    pub poissons_ratio: Option<f64>,
    /// Cohesion, kPa.
    pub cohesion_kpa: Option<f64>,
    /// Friction angle, degrees.
    pub friction_angle_deg: Option<f64>,
    /// Saturated (total) unit weight, kN/m3.
    pub unit_weight_kn_m3: Option<f64>,
    /// Dilation angle, degrees.
    pub dilation_angle_deg: Option<f64>,
    /// Tension cut-off, kPa, or `"apex"`.
    pub tension_cutoff_kpa: Option<CutoffText>,
    /// `[layers.softening]`: a layer that does not soften, of a `[soil]` that does, has residual ratios of 1.
    pub softening: Option<SofteningSection>,
    /// Porosity.
    pub porosity: Option<f64>,
    /// Hydraulic conductivity, m/s.
    pub permeability_m_s: Option<f64>,
}

/// `elevation | [[x, y], ...]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged, expecting = "it must be an elevation or a line [[x, y], ...]")]
pub enum LineText {
    /// A level line at this elevation, m.
    Level(f64),
    /// Points from left to right, m.
    Line(Vec<[f64; 2]>),
}
