//! Between core's types and the wire. Every number that arrives is checked; an error names the field.

use crate::v1;
use runout_core::gimp::Energy;
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};
use runout_core::profile::{MOST_COLUMNS, MOST_DEPTH_MM, MOST_SPEED_MM_S, Profile};
use thiserror::Error;

/// A message that cannot be understood.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DecodeError {
    /// A field that must be there is not.
    #[error("{field} is missing")]
    Missing {
        /// Name of the field.
        field: &'static str,
    },
    /// A field holds what it must not.
    #[error("{field} = {value} is not allowed; {allowed}")]
    Bad {
        /// Name of the field.
        field: &'static str,
        /// What it holds.
        value: String,
        /// What it may hold.
        allowed: &'static str,
    },
}

/// The outcome as it travels.
pub fn encode_outcome(outcome: &Outcome) -> v1::Outcome {
    v1::Outcome {
        index: outcome.index,
        kind: encode_kind(outcome.outcome) as i32,
        reason: encode_reason(outcome.reason) as i32,
        measures: outcome.measures.map(|m| v1::Measures {
            max_displacement_m: m.max_displacement_m,
            displacement_q999_m: m.displacement_q999_m,
            toe_advance_m: m.toe_advance_m,
            crest_retreat_m: m.crest_retreat_m,
            moved_area_m2: m.moved_area_m2,
            deposit_height_at_toe_m: m.deposit_height_at_toe_m,
            time_to_rest_s: m.time_to_rest_s,
        }),
        energy: outcome.energy.map(|e| v1::Energy {
            outer_work_j: e.outer_work_j,
            kinetic_j: e.kinetic_j,
            elastic_j: e.elastic_j,
            pore_water_j: e.pore_water_j,
            plastic_j: e.plastic_j,
            drag_j: e.drag_j,
            contact_j: e.contact_j,
            damping_j: e.damping_j,
            drift_j: e.drift_j,
            available_j: e.available_j,
        }),
        energy_drifted: outcome.energy_drifted,
        simulated_s: outcome.simulated_s,
        steps: outcome.steps,
        points: outcome.points,
        profile: outcome.profile.as_ref().map(|p| v1::Profile {
            column_m: p.column_m,
            depth_mm: p.depth_mm.clone(),
            speed_mm_s: p.speed_mm_s.clone(),
        }),
        digest: outcome.digest.clone(),
    }
}

/// The outcome that arrived.
///
/// # Errors
/// A field that is missing, not finite or out of its range; measures of a failed analysis or none of another; a failed
/// analysis' profile.
pub fn decode_outcome(wire: Option<v1::Outcome>) -> Result<Outcome, DecodeError> {
    let wire = wire.ok_or(DecodeError::Missing { field: "outcome" })?;
    let outcome = decode_kind(wire.kind())?;
    let measures = match (outcome, &wire.measures) {
        (OutcomeKind::Failed, None) => None,
        (OutcomeKind::Failed, Some(_)) => {
            return Err(bad("outcome.measures", "present", "a failed analysis has none"));
        }
        (_, None) => return Err(DecodeError::Missing { field: "outcome.measures" }),
        (_, Some(measures)) => Some(decode_measures(measures)?),
    };
    let energy = match (outcome, &wire.energy) {
        (OutcomeKind::Failed, None) => None,
        (OutcomeKind::Failed, Some(_)) => {
            return Err(bad("outcome.energy", "present", "a failed analysis has none"));
        }
        (_, None) => return Err(DecodeError::Missing { field: "outcome.energy" }),
        (_, Some(energy)) => Some(decode_energy(energy)?),
    };
    Ok(Outcome {
        index: wire.index,
        outcome,
        reason: decode_reason(wire.reason())?,
        measures,
        energy,
        energy_drifted: wire.energy_drifted,
        simulated_s: non_negative("outcome.simulated_s", wire.simulated_s)?,
        steps: wire.steps,
        points: wire.points,
        profile: match wire.profile {
            Some(_) if outcome == OutcomeKind::Failed => {
                return Err(bad("outcome.profile", "present", "a failed analysis has none"));
            }
            profile => profile.map(decode_profile).transpose()?,
        },
        digest: hexadecimal("outcome.digest", wire.digest, 32)?,
    })
}

/// A number that must be finite and not negative.
///
/// # Errors
/// It is not; the error names `field`.
pub fn non_negative(field: &'static str, value: f64) -> Result<f64, DecodeError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(bad(field, value, "it must be finite and 0 or greater"))
    }
}

fn finite(field: &'static str, value: f64) -> Result<f64, DecodeError> {
    if value.is_finite() { Ok(value) } else { Err(bad(field, value, "it must be finite")) }
}

/// A digest of `digits` hexadecimal digits.
///
/// # Errors
/// It is not; the error names `field`.
pub fn hexadecimal(field: &'static str, text: String, digits: usize) -> Result<String, DecodeError> {
    let sound = text.len() == digits && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    if sound {
        Ok(text)
    } else {
        Err(bad(field, readable(&text, 80), "it must be a digest of hexadecimal digits"))
    }
}

