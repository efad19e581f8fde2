//! The page: the answer in plain words first (see `answer`), then the numbers and figures it rests on.

use super::analysis::Analysis;
use super::figures::Figure;
use super::html::{STYLE, captioned, escape, illustration, paragraph, table};
use super::{Findings, Material, answer, distances, ground, inputs, slides};
use crate::table::significant;
use runout_core::campaign::StopRule;
use runout_core::estimate::interval::Interval;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Realisations of one kind and reason that are named one by one; the results table has them all.
const MOST_NAMED: usize = 60;

/// The whole document.
pub(super) fn page(material: &Material<'_>, found: &Findings, figures: &[Figure]) -> String {
    let name = escape(&material.campaign.name);
    let analysis = &found.analysis;
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <title>Runout of {name}</title><style>\n{STYLE}</style></head><body>\n<main>\n\
         <h1>Runout of {name}</h1>\n<p class=\"lead\">{} realisations of spec {}</p>\n",
        analysis.estimate.realisations,
        &material.spec.digest()[..12]
    );
    html.push_str(&answer::answer(material, found));
    html.push_str(&cards(analysis));
    let sections = [
        ("How far", "how-far", distances::how_far(analysis, figures)),
        ("Along the ground", "ground", ground::hazard(material, found, figures)),
        ("The slope with mean properties", "mean", slides::mean_properties(found, figures)),
        ("The samples and their distribution", "samples", samples(analysis, figures)),
        ("How much moved", "amounts", ground::amounts(analysis, figures)),
        ("Which soil decides", "soil-decides", ground::sensitivity(&found.sensitivity, figures)),
        ("What the slides look like", "slides", slides::gallery(found, figures)),
        ("Convergence", "convergence", convergence(material, analysis, figures)),
        ("What became of the realisations", "realisations", realisations(material, analysis)),
        ("Soil", "soil", inputs::soil(material, figures)),
        ("The slope and every input that moves the answer", "inputs", inputs::inputs(material, figures)),
        ("Where these numbers come from", "provenance", inputs::provenance(material, found)),
    ];
    html.push_str("<nav aria-label=\"Contents\"><ol>\n");
    for (title, id, _) in &sections {
        let _ = writeln!(html, "<li><a href=\"#{id}\">{title}</a></li>");
    }
    html.push_str("</ol></nav>\n");
    for (title, id, content) in &sections {
        let _ = write!(
            html,
            "<section id=\"{id}\" aria-labelledby=\"{id}-title\"><h2 id=\"{id}-title\">{title}</h2>\n{content}</section>\n"
        );
    }
    html + "</main>\n</body></html>\n"
}

fn cards(analysis: &Analysis) -> String {
    let estimate = &analysis.estimate;
    let optional = |value: Option<f64>, unit: &str| {
        value.map_or_else(|| "\u{2013}".to_owned(), |v| format!("{} {unit}", metres(v)))
    };
    let cards = [
        (estimate.samples.to_string(), "samples (slides)"),
        (estimate.stable.to_string(), "stable"),
        (estimate.failed.to_string(), "failed analyses"),
        (estimate.p_failure.map_or_else(|| "\u{2013}".to_owned(), percent), "probability of failure"),
        (optional(estimate.mean_m, "m"), "mean runout"),
        (optional(estimate.sd_m, "m"), "standard deviation"),
        (
            estimate.cov.map_or_else(|| "\u{2013}".to_owned(), |v| significant(v, 3)),
            "coefficient of variation",
        ),
        (optional(estimate.max_m, "m"), "longest"),
    ];
    let mut html = String::from("<div class=\"numbers\">");
    for (value, label) in cards {
        let _ = write!(html, "<div><b>{value}</b><span>{label}</span></div>");
    }
    html + "</div>\n"
}

fn samples(analysis: &Analysis, figures: &[Figure]) -> String {
    if analysis.families.is_empty() {
        let least = super::families::FEWEST_SAMPLES;
        return paragraph(format!(
            "No family is fitted: there are {} samples, and at least {least} different ones are needed.",
            analysis.samples_m.len()
        )) + &pair(figures, &["histogram-likelihood", "cdf"]);
    }
    let rows: Vec<(bool, Vec<String>)> = analysis
        .families
        .iter()
        .map(|f| {
            let (mean, sd) = f.marginal.moments();
            let numbers = [f.marginal.p, f.marginal.q, mean, sd, f.log_likelihood, f.aic, f.bic];
            let mut cells = vec![f.family.name().to_owned(), f.method.name().to_owned()];
            cells.extend(numbers.map(|v| significant(v, 6)));
            (f.best, cells)
        })
        .collect();
    let header = ["family", "fitted by", "p", "q", "mean (m)", "sd (m)", "log-likelihood", "AIC", "BIC"];
    pair(figures, &["histogram-likelihood", "histogram-moments"])
        + &captioned("The families fitted to the samples", &table(&header, &rows))
        + &paragraph(
            "p and q as in the paper's Table 1. The samples are those above the threshold; the families start at zero. \
             A family that is missing cannot be fitted to these samples by that method.",
        )
        + &pair(figures, &["cdf"])
}

