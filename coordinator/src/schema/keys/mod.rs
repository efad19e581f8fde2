//! The description of the campaign file, section by section.

mod analysis;
mod campaign;
mod slope;
mod soil_data;

use super::{Key, Kind, Section};
use analysis::ANALYSIS;
use campaign::{EXCEEDANCE, RUN, SAMPLE, STOP};
use slope::{LAYER, MESH, OBSTACLE, SLOPE, SOFTENING, SOIL, WATER};
use soil_data::{COPULA, FIELD, FIT, MARGINAL, SITE};

/// The random properties.
pub(super) const PROPERTIES: &[&str] = &["cohesion_kpa", "friction_angle_deg", "unit_weight_kn_m3"];

/// Every section, in the file's order.
pub const SECTIONS: &[Section] = &[
    TOP, SITE, FIT, MARGINAL, COPULA, FIELD, SLOPE, OBSTACLE, MESH, SOIL, SOFTENING, LAYER, WATER, ANALYSIS,
    SAMPLE, STOP, EXCEEDANCE, RUN,
];

const fn needed(name: &'static str, kind: Kind, meaning: &'static str) -> Key {
    Key { name, kind, absent: None, meaning }
}

const fn optional(name: &'static str, kind: Kind, absent: &'static str, meaning: &'static str) -> Key {
    Key { name, kind, absent: Some(absent), meaning }
}

const TOP: Section = Section {
    name: "",
    header: "",
    meaning: "A campaign file is TOML. Keys that are not known are refused. Nothing that moves the answer has a default: a key \
              that is needed and missing is an error. Coordinates are those of the surface profile; without one the toe is \
              the origin. x points downhill, y up.",
    keys: &[
        needed("name", Kind::Text, "Name of the campaign, for people; not empty."),
        needed(
            "seed",
            Kind::Whole(0, i64::MAX as u64),
            "Seed of every random stream: the same seed gives the same bits on any machine.",
        ),
        optional(
            "site",
            Kind::Table("site"),
            "every distribution and the copula are given in [fit]",
            "The measured properties.",
        ),
        needed("fit", Kind::Table("fit"), "How marginals and copula are chosen."),
        needed("field", Kind::Table("field"), "Autocorrelation of the random fields."),
        needed("slope", Kind::Table("slope"), "Geometry."),
        optional("obstacles", Kind::Tables("obstacles"), "there are none", "Rigid obstacles in the way."),
        needed("mesh", Kind::Table("mesh"), "Background grid and material points."),
        needed("soil", Kind::Table("soil"), "Material constants."),
        optional(
            "layers",
            Kind::Tables("layers"),
            "the ground is of one material",
            "Layers, from top to bottom.",
        ),
        needed("water", Kind::Table("water"), "Pore water and free water."),
        needed("analysis", Kind::Table("analysis"), "Numerical analysis."),
        needed("sample", Kind::Table("sample"), "What counts as a sample of runout."),
        needed("stop", Kind::Table("stop"), "When the campaign has enough realisations."),
        needed("run", Kind::Table("run"), "Limits and behaviour of the run."),
    ],
};
