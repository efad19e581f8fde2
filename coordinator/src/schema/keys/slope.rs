//! The slope and what it is made of: `[slope]`, `[[obstacles]]`, `[mesh]`, `[soil]`, `[[layers]]`, `[water]`.

use super::{needed, optional};
use crate::schema::{ANY, Kind, NON_NEGATIVE, POSITIVE, Range, Section, between};

/// How a rigid surface holds the soil.
const CONTACT: Kind = Kind::Either(&[Kind::Words(&["fixed"]), Kind::With("friction", between(0.0, 10.0))]);

pub(super) const SLOPE: Section = Section {
    name: "slope",
    header: "[slope]",
    meaning: "Geometry: either height, angle and crest width, or a surveyed profile with the positions of toe and crest.",
    keys: &[
        optional("height_m", Kind::Number(POSITIVE), "a profile gives it", "Height from toe to crest."),
        optional(
            "angle_deg",
            Kind::Number(between(1.0, 90.0)),
            "a profile gives it",
            "Slope angle above the horizontal.",
        ),
        optional(
            "crest_width_m",
            Kind::Number(POSITIVE),
            "a profile gives it",
            "Width of the crest behind the edge.",
        ),
        optional(
            "profile",
            Kind::Text,
            "height, angle and crest width give the surface",
            "CSV file of the ground surface (columns x_m and y_m, from uphill to downhill; the same x twice is a vertical \
             step), relative to the campaign file. The left wall stands at its first point.",
        ),
        optional(
            "toe_x_m",
            Kind::Number(ANY),
            "without a profile",
            "With a profile: where the toe's advance counts from. Its elevation is the profile's, at a step the lower side's.",
        ),
        optional(
            "crest_x_m",
            Kind::Number(ANY),
            "without a profile",
            "With a profile: where the crest's retreat counts from; uphill of the toe and above it.",
        ),
        needed(
            "foundation_depth_m",
            Kind::Number(NON_NEGATIVE),
            "Depth of the soil below toe level; 0 puts the rigid base at toe level.",
        ),
        needed(
            "runout_plain_m",
            Kind::Number(POSITIVE),
            "Room in front of the toe. A profile that ends earlier goes on level; one that is longer is cut.",
        ),
        needed(
            "base",
            CONTACT,
            "How the rigid base holds the soil; friction is a Coulomb coefficient. Friction acts from the start of the failure \
             stage; in the gravity stage the base is fixed.",
        ),
    ],
};

pub(super) const OBSTACLE: Section = Section {
    name: "obstacles",
    header: "[[obstacles]]",
    meaning: "A rigid rectangle in the way of the slide, for example a wall; it is there from the start of the failure stage on, \
              and its sides move to the nearest grid lines. It stands on the ground or above it. At most 1000.",
    keys: &[
        needed("x_m", Kind::Pair, "Smallest and largest x, at least a cell apart."),
        needed("y_m", Kind::Pair, "Smallest and largest y, at least a cell apart."),
        needed(
            "contact",
            CONTACT,
            "How its sides hold what touches them; friction is a Coulomb coefficient.",
        ),
    ],
};

pub(super) const MESH: Section = Section {
    name: "mesh",
    header: "[mesh]",
    meaning: "Background grid and material points.",
    keys: &[
        needed(
            "cell_size_m",
            Kind::Number(POSITIVE),
            "Side of a square grid cell; at most a quarter of the slope's height. The runout of a perfectly plastic slope grows \
             as it shrinks.",
        ),
        needed(
            "points_per_cell_side",
            Kind::Whole(2, 4),
            "Material points per cell and direction: 2 gives four points a cell.",
        ),
    ],
};

/// A constant that only one section gives.
const RANDOM: &str = "it is a random property";
/// A constant that a layer may give.
const SHARED: &str = "that of [soil]";

const CUTOFF: Kind = Kind::Either(&[Kind::Words(&["apex"]), Kind::Number(NON_NEGATIVE)]);
const POROSITY: Range = Range { low: Some((0.0, false)), high: Some((1.0, false)) };
const POISSON: Range = Range { low: Some((0.0, true)), high: Some((0.5, false)) };

pub(super) const SOIL: Section = Section {
    name: "soil",
    header: "[soil]",
    meaning: "Material constants of the ground, or those that its layers share.",
    keys: &[
        needed("youngs_modulus_mpa", Kind::Number(POSITIVE), "Young's modulus of the skeleton."),
        needed("poissons_ratio", Kind::Number(POISSON), "Poisson's ratio of the skeleton."),
        optional("cohesion_kpa", Kind::Number(NON_NEGATIVE), RANDOM, "Cohesion."),
        optional("friction_angle_deg", Kind::Number(between(0.0, 80.0)), RANDOM, "Friction angle."),
        optional(
            "unit_weight_kn_m3",
            Kind::Number(NON_NEGATIVE),
            RANDOM,
            "Saturated (total) unit weight; more than that of the pore water, under free water than that of water.",
        ),
        needed("dilation_angle_deg", Kind::Number(between(0.0, 60.0)), "Dilation angle."),
        needed(
            "tension_cutoff_kpa",
            CUTOFF,
            "Largest tensile principal stress, or \"apex\" where the Mohr-Coulomb apex alone limits tension.",
        ),
        optional(
            "softening",
            Kind::Table("softening"),
            "the soil is perfectly plastic",
            "[soil.softening]: decay of strength with plastic strain.",
        ),
        needed("porosity", Kind::Number(POROSITY), "Porosity."),
        needed("permeability_m_s", Kind::Number(POSITIVE), "Hydraulic conductivity."),
    ],
};

