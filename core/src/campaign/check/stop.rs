//! `[stop]`: when the campaign has enough realisations.

use super::{Checked, at_least, needed, non_negative, positive, refuse, within, word};
use crate::campaign::file::StopSection;
use crate::campaign::{ExceedanceTarget, Stop, StopRule};

pub(super) fn check_stop(raw: &StopSection) -> Checked<Stop> {
    let minimum = at_least("stop.minimum_realisations", raw.minimum_realisations, 1)?;
    Ok(Stop {
        rule: match raw.rule.as_str() {
            "paper" => paper_rule(raw)?,
            "interval" => interval_rule(raw)?,
            other => {
                word("stop.rule", other, &[("paper", ()), ("interval", ())]).and_then(|()| paper_rule(raw))?
            }
        },
        minimum_realisations: minimum,
        maximum_realisations: at_least("stop.maximum_realisations", raw.maximum_realisations, minimum)?,
    })
}

fn paper_rule(raw: &StopSection) -> Checked<StopRule> {
    let foreign = [
        ("stop.confidence", raw.confidence.is_some()),
        ("stop.mean_half_width", raw.mean_half_width.is_some()),
        ("stop.sd_half_width", raw.sd_half_width.is_some()),
        ("stop.exceedance", !raw.exceedance.is_empty()),
    ];
    refuse_foreign(&foreign, "it belongs to rule \"interval\"")?;
    let why = "rule \"paper\" needs it";
    Ok(StopRule::Paper {
        tolerance: positive("stop.tolerance", needed("stop.tolerance", raw.tolerance, why)?)?,
        relative: needed("stop.relative", raw.relative, why)?,
        patience: at_least("stop.patience", needed("stop.patience", raw.patience, why)?, 1)?,
    })
}

fn interval_rule(raw: &StopSection) -> Checked<StopRule> {
    let foreign = [
        ("stop.tolerance", raw.tolerance.is_some()),
        ("stop.relative", raw.relative.is_some()),
        ("stop.patience", raw.patience.is_some()),
    ];
    refuse_foreign(&foreign, "it belongs to rule \"paper\"")?;
    let confidence = needed("stop.confidence", raw.confidence, "rule \"interval\" needs it")?;
    let mut exceedance = Vec::new();
    for target in &raw.exceedance {
        exceedance.push(ExceedanceTarget {
            distance_m: non_negative("stop.exceedance.distance_m", target.distance_m)?,
            half_width: positive("stop.exceedance.half_width", target.half_width)?,
        });
    }
    if raw.mean_half_width.is_none() && raw.sd_half_width.is_none() && exceedance.is_empty() {
        let allowed = "give mean_half_width, sd_half_width or [[stop.exceedance]]";
        return Err(refuse("stop.mean_half_width", "(absent)", allowed));
    }
    Ok(StopRule::Interval {
        confidence: within(
            "stop.confidence",
            confidence,
            (0.5..1.0).contains(&confidence),
            "it must be in [0.5, 1)",
        )?,
        mean_half_width: raw.mean_half_width.map(|v| positive("stop.mean_half_width", v)).transpose()?,
        sd_half_width: raw.sd_half_width.map(|v| positive("stop.sd_half_width", v)).transpose()?,
        exceedance,
    })
}

fn refuse_foreign(keys: &[(&str, bool)], allowed: &str) -> Checked<()> {
    match keys.iter().find(|(_, present)| *present) {
        Some((key, _)) => Err(refuse(key, "a value", allowed)),
        None => Ok(()),
    }
}
