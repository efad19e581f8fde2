//! What counts as a sample, when a campaign has enough of them, and how it behaves.

use serde::{Deserialize, Serialize};

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
    /// Whether every outcome has a profile along the ground. Specs frozen before this could be asked for do not have it, and
    /// keep their digests.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub profile: bool,
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