pub(super) const SOFTENING: Section = Section {
    name: "softening",
    header: "[soil.softening] or [layers.softening]",
    meaning: "From peak to residual as exp(-d / displacement_m) with the shear displacement d across a band one cell wide, so \
              that the energy that a band takes does not hang on the cell's size.",
    keys: &[
        needed(
            "residual_cohesion_ratio",
            Kind::Number(between(0.0, 1.0)),
            "Residual over peak cohesion; 1 does not soften.",
        ),
        needed(
            "residual_friction_ratio",
            Kind::Number(between(0.0, 1.0)),
            "Residual over peak friction angle.",
        ),
        needed(
            "residual_dilation_ratio",
            Kind::Number(between(0.0, 1.0)),
            "Residual over peak dilation angle.",
        ),
        needed(
            "displacement_m",
            Kind::Number(POSITIVE),
            "Shear displacement over which the difference to the residual falls to 1/e.",
        ),
    ],
};

pub(super) const LAYER: Section = Section {
    name: "layers",
    header: "[[layers]]",
    meaning: "From top to bottom: a point belongs to the first layer whose bottom lies below it. All layers with random = true are \
              cut out of the same random fields and give none of the random properties; all others give each of them. At most \
              1000.",
    keys: &[
        needed("name", Kind::Text, "Its name, for people; each layer another one."),
        optional(
            "bottom",
            Kind::Either(&[Kind::Number(ANY), Kind::Line]),
            "the last layer, and only that, reaches to the base",
            "Its lower boundary: an elevation, or a line that is level beyond its ends.",
        ),
        needed("random", Kind::Flag, "Whether the random properties are the random fields here."),
        optional("youngs_modulus_mpa", Kind::Number(POSITIVE), SHARED, "Young's modulus of the skeleton."),
        optional("poissons_ratio", Kind::Number(POISSON), SHARED, "Poisson's ratio of the skeleton."),
        optional("cohesion_kpa", Kind::Number(NON_NEGATIVE), "random, or that of [soil]", "Cohesion."),
        optional(
            "friction_angle_deg",
            Kind::Number(between(0.0, 80.0)),
            "random, or that of [soil]",
            "Friction angle.",
        ),
        optional(
            "unit_weight_kn_m3",
            Kind::Number(NON_NEGATIVE),
            "random, or that of [soil]",
            "Saturated (total) unit weight.",
        ),
        optional("dilation_angle_deg", Kind::Number(between(0.0, 60.0)), SHARED, "Dilation angle."),
        optional("tension_cutoff_kpa", CUTOFF, SHARED, "Largest tensile principal stress, or \"apex\"."),
        optional(
            "softening",
            Kind::Table("softening"),
            SHARED,
            "[layers.softening]; a layer that does not soften, of a [soil] that does, has residual ratios of 1.",
        ),
        optional("porosity", Kind::Number(POROSITY), SHARED, "Porosity."),
        optional("permeability_m_s", Kind::Number(POSITIVE), SHARED, "Hydraulic conductivity."),
    ],
};

pub(super) const WATER: Section = Section {
    name: "water",
    header: "[water]",
    meaning: "Pore water and free water. Rapid drawdown is \"hydrostatic\" with the table at or above the level before (it is cut \
              off at the ground surface) and a lower free_water_level_m, or none: the pores still carry what the water \
              outside no longer balances.",
    keys: &[
        needed("density_kg_m3", Kind::Number(POSITIVE), "Density of water."),
        needed("bulk_modulus_mpa", Kind::Number(POSITIVE), "Bulk modulus used in the analysis."),
        needed(
            "initial_pore_pressure",
            Kind::Words(&["none", "hydrostatic", "submerged"]),
            "none: zero everywhere. hydrostatic: the water's unit weight times the vertical depth below water_table, or below \
             the free water where the ground is below that; zero above. submerged: water table and free water both at \
             free_water_level_m.",
        ),
        optional(
            "water_table",
            Kind::Either(&[Kind::Words(&["ground-surface"]), Kind::Number(ANY), Kind::Line]),
            "not \"hydrostatic\"",
            "For \"hydrostatic\": at the ground surface, at an elevation, or on a line that is level beyond its ends; at the \
             ground surface where that is lower.",
        ),
        needed(
            "water_above_table",
            Kind::Words(&["held", "sinks"]),
            "Above the water table, everywhere without one: the skeleton holds the pore water, or it sinks under its weight, so \
             that pressure builds up from below.",
        ),
        optional(
            "free_water_level_m",
            Kind::Number(ANY),
            "there is no free water",
            "Elevation of standing water outside the soil, above the lowest ground; in two phases. Its weight rests on the \
             ground, and what slides into it is buoyant.",
        ),
        needed(
            "ground_surface",
            Kind::Words(&["drained", "closed"]),
            "Pore pressure of the free water there, zero without any; or no flow through it.",
        ),
        needed(
            "cavitation_suction_kpa",
            Kind::Number(NON_NEGATIVE),
            "Largest suction that the water can carry; 0 allows none.",
        ),
    ],
};
