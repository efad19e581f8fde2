//! The distances of rare slides: in short for the top of the page, and in full, with the curves that they lie on.

use super::analysis::{Analysis, Distance, PROBABILITIES};
use super::families::{self, Method, Sensitivity};
use super::figures::Figure;
use super::html::{captioned, paragraph, table};
use super::page::{interval, metres, pair, percent};
use crate::table::significant;

/// A distance with fewer samples beyond it rests more on the fitted family than on the samples: five hits have a
/// relative standard error of 45 %.
const FEW_BEYOND: u64 = 5;

/// What a table shows where there is nothing.
fn dash() -> String {
    "\u{2013}".to_owned()
}

/// The distances in a table of a few columns: the samples' own where they settle them, the best family's beyond.
pub(super) fn in_short(analysis: &Analysis) -> String {
    let has_stable = analysis.estimate.stable > 0;
    let rows: Vec<(bool, Vec<String>)> = analysis
        .distances
        .iter()
        .filter_map(|distance| {
            let (runout, ends, origin) = given_failure(analysis, distance)?;
            let mut cells = vec![percent(distance.probability), runout, ends, origin];
            if has_stable {
                cells.push(whether_or_not(distance));
            }
            Some((false, cells))
        })
        .collect();
    if rows.is_empty() {
        return paragraph("There are too few samples to speak of rarer, longer slides.");
    }
    let level = format!("{} interval", percent(analysis.estimate.confidence));
    let mut header = vec!["exceeded with", "runout of a slide", &level, "taken from"];
    if has_stable {
        header.push("failed or not");
    }
    let rarer = captioned("Runout that few slides exceed", &table(&header, &rows));
    match contradiction(analysis) {
        Some(words) => rarer + &paragraph(words),
        None => rarer,
    }
}

/// The distance, its interval, and what it comes from.
fn given_failure(analysis: &Analysis, distance: &Distance) -> Option<(String, String, String)> {
    let metre = |value: f64| format!("{} m", metres(value));
    if let Some((own_m, ends)) = distance.empirical.settled_m() {
        let origin = format!("the {} samples themselves", analysis.estimate.samples);
        return Some((metre(own_m), format!("{} m", interval(ends, metres)), origin));
    }
    let fitted = distance.fitted.as_ref()?;
    let ends = fitted.interval_m.map_or_else(dash, |ends| format!("{} m", interval(ends, metres)));
    let family = analysis.families.iter().find(|f| f.best).map_or("best", |f| f.family.name());
    Some((
        metre(fitted.best_m),
        ends,
        format!("the fitted {family} distribution{}", support(distance, fitted)),
    ))
}

/// How little the samples have to say of a fitted distance.
fn support(distance: &Distance, fitted: &Sensitivity) -> String {
    let samples = match distance.beyond {
        None => return String::new(),
        Some(0) => "no sample is".to_owned(),
        Some(1) => "1 sample is".to_owned(),
        Some(n) => format!("{n} samples are"),
    };
    let families = match distance.beyond {
        Some(n) if n >= FEW_BEYOND => String::new(),
        _ => format!(", four distributions give {} m", interval(fitted.families_m, metres)),
    };
    format!(": {samples} beyond it{families}")
}

/// The distance that a realisation exceeds with the same probability, whether it fails or not.
fn whether_or_not(distance: &Distance) -> String {
    match (distance.settled_unconditional_m(), distance.unconditional_m) {
        (Some(metre), _) => format!("{} m", metres(metre)),
        (None, Some(metre)) => format!("{} m, fitted", metres(metre)),
        (None, None) => dash(),
    }
}

/// Where the samples contradict the family that AIC prefers, which then says little of what lies beyond them.
fn contradiction(analysis: &Analysis) -> Option<String> {
    let best = analysis.families.iter().find(|f| f.best)?;
    let contradicted = analysis.distances.iter().filter(|distance| distance.is_contradicted());
    let parts: Vec<String> = contradicted
        .filter_map(|distance| {
            let fitted = distance.fitted.as_ref()?;
            Some(format!("{} m at {}", metres(fitted.best_m), percent(distance.probability)))
        })
        .collect();
    (!parts.is_empty()).then(|| {
        format!(
            "The {} distribution, the best of four by AIC, gives {}, outside the samples' interval: do not rely on it for \
             rarer slides either.",
            best.family.name(),
            parts.join(" and ")
        )
    })
}

