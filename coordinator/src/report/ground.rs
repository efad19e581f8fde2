//! The page's part on the ground: what is reached, how deep, how fast; how much moved; which soil decides.

use super::analysis::Analysis;
use super::figures::{Figure, short_name};
use super::hazard::{Evidence, Hazard};
use super::html::{captioned, paragraph, table};
use super::page::{find, interval, metres, optional_interval, pair, percent};
use super::sensitivity::{Correlation, Sensitivity};
use super::{Findings, Material};
use crate::picture::axes::round_ticks;
use runout_core::profile::LOOK_EVERY_S;

/// Rows of the table along the ground.
const ROWS: usize = 12;

/// The hazard along the ground.
pub(super) fn hazard(material: &Material<'_>, found: &Findings, figures: &[Figure]) -> String {
    let analysis = &found.analysis;
    if analysis.reach.in_front(0.0).is_none() {
        return paragraph("No realisation has been decided yet.");
    }
    let mut html = find(figures, "hazard-profile");
    let hazard = found.hazard.as_ref();
    html.push_str(&captioned(
        "Along the ground in front of the toe, whether the slope fails or not",
        &reached(analysis, hazard),
    ));
    if let Some(hazard) = hazard {
        html.push_str(&captioned(
            "Depths and speeds along the ground in front of the toe, given failure",
            &depths_and_speeds(analysis, hazard),
        ));
    }
    html.push_str(&pair(figures, &["hazard-crest"]));
    html.push_str(&captioned("Behind the crest's edge, whether the slope fails or not", &behind(analysis)));
    html.push_str(&paragraph(format!(
        "A place is reached if the slope fails and the contiguous front of the slide goes beyond it, and lost if \
         the slope fails and the ground there moved more than {} m: both are counted over every realisation, stable ones \
         included, failed analyses left out. Material that is thrown or rolls ahead of the front is not counted. Places beyond the longest slide of this campaign are not safe: they are where \
         the interval's upper end speaks.",
        metres(material.campaign.model.sample.threshold_m)
    )));
    html.push_str(&match hazard {
        Some(hazard) => paragraph(basis(material, analysis, hazard)),
        None if material.spec.model.sample.profile => {
            paragraph("There is no sample, and so neither depth nor speed along the ground.")
        }
        None => paragraph(
            "Depths and speeds along the ground need replays: <code>runout report DIR --profiles 20</code>; campaigns with \
             <code>sample.profile = true</code> record them in every realisation.",
        ),
    });
    html
}

/// What depths and speeds rest on, and mean.
fn basis(material: &Material<'_>, analysis: &Analysis, hazard: &Hazard) -> String {
    let samples = analysis.samples_m.len();
    let (from, deeper) = match hazard.evidence {
        Evidence::Recorded => (
            format!("all {samples} samples, each of which recorded its own"),
            " A deposit is deeper than a depth if the slope fails and more soil comes to lie there, thrown soil included.",
        ),
        Evidence::Replayed => (
            format!(
                "{} of the {samples} samples, chosen at random by the campaign's seed and replayed, because this campaign \
                 records no profiles (<code>sample.profile</code>)",
                hazard.profiles
            ),
            "",
        ),
    };
    let intervals = match (&hazard.depth_m.median.intervals, &hazard.depth_m.one_in_ten.intervals) {
        (Some(_), Some(_)) => "their intervals hold whatever the distribution, place by place",
        (Some(_), None) => {
            "the median's interval holds whatever the distribution, place by place; there are too few for one of the depth \
             exceeded in one of ten"
        }
        _ => "there are too few for intervals",
    };
    let mesh = &material.spec.model.mesh;
    let cells = (hazard.column_m / mesh.cell_size_m).round();
    let cells = if cells > 1.0 { format!("{cells} cells") } else { "one cell".to_owned() };
    format!(
        "Depths and speeds rest on {from}; {intervals}. Depth is the soil above the original ground, slid or heaved, at the \
         end; speed is the highest of that soil as a whole (momentum over mass), looked at every {LOOK_EVERY_S} s. Both are \
         means over columns of {cells}, {} m wide; depths are known to about one spacing of the points, {} m.{deeper} A stable \
         slope deposits nothing: quantiles over all realisations are smaller.",
        metres(hazard.column_m),
        metres(mesh.point_spacing_m())
    )
}

/// Places of the tables along the ground, no closer than the columns, whose numbers would be repeated.
fn places(analysis: &Analysis, hazard: Option<&Hazard>) -> Vec<f64> {
    let column_m = hazard.map_or(0.0, |hazard| hazard.column_m);
    let farthest_m = analysis.reach.farthest_m().max(1.0).max(column_m);
    // No more steps than columns: each is at least as wide.
    let columns = hazard.map_or(ROWS, |_| (farthest_m / column_m) as usize);
    round_ticks(0.0, farthest_m, ROWS.min(columns))
}

/// What is reached, and buried how deep.
fn reached(analysis: &Analysis, hazard: Option<&Hazard>) -> String {
    let deeper = hazard.map_or(&[][..], |hazard| &hazard.deeper);
    let rows = places(analysis, hazard).into_iter().filter_map(|x| {
        let reached = analysis.reach.in_front(x)?;
        let mut cells = vec![
            metres(x),
            reached.hits.to_string(),
            percent(reached.share),
            interval(reached.interval, percent),
        ];
        for deeper in deeper {
            let found = hazard.and_then(|h| column(h, x)).and_then(|c| deeper.probabilities.get(c));
            cells.push(found.map_or_else(dash, |p| percent(p.share)));
            cells.push(found.map_or_else(dash, |p| interval(p.interval, percent)));
        }
        Some((false, cells))
    });
    let rows: Vec<(bool, Vec<String>)> = rows.collect();
    let titles: Vec<String> = deeper.iter().map(|d| format!("deposit deeper than {} m", d.depth_m)).collect();
    let mut header = vec!["distance (m)", "reached in", "probability", "interval"];
    header.extend(titles.iter().flat_map(|title| [title.as_str(), "interval"]));
    table(&header, &rows)
}

fn depths_and_speeds(analysis: &Analysis, hazard: &Hazard) -> String {
    let quantiles = [
        &hazard.depth_m.median,
        &hazard.depth_m.one_in_ten,
        &hazard.speed_m_s.median,
        &hazard.speed_m_s.one_in_ten,
    ];
    let show = |value: f64| format!("{value:.2}");
    let rows = places(analysis, Some(hazard)).into_iter().map(|x| {
        let column = column(hazard, x);
        let mut cells = vec![metres(x)];
        for quantile in quantiles {
            cells.push(column.map_or_else(dash, |c| show(quantile.values[c])));
            let ends = column.zip(quantile.intervals.as_ref()).map(|(c, intervals)| intervals[c]);
            cells.push(ends.map_or_else(dash, |ends| interval(ends, show)));
        }
        (false, cells)
    });
    let rows: Vec<(bool, Vec<String>)> = rows.collect();
    let header = [
        "distance (m)",
        "median depth (m)",
        "interval",
        "one in ten (m)",
        "interval",
        "median speed (m/s)",
        "interval",
        "one in ten (m/s)",
        "interval",
    ];
    table(&header, &rows)
}

/// The column that holds `x` m, or begins there.
fn column(hazard: &Hazard, x: f64) -> Option<usize> {
    Some((x / hazard.column_m) as usize).filter(|column| *column < hazard.x_m.len())
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
