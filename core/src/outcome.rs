//! The record of one realisation.
//!
//! Everything in an [`Outcome`] follows from (spec, index) alone: what depends on the machine or on luck (worker,
//! attempt, wall time) is kept beside it by whoever ran it.

use crate::gimp::Energy;
use crate::profile::Profile;
use serde::{Deserialize, Serialize};

/// What became of a realisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutcomeKind {
    /// The slope failed: its runout measure is above the campaign's threshold. These are the samples.
    Runout,
    /// The slope stood: its runout measure is at or below the threshold.
    Stable,
    /// The analysis failed (see [`Reason`]); there are no measures.
    Failed,
}

impl OutcomeKind {
    /// The name used in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            OutcomeKind::Runout => "runout",
            OutcomeKind::Stable => "stable",
            OutcomeKind::Failed => "failed",
        }
    }

    /// The kind of that name.
    pub fn from_name(name: &str) -> Option<OutcomeKind> {
        [OutcomeKind::Runout, OutcomeKind::Stable, OutcomeKind::Failed].into_iter().find(|k| k.name() == name)
    }
}

/// Why the analysis ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The rule for rest was met.
    AtRest,
    /// The duration was reached and the rule for rest would soon have been met: nothing moves noticeably.
    DurationReached,
    /// The duration was reached while material still moved; the measures are those at that moment.
    StillMoving,
    /// A point's state became non-finite.
    NonFinite,
    /// A point left the computational grid.
    LeftGrid,
    /// The limit on the number of steps was reached.
    StepLimit,
    /// The material's inputs cannot be analysed (for example a field value outside the material's range).
    BadMaterial,
    /// The realisation took several workers down and was given up (recorded by the coordinator).
    Poison,
}

impl Reason {
    /// All reasons.
    pub const ALL: [Reason; 8] = [
        Reason::AtRest,
        Reason::DurationReached,
        Reason::StillMoving,
        Reason::NonFinite,
        Reason::LeftGrid,
        Reason::StepLimit,
        Reason::BadMaterial,
        Reason::Poison,
    ];

    /// The name used in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Reason::AtRest => "at-rest",
            Reason::DurationReached => "duration-reached",
            Reason::StillMoving => "still-moving",
            Reason::NonFinite => "non-finite",
            Reason::LeftGrid => "left-grid",
            Reason::StepLimit => "step-limit",
            Reason::BadMaterial => "bad-material",
            Reason::Poison => "poison",
        }
    }

    /// The reason of that name.
    pub fn from_name(name: &str) -> Option<Reason> {
        Reason::ALL.into_iter().find(|r| r.name() == name)
    }
}

/// What moved, and how far. Definitions stand in [`crate::runout`]. The default is of ground that did not move and is not
/// known to be at rest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Largest displacement of any material point, m (the paper's "runout distance").
    pub max_displacement_m: f64,
    /// 99.9 % quantile of displacement over the points, m.
    pub displacement_q999_m: f64,
    /// Advance of the contiguous material's front beyond the initial toe, m.
    pub toe_advance_m: f64,
    /// Distance behind the crest edge to which the ground moved more than the threshold, m.
    pub crest_retreat_m: f64,
    /// Area (volume per metre) of material that moved more than the threshold, m2.
    pub moved_area_m2: f64,
    /// Height of the deposit above the base level at the initial toe's position, m.
    pub deposit_height_at_toe_m: f64,
    /// Time from the start of failure until the material came to rest, s; absent if it had not.
    pub time_to_rest_s: Option<f64>,
}

/// The record of one realisation: all of it follows from (spec, index).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Realisation index, from 0.
    pub index: u64,
    /// What became of it.
    pub outcome: OutcomeKind,
    /// Why the analysis ended.
    pub reason: Reason,
    /// What moved; absent exactly if the analysis failed.
    pub measures: Option<Measures>,
    /// Balance of energy of the failure stage; absent exactly if the analysis failed.
    pub energy: Option<Energy>,
    /// Whether that balance drifted by more than the campaign's limit.
    pub energy_drifted: bool,
    /// Time simulated in the failure stage, s.
    pub simulated_s: f64,
    /// Time steps taken in the failure stage.
    pub steps: u64,
    /// Number of material points.
    pub points: u64,
    /// What it did along the ground; absent if the campaign does not ask for it, or the analysis failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    /// BLAKE3 digest (hexadecimal, 32 digits) of the points' final state and of all of the above.
    pub digest: String,
}

impl Outcome {
    /// An outcome of which no more is known: no time, steps, points, profile or digest, and no energy moved.
    pub fn bare(index: u64, outcome: OutcomeKind, reason: Reason, measures: Option<Measures>) -> Outcome {
        Outcome {
            index,
            outcome,
            reason,
            measures,
            energy: measures.map(|_| Energy::default()),
            energy_drifted: false,
            simulated_s: 0.0,
            steps: 0,
            points: 0,
            profile: None,
            digest: String::new(),
        }
    }

    /// What its reader must know of it, in the words of the results table: `still-moving`, `energy-drift`, both joined by
    /// `+`, or nothing.
    pub fn mark(&self) -> &'static str {
        match (self.reason == Reason::StillMoving, self.energy_drifted) {
            (true, true) => "still-moving+energy-drift",
            (true, false) => "still-moving",
            (false, true) => "energy-drift",
            (false, false) => "",
        }
    }
}
