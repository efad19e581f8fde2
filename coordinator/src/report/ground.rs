//! The page's part on the ground: what is reached, how deep, how fast; how much moved; which soil decides.

use super::analysis::Analysis;
use super::figures::{Figure, short_name};
use super::hazard::Hazard;
use super::html::{captioned, paragraph, table};
use super::page::{find, interval, metres, optional_interval, pair, percent};
use super::sensitivity::{Correlation, Sensitivity};
use super::{Findings, Material};
use crate::picture::axes::round_ticks;

/// Rows of the table along the ground.
const ROWS: usize = 12;

/// The hazard along the ground.
pub(super) fn hazard(material: &Material<'_>, found: &Findings, figures: &[Figure]) -> String {
    let analysis = &found.analysis;
    if analysis.reach.in_front(0.0).is_none() {
        return paragraph("No realisation has been decided yet.");
    }
    let mut html = find(figures, "hazard-profile");
    html.push_str(&captioned(
        "Along the ground in front of the toe: whether the slope fails or not for being reached, given failure for depths and speeds",
        &along(analysis, found.hazard.as_ref()),
    ));
    html.push_str(&pair(figures, &["hazard-crest"]));
    html.push_str(&captioned("Behind the crest's edge, whether the slope fails or not", &behind(analysis)));
    html.push_str(&paragraph(format!(
        "A place is reached if the slope fails and the contiguous front of the slide goes beyond it, and lost if \
         the slope fails and the ground there moved more than {} m: both are counted over every realisation, stable ones \
         included, failed analyses left out. Material that is thrown or rolls ahead of the front is not counted. Places beyond the longest slide of this campaign are not safe: they are where \
         the interval's upper end speaks.",
        metres(material.campaign.model.sample.threshold_m)
    )));
    html.push_str(&paragraph(match &found.hazard {
        Some(hazard) => format!(
            "Depths and speeds rest on {} of the {} samples, chosen at random by the campaign's seed and replayed{}. \
             Depth is the soil above the original ground, slid or heaved, at the end; speed is the highest of that soil as a whole \
             (momentum over mass), looked at every 0.05 s. Depths are known to about one spacing of the points, {} m. A stable \
             slope deposits nothing: quantiles over all realisations are smaller.",
            hazard.profiles,
            analysis.samples_m.len(),
            match hazard.depth_m.median_interval {
                Some(_) => "; the median's interval holds whatever the distribution",
                None => "; too few for an interval of the median",
            },
            metres(material.campaign.model.mesh.point_spacing_m())
        ),
        None => "Depths and speeds along the ground need replays: <code>runout report DIR --profiles 20</code>.".to_owned(),
    }));
    html
}

fn along(analysis: &Analysis, hazard: Option<&Hazard>) -> String {
    let places = round_ticks(0.0, analysis.reach.farthest_m().max(1.0), ROWS);
    let rows = places.iter().filter_map(|x| {
        let reached = analysis.reach.in_front(*x)?;
        let mut cells = vec![
            metres(*x),
            reached.hits.to_string(),
            percent(reached.share),
            interval(reached.interval, percent),
        ];
        if let Some(hazard) = hazard {
            cells.extend(at(hazard, *x));
        }
        Some((false, cells))
    });
    let rows: Vec<(bool, Vec<String>)> = rows.collect();
    let mut header = vec!["distance (m)", "reached in", "probability", "interval"];
    if hazard.is_some() {
        header.extend([
            "median depth (m)",
            "interval (m)",
            "one in ten (m)",
            "median speed (m/s)",
            "one in ten (m/s)",
        ]);
    }
    table(&header, &rows)
}

/// Depths and speeds in the column that begins at `x` m.
fn at(hazard: &Hazard, x: f64) -> Vec<String> {
    let column = hazard.x_m.iter().position(|middle| *middle > x);
    let cell = |values: &[f64]| column.map_or_else(dash, |c| format!("{:.2}", values[c]));
    let depth = &hazard.depth_m;
    vec![
        cell(&depth.median),
        column
            .zip(depth.median_interval.as_ref())
            .map_or_else(dash, |(c, intervals)| interval(intervals[c], |v| format!("{v:.2}"))),
        cell(&depth.one_in_ten),
        cell(&hazard.speed_m_s.median),
        cell(&hazard.speed_m_s.one_in_ten),
    ]
}

fn behind(analysis: &Analysis) -> String {
    let places = round_ticks(0.0, analysis.reach.largest_retreat_m().max(1.0), ROWS / 2);
    let rows = places.iter().filter_map(|x| {
        let lost = analysis.reach.behind(*x)?;
        let cells =
            vec![metres(*x), lost.hits.to_string(), percent(lost.share), interval(lost.interval, percent)];
        Some((false, cells))
    });
    let rows: Vec<(bool, Vec<String>)> = rows.collect();
    table(&["distance (m)", "lost in", "probability", "interval"], &rows)
}

/// How much moved.
pub(super) fn amounts(analysis: &Analysis, figures: &[Figure]) -> String {
    if analysis.samples_m.len() < 2 {
        return paragraph("There are too few samples.");
    }
    let row = |name: &str, values: &[f64]| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let at = |share: f64| format!("{:.2}", sorted[((share * n as f64).ceil() as usize).clamp(1, n) - 1]);
        let mean = sorted.iter().sum::<f64>() / n as f64;
        (false, vec![name.to_owned(), format!("{mean:.2}"), at(0.0), at(0.5), at(0.9), at(0.99), at(1.0)])
    };
    let rows = [
        row("moved area (m\u{b2})", &analysis.moved_areas_m2),
        row("retreat of the crest (m)", &analysis.retreats_m),
    ];
    let header = ["", "mean", "smallest", "median", "90 %", "99 %", "largest"];
    captioned("In the samples", &table(&header, &rows)) + &pair(figures, &["volume", "retreat"])
}

/// Which soil decides.
pub(super) fn sensitivity(sensitivity: &Sensitivity, figures: &[Figure]) -> String {
    let chart = find(figures, "sensitivity");
    if chart.is_empty() {
        return paragraph(
            "There are too few realisations, or nothing is random, so that no correlation is given.",
        );
    }
    let rho = |c: Option<Correlation>| c.map_or_else(dash, |c| format!("{:.2}", c.rho));
    let ends = |c: Option<Correlation>| optional_interval(c.map(|c| c.interval), |v| format!("{v:.2}"));
    let rows: Vec<(bool, Vec<String>)> = sensitivity
        .influences
        .iter()
        .map(|i| {
            let cells = vec![
                short_name(i.property).to_owned(),
                i.zone.clone(),
                percent(i.share),
                rho(i.of_all),
                ends(i.of_all),
                rho(i.of_samples),
                ends(i.of_samples),
            ];
            (false, cells)
        })
        .collect();
    let header =
        ["property", "mean over", "share of points", "all realisations", "interval", "samples", "interval"];
    chart
        + &captioned(
            "Spearman's rank correlation of the runout with spatial means of the fields",
            &table(&header, &rows),
        )
        + &paragraph(format!(
            "From {} realisations, {} of them samples, whose fields were drawn again from the seed. Over all realisations the \
             runout measure of a stable slope is its small displacement, so that this column says which soil decides whether and how \
             far the slope goes; the last one is among slides only. Intervals by Fisher's transform with the variance 1.06 / (n - 3); \
             they are one by one, not for all at once. Neighbouring zones and correlated properties share what they explain.",
            sensitivity.realisations, sensitivity.samples
        ))
}

fn dash() -> String {
    "\u{2013}".to_owned()
}
