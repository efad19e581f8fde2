//! What is known of the soil, and how it varies: `[site]`, `[fit]`, `[field]`.

use super::{needed, optional};
use crate::schema::{ANY, Kind, POSITIVE, Range, Section, between};

pub(super) const SITE: Section = Section {
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

pub(super) const FIT: Section = Section {
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

pub(super) const MARGINAL: Section = Section {
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

pub(super) const COPULA: Section = Section {
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

pub(super) const FIELD: Section = Section {
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