/// The section on distances: curves, and what every way of reading them gives.
pub(super) fn how_far(analysis: &Analysis, figures: &[Figure]) -> String {
    if analysis.samples_m.len() < 2 {
        return paragraph(format!("With {} samples there is no exceedance curve.", analysis.samples_m.len()));
    }
    let rows: Vec<(bool, Vec<String>)> = analysis.distances.iter().map(|d| (false, every_way(d))).collect();
    let header = [
        "exceeded with",
        "samples beyond",
        "read off samples",
        "their interval",
        "upper bound",
        "best family",
        "bootstrap interval",
        "four families",
        "supported fits",
    ];
    let mut html = pair(figures, &["exceedance", "exceedance-log"]);
    html.push_str(&captioned(
        "Distances (m) exceeded with given probabilities, given failure",
        &table(&header, &rows),
    ));
    html.push_str(&paragraph(
        "<i>Samples beyond</i> the best family's distance: with \
         few or none the distribution speaks, not the samples. <i>Read off samples</i>: the order statistic, where there are \
         enough; its interval and the one-sided <i>upper bound</i> are order statistics too, free of any family. \
         <i>Best family</i>: smallest AIC by \
         maximum likelihood; its interval is a bootstrap of the samples that fits anew each time. <i>Four families</i>: smallest \
         and largest over all families by maximum likelihood; <i>supported fits</i>: over both methods, among those with an AIC \
         within 10 of the best.",
    ));
    html + &whole_slope(analysis) + &by_family(analysis)
}

/// The distances of the whole slope, stable realisations included, where there are any.
fn whole_slope(analysis: &Analysis) -> String {
    if analysis.estimate.stable == 0 {
        return String::new();
    }
    let row = |d: &Distance| {
        let all = &d.unconditional;
        let cells = vec![
            percent(d.probability),
            all.distance_m.map_or_else(dash, metres),
            all.interval_m.map_or_else(dash, |i| interval(i, metres)),
            all.upper_bound_m.map_or_else(dash, metres),
            d.unconditional_m.map_or_else(dash, metres),
        ];
        (false, cells)
    };
    let rows: Vec<(bool, Vec<String>)> = analysis.distances.iter().map(row).collect();
    captioned(
        "Distances (m) exceeded whether the slope fails or not: stable realisations count as 0",
        &table(
            &[
                "exceeded with",
                "read off all",
                "their interval",
                "upper bound",
                "best family and share that fails",
            ],
            &rows,
        ),
    )
}

fn every_way(distance: &Distance) -> Vec<String> {
    let fitted = |show: &dyn Fn(&Sensitivity) -> String| distance.fitted.as_ref().map_or_else(dash, show);
    vec![
        percent(distance.probability),
        distance.beyond.map_or_else(dash, |n| n.to_string()),
        distance.empirical.distance_m.map_or_else(dash, metres),
        distance.empirical.interval_m.map_or_else(dash, |i| interval(i, metres)),
        distance.empirical.upper_bound_m.map_or_else(dash, metres),
        fitted(&|f| metres(f.best_m)),
        fitted(&|f| f.interval_m.map_or_else(dash, |i| interval(i, metres))),
        fitted(&|f| interval(f.families_m, metres)),
        fitted(&|f| interval(f.supported_m, metres)),
    ]
}

/// The distances by every family, so that their spread is seen.
fn by_family(analysis: &Analysis) -> String {
    let families: Vec<_> = analysis.families.iter().filter(|f| f.method == Method::Likelihood).collect();
    let Some(best) = families.iter().find(|f| f.best) else { return String::new() };
    let rows: Vec<(bool, Vec<String>)> = families
        .iter()
        .map(|family| {
            let mut cells = vec![family.family.name().to_owned(), significant(family.aic - best.aic, 3)];
            for (place, probability) in PROBABILITIES.iter().enumerate() {
                cells.push(metres(family.distance_m(*probability)));
                let found = family.intervals_m.get(place).copied().flatten();
                cells.push(found.map_or_else(dash, |i| interval(i, metres)));
            }
            (family.best, cells)
        })
        .collect();
    let header = [
        "family",
        "AIC over the best",
        "10 % (m)",
        "interval",
        "1 % (m)",
        "interval",
        "0.1 % (m)",
        "interval",
    ];
    captioned(
        &format!(
            "Sensitivity to the family: distances by each, fitted by maximum likelihood, with {} bootstrap intervals from {} \
             replicates",
            percent(analysis.estimate.confidence),
            families::replicates(analysis.samples_m.len())
        ),
        &table(&header, &rows),
    )
}
