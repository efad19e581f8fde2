//! The sample, when it is large enough, and how it is run: `[sample]`, `[stop]`, `[run]`.

use super::{needed, optional};
use crate::schema::{Kind, NON_NEGATIVE, POSITIVE, Range, Section, between};

pub(super) const SAMPLE: Section = Section {
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
        optional(
            "profile",
            Kind::Flag,
            "none is recorded; the report replays some samples for it",
            "Whether every realisation records deposit depths and highest speeds along the ground in front of the toe: the \
             report's hazard then rests on all samples. It moves no other number, and costs next to nothing.",
        ),
    ],
};

pub(super) const STOP: Section = Section {
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

pub(super) const EXCEEDANCE: Section = Section {
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

pub(super) const RUN: Section = Section {
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
