//! The page: plain words first, then the numbers and figures they rest on.

use super::analysis::Analysis;
use super::figures::Figure;
use super::html::{STYLE, escape, figure, paragraph, table};
use super::{Material, inputs};
use crate::table::significant;
use runout_core::campaign::{RunoutMeasure, StopRule};
use runout_core::estimate::Decision;
use runout_core::estimate::interval::Interval;
use std::fmt::Write as _;

/// Failed and still moving realisations that are named one by one; the results table has them all.
const MOST_NAMED: usize = 60;

/// The whole document.
pub(super) fn page(material: &Material<'_>, analysis: &Analysis, figures: &[Figure]) -> String {
    let name = escape(&material.campaign.name);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <title>Runout of {name}</title><style>\n{STYLE}</style></head><body>\n\
         <h1>Runout of {name}</h1>\n<p class=\"lead\">{} realisations of spec {}</p>\n",
        analysis.estimate.realisations,
        &material.spec.digest()[..12]
    );
    html.push_str(&answer(material, analysis));
    html.push_str(&cards(analysis));
    section(&mut html, "How far", &how_far(analysis, figures));
    section(&mut html, "The samples and their distribution", &samples(analysis, figures));
    section(&mut html, "Convergence", &convergence(material, analysis, figures));
    section(&mut html, "What became of the realisations", &realisations(material, analysis));
    section(&mut html, "Soil", &inputs::soil(material));
    section(&mut html, "Every input that moves the answer", &inputs::inputs(material));
    section(&mut html, "Where these numbers come from", &inputs::provenance(material));
    html + "</body></html>\n"
}

fn section(html: &mut String, title: &str, content: &str) {
    let _ = write!(html, "<section><h2>{title}</h2>\n{content}</section>\n");
}

/// What was asked, the answer, what it rests on.
fn answer(material: &Material<'_>, analysis: &Analysis) -> String {
    let slope = &material.campaign.model.slope;
    let estimate = &analysis.estimate;
    let tests = material.fit.tests.map_or_else(
        || "the given distributions".to_owned(),
        |n| format!("the {n} laboratory tests from the site"),
    );
    let mut html = String::from("<div class=\"answer\">\n");
    html.push_str(&paragraph(format!(
        "<b>Asked:</b> how far does this slope, {} m high at {}\u{b0}, run when it fails, if its soil varies as {tests} \
         say?",
        significant(slope.height_m, 4),
        significant(slope.angle_rad.to_degrees(), 4),
    )));
    let answer = match (estimate.p_failure, estimate.mean_m) {
        (None, _) => "<b>Answer:</b> none yet: no realisation has been decided.".to_owned(),
        (Some(_), None) => format!(
            "<b>Answer:</b> in none of {} realisations did the slope fail (interval of the probability of failure: {}).",
            estimate.stable,
            optional_interval(estimate.p_failure_interval, percent),
        ),
        (Some(p), Some(mean)) => format!(
            "<b>Answer:</b> the slope fails in <strong>{}</strong> of realisations ({}). When it fails, it runs \
             <strong>{} m</strong> on average ({}). {}",
            percent(p),
            optional_interval(estimate.p_failure_interval, percent),
            metres(mean),
            optional_interval(estimate.mean_interval_m, |v| format!("{} m", metres(v))),
            tail_in_words(analysis),
        ),
    };
    html.push_str(&paragraph(answer));
    html.push_str(&paragraph(format!("<b>It rests on</b> {}", rests_on(material, analysis))));
    for note in material.notes {
        html.push_str(&paragraph(format!("<b>Note:</b> {}", escape(note))));
    }
    html + "</div>\n"
}

fn tail_in_words(analysis: &Analysis) -> String {
    let words = [(0.1, "One slide in ten"), (0.01, "one in a hundred"), (0.001, "one in a thousand")];
    let parts: Vec<String> = analysis
        .distances
        .iter()
        .zip(words)
        .filter_map(|(distance, (_, word))| {
            let fitted = distance.fitted.as_ref()?;
            Some(format!(
                "{word} goes beyond {} m ({})",
                metres(fitted.best_m),
                optional_interval(fitted.interval_m, |v| format!("{} m", metres(v)))
            ))
        })
        .collect();
    match parts.is_empty() {
        true => "There are too few samples to speak of rarer, longer slides.".to_owned(),
        false => format!("{}.", parts.join(", ")),
    }
}

fn rests_on(material: &Material<'_>, analysis: &Analysis) -> String {
    let estimate = &analysis.estimate;
    let mut text = format!(
        "{} samples of runout among {} realisations; every interval is at the {:.0} % level. {}",
        estimate.samples,
        estimate.realisations,
        100.0 * estimate.confidence,
        decision_in_words(analysis.decision),
    );
    let _ = write!(text, " Runout is the {}.", measure_in_words(material.campaign.model.sample.measure));
    if estimate.still_moving > 0 {
        let _ = write!(
            text,
            " {} samples still moved when their analysis ended: their runout is a lower bound.",
            estimate.still_moving
        );
    }
    if estimate.failed > 0 {
        let _ = write!(
            text,
            " {} analyses failed; they are counted and in no estimate, and the probability of failure is that of \
             the others.",
            estimate.failed
        );
    }
    if let Some(best) = analysis.families.iter().find(|f| f.best) {
        let _ = write!(
            text,
            " Distances at small probabilities extrapolate by the {} distribution, the best of four by AIC; the \
             table below says what the others give.",
            best.family.name()
        );
    }
    text
}

