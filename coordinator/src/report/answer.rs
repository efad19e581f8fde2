//! The answer in plain words: what was asked, what came out, and what that rests on.

use super::analysis::Analysis;
use super::html::{escape, paragraph};
use super::page::{interval, metres, optional_interval, percent};
use super::{Findings, Material, distances};
use crate::table::significant;
use runout_core::campaign::{Model, RunoutMeasure};
use runout_core::estimate::interval::Interval;
use runout_core::estimate::{Decision, Estimate};
use runout_core::slope;
use std::fmt::Write as _;

/// Where more of the samples than this still moved, their lower bounds pull every estimate down.
const MANY_MOVING: f64 = 0.05;

/// The box at the top of the page.
pub(super) fn answer(material: &Material<'_>, found: &Findings) -> String {
    let analysis = &found.analysis;
    let slope = &material.campaign.model.slope;
    let tests = material.fit.tests.map_or_else(
        || "the given distributions".to_owned(),
        |n| format!("the {n} laboratory tests from the site"),
    );
    let mut html = String::from("<div class=\"answer\">\n");
    html.push_str(&paragraph(format!(
        "<b>Asked:</b> how far does this slope, {} m high at {}\u{b0}, run when it fails, if its soil varies as {tests} \
         say?",
        significant(slope::height_m(slope), 4),
        significant(slope::mean_angle_rad(slope).to_degrees(), 4),
    )));
    html.push_str(&paragraph(format!("<b>Answer:</b> {}", answer_in_words(analysis))));
    if analysis.estimate.samples > 0 {
        html.push_str(&distances::in_short(analysis));
    }
    if let Some(words) = ground_in_words(found) {
        html.push_str(&paragraph(words));
    }
    html.push_str(&paragraph(format!("<b>It rests on</b> {}", rests_on(material, analysis))));
    if !found.differing.is_empty() {
        html.push_str(&paragraph(format!(
            "<b>Note:</b> {} replayed realisations gave another outcome than the recorded one; see the last section.",
            found.differing.len()
        )));
    }
    if let Some(words) = rear_wall_in_words(&material.spec.model, &analysis.retreats_m) {
        html.push_str(&paragraph(words));
    }
    for note in material.notes {
        html.push_str(&paragraph(format!("<b>Note:</b> {}", escape(note))));
    }
    html + "</div>\n"
}

/// What the stopping rule said, in a sentence.
pub(super) fn decision_in_words(decision: Decision) -> String {
    match decision {
        Decision::Continue => "The stopping rule is not met yet.".to_owned(),
        Decision::Converged { realisations, .. } => {
            format!("The stopping rule was met at realisation {realisations}.")
        }
        Decision::Maximum => {
            "The campaign stopped at its maximum number of realisations; its stopping rule is not met."
                .to_owned()
        }
        Decision::Aborted { index, reason } => format!(
            "The campaign was ended by the failed analysis of realisation {index} ({}).",
            reason.name()
        ),
    }
}

fn answer_in_words(analysis: &Analysis) -> String {
    let estimate = &analysis.estimate;
    let level = format!("{} interval", percent(estimate.confidence));
    match (estimate.p_failure, estimate.mean_m) {
        (None, _) => "none yet: no realisation has been decided.".to_owned(),
        (Some(_), None) => format!(
            "in none of {} realisations did the slope fail ({level} of the probability of failure: {}).",
            estimate.stable,
            optional_interval(estimate.p_failure_interval, percent),
        ),
        (Some(p), Some(mean)) => format!(
            "the slope fails in {} of {} realisations, <strong>{}</strong> ({level}: {}). When it fails, it runs \
             <strong>{} m</strong> on average ({}).",
            estimate.samples,
            estimate.samples + estimate.stable,
            percent(p),
            optional_interval(estimate.p_failure_interval, percent),
            metres(mean),
            metres_interval(estimate.mean_interval_m),
        ),
    }
}

fn metres_interval(found: Option<Interval>) -> String {
    found.map_or_else(|| optional_interval(None, metres), |i| format!("{} m", interval(i, metres)))
}

/// What it means on the ground, and how the deterministic run compares.
fn ground_in_words(found: &Findings) -> Option<String> {
    let analysis = &found.analysis;
    if analysis.estimate.samples == 0 {
        return None;
    }
    let place = 0.5 * analysis.reach.farthest_m();
    let half_way = analysis.reach.in_front(place)?;
    let mut text = format!(
        "On the ground, the front of the slide reaches {} m in front of the toe in {} of all realisations ({}); the farthest \
         front of all came {} m.",
        metres(place),
        percent(half_way.share),
        interval(half_way.interval, percent),
        metres(analysis.reach.farthest_m()),
    );
    match &found.mean_run {
        Some(run) if run.failed => {
            let _ = write!(
                text,
                " A single analysis with mean properties runs {} m; {} of the slides go farther.",
                metres(run.runout_m),
                percent(run.share)
            );
        }
        Some(_) => text.push_str(" In a single analysis with mean properties the slope stands."),
        None => {}
    }
    Some(text)
}

fn rests_on(material: &Material<'_>, analysis: &Analysis) -> String {
    let estimate = &analysis.estimate;
    let mut text = format!(
        "{} samples of runout among {} realisations; every interval is at the {} level and says how well these \
         realisations settle a number, not how well the soil or the model is known. {} Runout is the {}.",
        estimate.samples,
        estimate.realisations,
        percent(estimate.confidence),
        decision_in_words(analysis.decision),
        measure_in_words(material.campaign.model.sample.measure),
    );
    text.push_str(&moving_in_words(estimate, material.campaign.model.analysis.duration_s));
    if estimate.failed > 0 {
        let _ = write!(
            text,
            " {} analyses failed; they are counted and in no estimate, and the probability of failure is that of \
             the others.",
            estimate.failed
        );
    }
    text
}

/// Says so where slides have taken all the ground behind the crest, to the wall that ends it.
fn rear_wall_in_words(model: &Model, retreats_m: &[f64]) -> Option<String> {
    let room_m = slope::crest_edge_x(&model.slope) - slope::rear_x(&model.slope);
    let reached = retreats_m.iter().filter(|retreat_m| **retreat_m > room_m - model.mesh.cell_size_m).count();
    (reached > 0).then(|| {
        format!(
            "<b>Note:</b> in {reached} of {} samples the ground moved back to the rear wall, {} m behind the crest's edge. More \
             would have moved without it: retreat, moved area and perhaps the runout are lower bounds there, and the \
             campaign needs more ground behind the crest.",
            retreats_m.len(),
            significant(room_m, 4)
        )
    })
}

fn moving_in_words(estimate: &Estimate, duration_s: f64) -> String {
    match estimate.still_moving {
        0 => String::new(),
        moving => {
            let many = moving as f64 > MANY_MOVING * estimate.samples as f64;
            format!(
                " {moving} of the samples still moved when their analysis ended at {} s: their runout is a lower \
                 bound{}.",
                significant(duration_s, 4),
                if many {
                    ". They are so many that the mean and the distances above are lower bounds too"
                } else {
                    ""
                },
            )
        }
    }
}

fn measure_in_words(measure: RunoutMeasure) -> &'static str {
    match measure {
        RunoutMeasure::DisplacementQ999 => "displacement that 99.9 % of the material points do not exceed",
        RunoutMeasure::MaxDisplacement => {
            "largest displacement of any material point, which a single one that is thrown clear can set"
        }
        RunoutMeasure::ToeAdvance => "advance of the contiguous material beyond the initial toe",
    }
}