pub(crate) fn bad(field: &'static str, value: impl ToString, allowed: &'static str) -> DecodeError {
    DecodeError::Bad { field, value: value.to_string(), allowed }
}

/// A peer's text as people may see it: at most `most` of its characters, those that are not printable escaped.
pub fn readable(text: &str, most: usize) -> String {
    let escaped = |c: char| -> Box<dyn Iterator<Item = char>> {
        if is_printable(c) { Box::new(std::iter::once(c)) } else { Box::new(c.escape_default()) }
    };
    text.chars().take(most).flat_map(escaped).collect()
}

/// Whether a character shows as itself: it neither controls a terminal, nor breaks a line, nor is invisible, nor turns
/// the direction of writing.
pub(crate) fn is_printable(c: char) -> bool {
    let hidden = matches!(c,
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}');
    !c.is_control() && !hidden
}

fn decode_measures(wire: &v1::Measures) -> Result<Measures, DecodeError> {
    Ok(Measures {
        max_displacement_m: non_negative("measures.max_displacement_m", wire.max_displacement_m)?,
        displacement_q999_m: non_negative("measures.displacement_q999_m", wire.displacement_q999_m)?,
        toe_advance_m: non_negative("measures.toe_advance_m", wire.toe_advance_m)?,
        crest_retreat_m: non_negative("measures.crest_retreat_m", wire.crest_retreat_m)?,
        moved_area_m2: non_negative("measures.moved_area_m2", wire.moved_area_m2)?,
        deposit_height_at_toe_m: non_negative(
            "measures.deposit_height_at_toe_m",
            wire.deposit_height_at_toe_m,
        )?,
        time_to_rest_s: wire
            .time_to_rest_s
            .map(|value| non_negative("measures.time_to_rest_s", value))
            .transpose()?,
    })
}

fn decode_energy(wire: &v1::Energy) -> Result<Energy, DecodeError> {
    Ok(Energy {
        outer_work_j: finite("energy.outer_work_j", wire.outer_work_j)?,
        kinetic_j: finite("energy.kinetic_j", wire.kinetic_j)?,
        elastic_j: finite("energy.elastic_j", wire.elastic_j)?,
        pore_water_j: finite("energy.pore_water_j", wire.pore_water_j)?,
        plastic_j: finite("energy.plastic_j", wire.plastic_j)?,
        drag_j: finite("energy.drag_j", wire.drag_j)?,
        contact_j: finite("energy.contact_j", wire.contact_j)?,
        damping_j: finite("energy.damping_j", wire.damping_j)?,
        drift_j: finite("energy.drift_j", wire.drift_j)?,
        available_j: non_negative("energy.available_j", wire.available_j)?,
    })
}

fn decode_profile(wire: v1::Profile) -> Result<Profile, DecodeError> {
    let v1::Profile { column_m, depth_mm, speed_mm_s } = wire;
    if !(column_m.is_finite() && column_m > 0.0) {
        return Err(bad("profile.column_m", column_m, "it must be finite and greater than 0"));
    }
    Ok(Profile {
        column_m,
        depth_mm: compact("profile.depth_mm", depth_mm, MOST_DEPTH_MM)?,
        speed_mm_s: compact("profile.speed_mm_s", speed_mm_s, MOST_SPEED_MM_S)?,
    })
}

/// Values of columns, in the one form that they have.
fn compact(field: &'static str, values: Vec<u32>, most: u32) -> Result<Vec<u32>, DecodeError> {
    if values.len() > MOST_COLUMNS {
        return Err(bad(field, format!("{} values", values.len()), "at most 64 may stand there"));
    }
    if let Some(value) = values.iter().find(|value| **value > most) {
        return Err(bad(field, value, "it must be at most 10^7"));
    }
    match values.last() {
        Some(0) => Err(bad(field, "0 at the end", "columns after the last that is not 0 are left out")),
        _ => Ok(values),
    }
}

fn encode_kind(kind: OutcomeKind) -> v1::outcome::Kind {
    match kind {
        OutcomeKind::Runout => v1::outcome::Kind::Runout,
        OutcomeKind::Stable => v1::outcome::Kind::Stable,
        OutcomeKind::Failed => v1::outcome::Kind::Failed,
    }
}

fn decode_kind(kind: v1::outcome::Kind) -> Result<OutcomeKind, DecodeError> {
    match kind {
        v1::outcome::Kind::Runout => Ok(OutcomeKind::Runout),
        v1::outcome::Kind::Stable => Ok(OutcomeKind::Stable),
        v1::outcome::Kind::Failed => Ok(OutcomeKind::Failed),
        v1::outcome::Kind::Unspecified => Err(DecodeError::Missing { field: "outcome.kind" }),
    }
}

