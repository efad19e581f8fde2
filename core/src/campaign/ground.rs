//! The ground: surface, base, obstacles, grid and points, materials and layers.
//!
//! Coordinates are those of the checked campaign: the toe is the origin, the soil stands at x < 0 and runs out
//! towards x > 0, y is up.

use super::Polyline;
use crate::site::Property;
use serde::{Deserialize, Serialize};

/// Slope geometry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slope {
    /// Ground surface before failure.
    pub surface: Surface,
    /// Depth of the soil below toe level, m.
    pub foundation_depth_m: f64,
    /// Room in front of the toe, m.
    pub runout_plain_m: f64,
    /// How the rigid base holds the soil.
    pub base: Contact,
}

/// Ground surface before failure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Surface {
    /// A level crest, a face of one angle, a level plain at the toe's elevation.
    Uniform {
        /// Height from toe to crest, m.
        height_m: f64,
        /// Slope angle above the horizontal, rad.
        angle_rad: f64,
        /// Width of the crest behind the edge, m.
        crest_width_m: f64,
    },
    /// A surveyed section.
    Profile {
        /// The section, from behind the crest to where it ends; level beyond its end.
        line: Polyline,
        /// Where the crest's retreat counts from, m (negative).
        crest_x_m: f64,
    },
}

/// How a rigid surface holds the material that touches it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contact {
    /// The material's velocity there is zero.
    Fixed,
    /// Coulomb friction of this coefficient, without adhesion.
    Friction(f64),
}

/// A rigid rectangle in the way, for example a wall; its sides are moved to the nearest grid lines.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Smallest and largest x, m.
    pub x_m: [f64; 2],
    /// Smallest and largest y, m.
    pub y_m: [f64; 2],
    /// How its sides hold the material.
    pub contact: Contact,
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
    /// Decay of strength; absent: perfectly plastic.
    pub softening: Option<Softening>,
    /// Porosity.
    pub porosity: f64,
    /// Hydraulic conductivity, m/s.
    pub permeability_m_s: f64,
}

impl Soil {
    /// The constant of a property, SI; absent where it is random.
    pub fn constant(&self, property: Property) -> Option<f64> {
        match property {
            Property::Cohesion => self.cohesion_pa,
            Property::FrictionAngle => self.friction_angle_rad,
            Property::UnitWeight => self.unit_weight_n_m3,
        }
    }
}

/// Exponential decay of strength from peak to residual with the shear displacement across a band one cell wide (see
/// [`crate::gimp::Softening`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Softening {
    /// Residual over peak cohesion, in [0, 1].
    pub residual_cohesion_ratio: f64,
    /// Residual over peak friction angle, in [0, 1].
    pub residual_friction_ratio: f64,
    /// Residual over peak dilation angle, in [0, 1].
    pub residual_dilation_ratio: f64,
    /// Shear displacement over which the difference to the residual falls to 1/e, m.
    pub displacement_m: f64,
}

/// A layer of the ground. A point belongs to the first layer, from the top, whose bottom lies below it, so that a
/// layer pinches out where its bottom meets that of a layer above.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Name, for people.
    pub name: String,
    /// Its lower boundary; absent: the rigid base.
    pub bottom: Option<Polyline>,
    /// Its constants, complete; absent where it takes the random fields.
    pub soil: Soil,
}