fn convergence(material: &Material<'_>, analysis: &Analysis, figures: &[Figure]) -> String {
    let rule = match &material.campaign.stop.rule {
        StopRule::Paper { tolerance, relative, patience } => format!(
            "the paper's (its Eqs. 22 and 23): mean and variance change by less than {tolerance}{} for {patience} \
             samples in a row",
            if *relative { " of themselves" } else { " m and m\u{b2}" }
        ),
        StopRule::Interval { confidence, mean_half_width, sd_half_width, exceedance } => {
            let mut parts = Vec::new();
            if let Some(width) = mean_half_width {
                parts.push(format!("of the mean within \u{b1}{}", percent(*width)));
            }
            if let Some(width) = sd_half_width {
                parts.push(format!("of the standard deviation within \u{b1}{}", percent(*width)));
            }
            parts.extend(exceedance.iter().map(|t| {
                format!(
                    "of the exceedance of {} m within \u{b1}{}",
                    metres(t.distance_m),
                    percent(t.half_width)
                )
            }));
            format!("{} intervals {}", percent(*confidence), parts.join(", "))
        }
    };
    let stop = &material.campaign.stop;
    paragraph(format!(
        "The rule is {rule}; at least {} and at most {} realisations. {}",
        stop.minimum_realisations,
        stop.maximum_realisations,
        answer::decision_in_words(analysis.decision)
    )) + &find(figures, "outcomes")
        + &pair(
            figures,
            &["convergence-mean", "convergence-variance", "convergence-cov", "convergence-failure"],
        )
}

fn realisations(material: &Material<'_>, analysis: &Analysis) -> String {
    let estimate = &analysis.estimate;
    let rows = [
        (
            format!("runout (above {} m)", metres(material.campaign.model.sample.threshold_m)),
            estimate.samples,
        ),
        ("of these, still moving at the end".to_owned(), estimate.still_moving),
        ("stable".to_owned(), estimate.stable),
        ("failed analyses".to_owned(), estimate.failed),
        ("with an energy balance that drifts beyond the limit".to_owned(), estimate.energy_drifted),
        ("all".to_owned(), estimate.realisations),
    ];
    let rows: Vec<(bool, Vec<String>)> =
        rows.into_iter().map(|(label, count)| (false, vec![label, count.to_string()])).collect();
    let html = captioned("Realisations by outcome", &table(&["outcome", "realisations"], &rows));
    let listed = remarkable(analysis);
    let none = || paragraph("No analysis failed, and none is marked.");
    html + &if listed.is_empty() { none() } else { listed }
}

/// Failed and marked realisations by kind and reason or mark, for `runout replay`.
fn remarkable(analysis: &Analysis) -> String {
    let mut groups: BTreeMap<(&str, &str), Vec<u64>> = BTreeMap::new();
    for (index, kind, reason) in &analysis.remarkable {
        groups.entry((kind.name(), reason)).or_default().push(*index);
    }
    let line = |((kind, reason), indices): (&(&str, &str), &Vec<u64>)| {
        let named: Vec<String> = indices.iter().take(MOST_NAMED).map(u64::to_string).collect();
        let more = match indices.len().saturating_sub(MOST_NAMED) {
            0 => String::new(),
            more => format!(" and {more} more (see <code>runout results</code>)"),
        };
        paragraph(format!("{kind}, {reason}: realisations {}{more}.", named.join(", ")))
    };
    groups.iter().map(line).collect()
}

/// The figure of that name, if it was drawn.
pub(super) fn find(figures: &[Figure], name: &str) -> String {
    figures.iter().find(|f| f.name == name).map(illustration).unwrap_or_default()
}

/// Figures side by side, where the page is wide enough.
pub(super) fn pair(figures: &[Figure], names: &[&str]) -> String {
    let found: String = names.iter().map(|name| find(figures, name)).collect();
    if found.is_empty() { found } else { format!("<div class=\"pair\">{found}</div>\n") }
}

/// A distance to the centimetre, small ones to two digits.
pub(super) fn metres(value: f64) -> String {
    // Centimetres are as fine as any runout is meant.
    if value.abs() < 0.095 { significant(value, 2) } else { format!("{value:.2}") }
}

/// A share as a percentage of three digits.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}

/// Both ends.
pub(super) fn interval([low, high]: Interval, show: impl Fn(f64) -> String) -> String {
    format!("{} to {}", show(low), show(high))
}

/// Both ends, or that there are too few samples.
pub(super) fn optional_interval(found: Option<Interval>, show: impl Fn(f64) -> String) -> String {
    found.map_or_else(|| "too few for an interval".to_owned(), |i| interval(i, show))
}