fn encode_reason(reason: Reason) -> v1::outcome::Reason {
    match reason {
        Reason::AtRest => v1::outcome::Reason::AtRest,
        Reason::DurationReached => v1::outcome::Reason::DurationReached,
        Reason::StillMoving => v1::outcome::Reason::StillMoving,
        Reason::NonFinite => v1::outcome::Reason::NonFinite,
        Reason::LeftGrid => v1::outcome::Reason::LeftGrid,
        Reason::StepLimit => v1::outcome::Reason::StepLimit,
        Reason::BadMaterial => v1::outcome::Reason::BadMaterial,
        Reason::Poison => v1::outcome::Reason::Poison,
    }
}

fn decode_reason(reason: v1::outcome::Reason) -> Result<Reason, DecodeError> {
    Reason::ALL
        .into_iter()
        .find(|&r| encode_reason(r) == reason)
        .ok_or(DecodeError::Missing { field: "outcome.reason" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn outcome() -> Outcome {
        Outcome {
            index: 7,
            outcome: OutcomeKind::Runout,
            reason: Reason::AtRest,
            measures: Some(Measures {
                max_displacement_m: 3.0,
                displacement_q999_m: 2.5,
                toe_advance_m: 1.0,
                crest_retreat_m: 0.5,
                moved_area_m2: 12.0,
                deposit_height_at_toe_m: 0.25,
                time_to_rest_s: None,
            }),
            energy: Some(Energy {
                outer_work_j: 9.0,
                kinetic_j: 0.5,
                elastic_j: -1.0,
                pore_water_j: 0.25,
                plastic_j: 8.0,
                drag_j: 0.75,
                contact_j: 0.0,
                damping_j: 0.125,
                drift_j: 0.375,
                available_j: 12.0,
            }),
            energy_drifted: true,
            simulated_s: 4.0,
            steps: 1000,
            points: 10_125,
            profile: Some(Profile { column_m: 0.5, depth_mm: vec![900, 0, 20], speed_mm_s: vec![7000] }),
            digest: "0123456789abcdef0123456789abcdef".to_owned(),
        }
    }

    #[test]
    fn what_is_missing_or_bad_is_named() {
        let said = |change: fn(&mut v1::Outcome)| {
            let mut wire = encode_outcome(&outcome());
            change(&mut wire);
            decode_outcome(Some(wire)).unwrap_err().to_string()
        };
        assert_eq!(decode_outcome(None).unwrap_err().to_string(), "outcome is missing");
        assert_eq!(said(|w| w.kind = 0), "outcome.kind is missing");
        assert_eq!(said(|w| w.reason = 99), "outcome.reason is missing");
        assert_eq!(said(|w| w.measures = None), "outcome.measures is missing");
        assert!(said(|w| w.simulated_s = f64::NAN).starts_with("outcome.simulated_s = NaN"));
        assert!(said(|w| w.digest = "xyz".into()).starts_with("outcome.digest = xyz"));
        assert_eq!(said(|w| w.energy = None), "outcome.energy is missing");
        assert!(
            said(|w| w.energy.as_mut().unwrap().drag_j = f64::INFINITY).starts_with("energy.drag_j = inf")
        );
        assert!(said(|w| w.kind = 3).starts_with("outcome.measures = present"));
        let of_failed = said(|w| (w.kind, w.measures, w.energy) = (3, None, None));
        assert!(of_failed.starts_with("outcome.profile = present"), "{of_failed}");
        let profile = |change: fn(&mut v1::Profile)| {
            let mut wire = encode_outcome(&outcome());
            change(wire.profile.as_mut().unwrap());
            decode_outcome(Some(wire)).unwrap_err().to_string()
        };
        assert!(profile(|p| p.column_m = f64::NAN).starts_with("profile.column_m = NaN"));
        assert!(profile(|p| p.column_m = 0.0).starts_with("profile.column_m = 0"));
        assert!(profile(|p| p.depth_mm = vec![1; 65]).starts_with("profile.depth_mm = 65 values"));
        assert!(profile(|p| p.depth_mm.push(0)).starts_with("profile.depth_mm = 0 at the end"));
        assert!(profile(|p| p.speed_mm_s[0] = 10_000_001).starts_with("profile.speed_mm_s = 10000001"));
    }

    proptest! {
        #[test]
        fn an_outcome_survives_the_wire(
            index: u64,
            displacement in 0.0..1e3_f64,
            rest in proptest::option::of(0.0..1e2_f64),
            reason in 0..Reason::ALL.len(),
            failed: bool,
            depth_mm in proptest::option::of(proptest::collection::vec(1..=MOST_DEPTH_MM, 0..=MOST_COLUMNS)),
        ) {
            let mut sent = outcome();
            sent.profile = depth_mm.map(|depth_mm| Profile { depth_mm, ..sent.profile.unwrap() });
            sent.index = index;
            sent.reason = Reason::ALL[reason];
            if let Some(measures) = &mut sent.measures {
                measures.max_displacement_m = displacement;
                measures.time_to_rest_s = rest;
            }
            if failed {
                sent.outcome = OutcomeKind::Failed;
                (sent.measures, sent.energy, sent.profile) = (None, None, None);
            }
            prop_assert_eq!(decode_outcome(Some(encode_outcome(&sent))).unwrap(), sent);
        }
    }
}
