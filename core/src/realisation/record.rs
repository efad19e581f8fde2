//! From the end of an analysis to its record: measures, kind, digest.

use super::Prepared;
use super::analysis::Failure;
use super::insitu::InSitu;
use crate::campaign::Model;
use crate::gimp::{End, State};
use crate::outcome::{Outcome, OutcomeKind, Reason};
use crate::profile::Profile;
use crate::runout::{self, Moved};

/// The outcome of an analysis whose failure stage began at `start` and ended as `failure`.
pub(super) fn outcome(prepared: &Prepared, index: u64, start: &InSitu, failure: &Failure) -> Outcome {
    let Model { slope, mesh, sample, .. } = &prepared.spec.model;
    let state = &failure.state;
    let (reason, rest) = match failure.end {
        End::AtRest { since_s } => (Reason::AtRest, Some(since_s)),
        End::Duration if failure.moving => (Reason::StillMoving, None),
        End::Duration | End::Stopped => (Reason::DurationReached, None),
        End::StepLimit => (Reason::StepLimit, None),
        End::NonFinite => (Reason::NonFinite, None),
        End::LeftGrid => (Reason::LeftGrid, None),
    };
    let failed = matches!(failure.end, End::StepLimit | End::NonFinite | End::LeftGrid);
    let measures = (!failed).then(|| {
        let moved = Moved { x0: &start.x, y0: &start.y, x: &state.x, y: &state.y, volume: &state.volume };
        runout::measure(&moved, slope, mesh, sample.threshold_m, rest)
    });
    let energy = (!failed).then_some(failure.energy);
    let limit = prepared.spec.model.analysis.energy_drift_limit;
    let kind = match &measures {
        None => OutcomeKind::Failed,
        Some(m) if sample.measure.of(m) > sample.threshold_m => OutcomeKind::Runout,
        Some(_) => OutcomeKind::Stable,
    };
    let outcome = Outcome {
        index,
        outcome: kind,
        reason,
        measures,
        energy,
        energy_drifted: energy.is_some_and(|e| e.drift().abs() > limit || e.drift().is_nan()),
        simulated_s: failure.simulated_s,
        steps: failure.steps,
        points: prepared.points() as u64,
        profile: failure.profile.clone().filter(|_| !failed),
        digest: String::new(),
    };
    signed(outcome, Some(state))
}

/// The outcome of an analysis whose failure stage could not begin.
pub(super) fn unstarted(prepared: &Prepared, index: u64, reason: Reason) -> Outcome {
    let outcome = Outcome {
        index,
        outcome: OutcomeKind::Failed,
        reason,
        measures: None,
        energy: None,
        energy_drifted: false,
        simulated_s: 0.0,
        steps: 0,
        points: prepared.points() as u64,
        profile: None,
        digest: String::new(),
    };
    signed(outcome, None)
}

fn signed(mut outcome: Outcome, state: Option<&State>) -> Outcome {
    outcome.digest = digest(&outcome, state);
    outcome
}

/// First 32 hexadecimal digits of the BLAKE3 hash of the points' state, in point order, and the outcome's fields.
fn digest(outcome: &Outcome, state: Option<&State>) -> String {
    let mut hasher = blake3::Hasher::new_derive_key("runout 2026 outcome digest v1");
    if let Some(state) = state {
        let fields = [
            &state.x,
            &state.y,
            &state.vx,
            &state.vy,
            &state.wx,
            &state.wy,
            &state.stress_xx,
            &state.stress_yy,
            &state.stress_zz,
            &state.stress_xy,
            &state.pressure,
            &state.porosity,
            &state.volume,
            &state.plastic_strain,
        ];
        // The hash takes many bytes at once several times as fast as eight at a time.
        let mut bytes = Vec::with_capacity(8 * state.x.len());
        for field in fields {
            bytes.clear();
            bytes.extend(field.iter().flat_map(|&value| bits(value)));
            hasher.update(&bytes);
        }
    }
    let mut number = |value: f64| {
        hasher.update(&bits(value));
    };
    if let Some(m) = &outcome.measures {
        for value in [
            m.max_displacement_m,
            m.displacement_q999_m,
            m.toe_advance_m,
            m.crest_retreat_m,
            m.moved_area_m2,
            m.deposit_height_at_toe_m,
            m.time_to_rest_s.unwrap_or(f64::NAN),
        ] {
            number(value);
        }
    }
    if let Some(e) = &outcome.energy {
        for value in [
            e.outer_work_j,
            e.kinetic_j,
            e.elastic_j,
            e.pore_water_j,
            e.plastic_j,
            e.drag_j,
            e.contact_j,
            e.damping_j,
            e.drift_j,
            e.available_j,
        ] {
            number(value);
        }
    }
    number(outcome.simulated_s);
    for whole in [outcome.index, outcome.steps, outcome.points] {
        hasher.update(&whole.to_le_bytes());
    }
    hasher.update(outcome.outcome.name().as_bytes());
    hasher.update(outcome.reason.name().as_bytes());
    if let Some(Profile { column_m, depth_mm, speed_mm_s }) = &outcome.profile {
        hasher.update(&bits(*column_m));
        // With their lengths, so that no other two lists give the same bytes.
        for values in [depth_mm, speed_mm_s] {
            hasher.update(&(values.len() as u64).to_le_bytes());
            values.iter().for_each(|value| {
                hasher.update(&value.to_le_bytes());
            });
        }
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// The bits of a number, as the digest takes them: numbers that are none may differ in their payload between processors and
/// count as one.
fn bits(value: f64) -> [u8; 8] {
    if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() }.to_le_bytes()
}
