//! The validation suite: small analyses whose answer is known, each with its checks and figures.
//!
//! A case sets a body (or a whole slope) up, runs it, and compares what it finds with a closed form, with limit
//! analysis, with a published measurement or with itself on another mesh. Cases are pure: whoever runs them
//! measures time and draws the figures. The quick form of every case is also a test.

mod report;

mod closed_forms;
mod measure;
mod set_up;
mod two_phase_column;

mod axial_bar;
mod consolidation;
mod filters;
mod gravity_column;
mod grid_crossing;
mod hydrostatic;
mod incline;
mod large_compaction;
mod manufactured;
mod specimen;
mod two_disks;
mod undrained_wave;

mod collapse;
mod invariance;
mod slopes;

pub use report::{Case, Check, Comparison, Depth, Figure, Findings, Marks, Series};

/// Every case, in the order of the report.
pub fn cases() -> Vec<Case> {
    vec![
        gravity_column::CASE,
        large_compaction::CASE,
        axial_bar::CASE,
        filters::CASE,
        grid_crossing::CASE,
        manufactured::CASE,
        two_disks::CASE,
        incline::CASE,
        specimen::DRAINED,
        hydrostatic::CASE,
        consolidation::STEP_LOAD,
        consolidation::SELF_WEIGHT,
        consolidation::BOTH_ENDS,
        undrained_wave::CASE,
        specimen::UNDRAINED,
        slopes::ONSET,
        slopes::CONVERGENCE,
        slopes::WATER_MODULUS,
        slopes::SUBMERGED,
        slopes::DAMPING,
        collapse::COLUMNS,
        collapse::RODS,
        invariance::INVARIANCE,
    ]
}
