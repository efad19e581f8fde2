//! The description of the campaign file: its sections but `[analysis]`, which has a file of its own.

use super::analysis_keys::ANALYSIS;
use super::{ANY, Key, Kind, NON_NEGATIVE, POSITIVE, Range, Section, between};

/// The random properties.
pub(super) const PROPERTIES: &[&str] = &["cohesion_kpa", "friction_angle_deg", "unit_weight_kn_m3"];

/// Every section, in the file's order.
pub const SECTIONS: &[Section] = &[
    TOP, SITE, FIT, MARGINAL, COPULA, FIELD, SLOPE, OBSTACLE, MESH, SOIL, SOFTENING, LAYER, WATER, ANALYSIS,
    SAMPLE, STOP, EXCEEDANCE, RUN,
];

pub(super) const fn needed(name: &'static str, kind: Kind, meaning: &'static str) -> Key {
    Key { name, kind, absent: None, meaning }
}

pub(super) const fn optional(
    name: &'static str,
    kind: Kind,
    absent: &'static str,
    meaning: &'static str,
) -> Key {
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

const SITE: Section = Section {
    name: "site",
    header: "[site]",
    meaning: "Where the measured properties stand.",
    keys: &[
        needed("data", Kind::Text, "CSV file with a header, relative to the campaign file."),
        needed(
            "columns",
            Kind::ByProperty(&Kind::Text),
            "[site.columns]: the header's name of each random property's column, in the unit that the property's name ends in.",
        ),
        needed(
            "zeros",
            Kind::Either(&[Kind::Words(&["keep", "drop"]), Kind::With("floor", POSITIVE)]),
            "What to do with measured zeros: fit them as they are, leave them out, or put a value (in the property's unit) in \
             their place.",
        ),
    ],
};

const FIT: Section = Section {
    name: "fit",
    header: "[fit]",
    meaning: "How marginals and copula are chosen.",
    keys: &[
        needed(
            "recipe",
            Kind::Words(&["likelihood", "paper"]),
            "Maximum likelihood throughout with average ranks, or the recipe behind the paper's printed numbers: moments, \
             inversion of Kendall's tau, ordinal ranks.",
        ),
        needed("criterion", Kind::Words(&["aic", "bic"]), "What picks among families."),
        optional(
            "marginals",
            Kind::ByProperty(&Kind::Table("fit.marginals")),
            "the criterion picks among all families",
            "A forced family or a given distribution by property: [fit.marginals.cohesion_kpa] and so on.",
        ),
        optional(
            "copula",
            Kind::Table("fit.copula"),
            "the criterion picks among all families",
            "A forced copula family or a given copula.",
        ),
    ],
};

const MARGINAL: Section = Section {
    name: "fit.marginals",
    header: "[fit.marginals.PROPERTY]",
    meaning: "A forced family, fitted; or a distribution given by p and q, or by mean and sd, in the property's unit.",
    keys: &[
        needed(
            "family",
            Kind::Words(&["trunc-normal", "lognormal", "trunc-gumbel", "weibull"]),
            "Family, cut off at zero where it reaches below.",
        ),
        optional(
            "p",
            Kind::Number(ANY),
            "fitted, or from mean and sd",
            "First parameter of the paper's Table 1; with q.",
        ),
        optional("q", Kind::Number(POSITIVE), "fitted, or from mean and sd", "Second parameter; with p."),
        optional("mean", Kind::Number(POSITIVE), "fitted, or given by p and q", "Mean; with sd."),
        optional(
            "sd",
            Kind::Number(POSITIVE),
            "fitted, or given by p and q",
            "Standard deviation; with mean.",
        ),
    ],
};

const COPULA: Section = Section {
    name: "fit.copula",
    header: "[fit.copula]",
    meaning: "A forced copula family, or a given copula.",
    keys: &[
        needed(
            "family",
            Kind::Words(&["independent", "gaussian", "plackett", "frank", "no16", "student-t"]),
            "Family. plackett, frank and no16 join exactly two properties.",
        ),
        optional(
            "theta",
            Kind::Number(ANY),
            "fitted",
            "Parameter of plackett (greater than 0), frank or no16 (0 or greater).",
        ),
        optional(
            "correlation",
            Kind::Matrix,
            "fitted",
            "Correlation matrix of gaussian or student-t, rows in the order cohesion, friction angle, unit weight.",
        ),
        optional(
            "degrees_of_freedom",
            Kind::Number(Range { low: Some((2.0, false)), high: None }),
            "fitted",
            "Degrees of freedom of student-t.",
        ),
    ],
};

const FIELD: Section = Section {
    name: "field",
    header: "[field]",
    meaning: "Autocorrelation of the random fields.",
    keys: &[
        needed(
            "autocorrelation",
            Kind::Words(&[
                "single-exponential",
                "squared-exponential",
                "second-order-markov",
                "cosine-exponential",
                "binary-noise",
            ]),
            "Family, a product of one function of the lag in each direction; single-exponential is the paper's Eq. 16.",
        ),
        needed(
            "scale_of_fluctuation_horizontal_m",
            Kind::Number(POSITIVE),
            "Scale of fluctuation along the bedding: over it a property varies little.",
        ),
        needed(
            "scale_of_fluctuation_vertical_m",
            Kind::Number(POSITIVE),
            "Scale of fluctuation across the bedding.",
        ),
        needed(
            "rotation_deg",
            Kind::Number(between(-90.0, 90.0)),
            "Dip of the bedding; positive turns the horizontal axis anticlockwise.",
        ),
    ],
};

/// How a rigid surface holds the soil.
const CONTACT: Kind = Kind::Either(&[Kind::Words(&["fixed"]), Kind::With("friction", between(0.0, 10.0))]);

const SLOPE: Section = Section {
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

const OBSTACLE: Section = Section {
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

const MESH: Section = Section {
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

const SOIL: Section = Section {
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

const SOFTENING: Section = Section {
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

const LAYER: Section = Section {
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

const WATER: Section = Section {
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

const SAMPLE: Section = Section {
    name: "sample",
    header: "[sample]",
    meaning: "What counts as a sample of runout.",
    keys: &[
        needed(
            "measure",
            Kind::Words(&["displacement_q999", "max_displacement", "toe_advance"]),
            "The runout: the 99.9 % quantile of the points' displacement, the largest one (the paper's), or the advance of the \
             contiguous front beyond the toe.",
        ),
        needed(
            "threshold_m",
            Kind::Number(NON_NEGATIVE),
            "A realisation is a sample if its measure is above this; otherwise its slope stood.",
        ),
    ],
};

const STOP: Section = Section {
    name: "stop",
    header: "[stop]",
    meaning: "When the campaign has enough realisations. Not part of the spec: it moves no outcome, and may be changed when a \
              campaign is continued.",
    keys: &[
        needed(
            "rule",
            Kind::Words(&["interval", "paper"]),
            "Intervals narrow enough, or the paper's Eqs. 22 and 23: the last samples changed mean and variance little.",
        ),
        needed("minimum_realisations", Kind::Whole(1, u64::MAX), "Fewest realisations."),
        needed(
            "maximum_realisations",
            Kind::Whole(1, u64::MAX),
            "Most realisations; at least minimum_realisations.",
        ),
        optional(
            "tolerance",
            Kind::Number(POSITIVE),
            "rule \"interval\"",
            "Paper's rule: largest change of mean (m) and variance (m\u{b2}) by the last sample.",
        ),
        optional(
            "relative",
            Kind::Flag,
            "rule \"interval\"",
            "Paper's rule: whether the tolerance is a share of the mean and of the variance.",
        ),
        optional(
            "patience",
            Kind::Whole(1, u64::MAX),
            "rule \"interval\"",
            "Paper's rule: how many samples in a row must meet it.",
        ),
        optional(
            "confidence",
            Kind::Number(Range { low: Some((0.5, true)), high: Some((1.0, false)) }),
            "rule \"paper\"",
            "Interval rule: confidence level.",
        ),
        optional(
            "mean_half_width",
            Kind::Number(POSITIVE),
            "the mean decides nothing",
            "Interval rule: half-width of the mean's interval over the mean.",
        ),
        optional(
            "sd_half_width",
            Kind::Number(POSITIVE),
            "the standard deviation decides nothing",
            "Interval rule: half-width of the standard deviation's interval over the standard deviation.",
        ),
        optional(
            "exceedance",
            Kind::Tables("stop.exceedance"),
            "no exceedance probability decides",
            "Interval rule: exceedance probabilities that must be known well enough.",
        ),
    ],
};

const EXCEEDANCE: Section = Section {
    name: "stop.exceedance",
    header: "[[stop.exceedance]]",
    meaning: "An exceedance probability, given failure, that must be known well enough.",
    keys: &[
        needed("distance_m", Kind::Number(NON_NEGATIVE), "Runout distance."),
        needed(
            "half_width",
            Kind::Number(POSITIVE),
            "Half-width of the interval of its exceedance probability (absolute).",
        ),
    ],
};

const RUN: Section = Section {
    name: "run",
    header: "[run]",
    meaning: "Limits and behaviour of the run. Only maximum_steps can move an outcome.",
    keys: &[
        needed(
            "maximum_steps",
            Kind::Whole(1, u64::MAX),
            "Most time steps of one realisation's failure stage.",
        ),
        needed(
            "on_failure",
            Kind::Words(&["exclude", "abort"]),
            "What a failed analysis does: it is counted and left out of the estimates, or it ends the campaign.",
        ),
        needed(
            "audit_fraction",
            Kind::Number(between(0.0, 1.0)),
            "Share of the realisations, chosen by the seed, that are run twice and compared bit for bit.",
        ),
    ],
};