fn decision_in_words(decision: Decision) -> String {
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

fn measure_in_words(measure: RunoutMeasure) -> &'static str {
    match measure {
        RunoutMeasure::DisplacementQ999 => "displacement that 99.9 % of the material points do not exceed",
        RunoutMeasure::MaxDisplacement => "largest displacement of any material point",
        RunoutMeasure::ToeAdvance => "advance of the contiguous material beyond the initial toe",
    }
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
        (optional(estimate.max_m, "m"), "longest"),
    ];
    let mut html = String::from("<div class=\"numbers\">");
    for (value, label) in cards {
        let _ = write!(html, "<div><b>{value}</b><span>{label}</span></div>");
    }
    html + "</div>\n"
}

fn how_far(analysis: &Analysis, figures: &[Figure]) -> String {
    if analysis.samples_m.len() < 2 {
        return paragraph(format!("With {} samples there is no exceedance curve.", analysis.samples_m.len()));
    }
    let dash = || "\u{2013}".to_owned();
    let rows: Vec<(bool, Vec<String>)> = analysis
        .distances
        .iter()
        .map(|d| {
            let fitted =
                |f: &dyn Fn(&super::families::Sensitivity) -> String| d.fitted.as_ref().map_or_else(dash, f);
            let cells = vec![
                percent(d.probability),
                d.empirical.distance_m.map_or_else(dash, metres),
                d.empirical.upper_bound_m.map_or_else(dash, metres),
                fitted(&|f| metres(f.best_m)),
                fitted(&|f| f.interval_m.map_or_else(dash, |i| interval(i, metres))),
                fitted(&|f| interval(f.families_m, metres)),
                fitted(&|f| interval(f.supported_m, metres)),
                d.unconditional_m.map_or_else(dash, metres),
            ];
            (false, cells)
        })
        .collect();
    let header = [
        "exceeded with",
        "samples",
        "upper bound",
        "best family",
        "bootstrap interval",
        "four families",
        "supported fits",
        "whole slope",
    ];
    let mut html = table(&header, &rows);
    html.push_str(&paragraph(
        "Distances in m. <i>Samples</i>: read off the samples, where there are enough; <i>upper bound</i>: \
         one-sided, from order statistics, free of any family. <i>Best family</i>: smallest AIC by maximum likelihood; \
         its interval is a bootstrap of the samples that fits anew each time. <i>Four families</i>: smallest and largest over all \
         families by maximum likelihood; <i>supported fits</i>: over both methods, among those with an AIC within 10 of the \
         best. All these hold given failure; <i>whole slope</i> is the distance that a realisation exceeds with that probability, \
         stable ones included, by the best family.",
    ));
    html.push_str(&pair(figures, ["exceedance", "exceedance-log"]));
    html
}

fn samples(analysis: &Analysis, figures: &[Figure]) -> String {
    if analysis.families.is_empty() {
        let least = super::families::FEWEST_SAMPLES;
        return paragraph(format!(
            "No family is fitted: there are {} samples, and at least {least} different ones are needed.",
            analysis.samples_m.len()
        )) + &pair(figures, ["histogram-likelihood", ""]);
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
    pair(figures, ["histogram-likelihood", "histogram-moments"])
        + &table(&header, &rows)
        + &paragraph(
            "p and q as in the paper's Table 1. The samples are those above the threshold; the families start at zero. \
             A family that is missing cannot be fitted to these samples by that method.",
        )
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
        decision_in_words(analysis.decision)
    )) + &pair(figures, ["convergence-mean", "convergence-variance"])
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
        ("all".to_owned(), estimate.realisations),
    ];
    let rows: Vec<(bool, Vec<String>)> =
        rows.into_iter().map(|(label, count)| (false, vec![label, count.to_string()])).collect();
    let mut html = table(&["outcome", "realisations"], &rows);
    if !analysis.remarkable.is_empty() {
        let named: Vec<String> = analysis
            .remarkable
            .iter()
            .take(MOST_NAMED)
            .map(|(index, kind, reason)| format!("{index} ({}, {})", kind.name(), reason.name()))
            .collect();
        let more = analysis.remarkable.len().saturating_sub(MOST_NAMED);
        let rest = if more > 0 {
            format!(" and {more} more (see <code>runout results</code>)")
        } else {
            String::new()
        };
        html.push_str(&paragraph(format!("Failed or still moving: {}{rest}.", named.join(", "))));
    }
    html
}

/// Two figures side by side, where the page is wide enough.
fn pair(figures: &[Figure], names: [&str; 2]) -> String {
    let found: String = names
        .iter()
        .filter_map(|name| figures.iter().find(|f| f.name == *name))
        .map(|f| figure(&f.svg, &f.caption))
        .collect();
    if found.is_empty() { found } else { format!("<div class=\"pair\">{found}</div>\n") }
}

fn metres(value: f64) -> String {
    // Centimetres are as fine as any runout is meant.
    if value.abs() < 0.095 { significant(value, 2) } else { format!("{value:.2}") }
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}

fn interval([low, high]: Interval, show: impl Fn(f64) -> String) -> String {
    format!("{} to {}", show(low), show(high))
}

fn optional_interval(found: Option<Interval>, show: impl Fn(f64) -> String) -> String {
    found.map_or_else(|| "too few for an interval".to_owned(), |i| interval(i, show))
}
