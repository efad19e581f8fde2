//! Charts of the samples of runout: histogram, distribution function, exceedance, and the deterministic run beside them.

use super::super::analysis::Analysis;
use super::super::deterministic::Deterministic;
use super::super::families::{FittedFamily, Method};
use super::{CURVE_POINTS, curve, family_colour, percent_interval};
use crate::picture::axes::{Axis, round_ticks};
use crate::picture::chart::{Chart, Layer, Legend, SERIES, Series};
use crate::picture::{GREY, INK};
use runout_core::estimate::exceedance::Point;

/// Histogram of the samples with the families fitted by one method.
pub(super) fn histogram(analysis: &Analysis, method: Method, mean_run: Option<&Deterministic>) -> Chart {
    let samples = &analysis.samples_m;
    let largest = samples.iter().copied().fold(0.0, f64::max);
    let edges = edges(samples, largest);
    let width = edges[1] - edges[0];
    let heights: Vec<f64> =
        counts(samples, &edges).iter().map(|c| *c as f64 / (samples.len() as f64 * width)).collect();
    let right = edges[edges.len() - 1].max(1.15 * largest);
    let families: Vec<&FittedFamily> = analysis.families.iter().filter(|f| f.method == method).collect();
    let curves: Vec<Vec<(f64, f64)>> =
        families.iter().map(|f| curve(right / CURVE_POINTS as f64, right, |x| f.density(x))).collect();
    let highest = heights.iter().copied().fold(0.0, f64::max);
    // A density may rise without bound at zero: the bars say how high the chart is.
    let top = curves.iter().flatten().map(|p| p.1).fold(highest, f64::max).min(1.6 * highest);
    let mut series = vec![Series::new(Layer::Bars { edges, heights }, SERIES[5], "samples")];
    for (family, points) in families.iter().zip(curves) {
        let colour = family_colour(family.family);
        series.push(Series::new(Layer::Line(points), colour, family.family.name()));
    }
    series.extend(mean_line(mean_run));
    Chart {
        x: Axis::linear("runout (m)", 0.0, right),
        y: Axis::linear("probability density (1/m)", 0.0, 1.05 * top),
        series,
        legend: Legend::Above,
    }
}

/// How many of the values lie between neighbouring edges.
pub(super) fn counts(values: &[f64], edges: &[f64]) -> Vec<u64> {
    let width = edges[1] - edges[0];
    let mut counts = vec![0u64; edges.len() - 1];
    for value in values {
        let bin = ((value - edges[0]) / width) as usize;
        counts[bin.min(edges.len() - 2)] += 1;
    }
    counts
}

/// The runout of the slope with mean properties, if it failed.
fn mean_line(mean_run: Option<&Deterministic>) -> Option<Series> {
    let runout_m = mean_run.filter(|run| run.failed)?.runout_m;
    Some(Series::new(Layer::Vertical(runout_m), INK, "mean properties"))
}

/// The samples' distribution function with the families fitted by maximum likelihood.
pub(super) fn cdf(analysis: &Analysis, mean_run: Option<&Deterministic>) -> Chart {
    let largest = analysis.samples_m.iter().copied().fold(0.0, f64::max);
    let right = 1.1 * largest;
    let mut below = vec![(0.0, 0.0)];
    let mut before = 0.0;
    for point in &analysis.curve {
        below.extend([(point.distance_m, before), (point.distance_m, 1.0 - point.conditional)]);
        before = 1.0 - point.conditional;
    }
    let mut series: Vec<Series> = vec![
        Series::new(Layer::Band(band_steps(&analysis.curve, true)), SERIES[0], percent_interval(analysis)),
        Series::new(Layer::Line(below), SERIES[0], "samples"),
    ];
    for family in analysis.families.iter().filter(|f| f.method == Method::Likelihood) {
        let line = curve(0.0, right, |x| 1.0 - family.exceedance(x));
        series.push(Series::new(Layer::Line(line), family_colour(family.family), family.family.name()));
    }
    series.extend(mean_line(mean_run));
    Chart {
        x: Axis::linear("runout (m)", 0.0, right),
        y: Axis::linear("cumulative probability", 0.0, 1.0).percent(),
        series,
        legend: Legend::Above,
    }
}

/// Bins of round width from zero: about as wide as Freedman and Diaconis (1981) advise, 2 IQR / n^(1/3).
pub(super) fn edges(samples: &[f64], largest: f64) -> Vec<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    let advised = 2.0 * (at(0.75) - at(0.25)) / (samples.len() as f64).cbrt();
    let bins = if advised > 0.0 { (largest / advised).clamp(4.0, 60.0) } else { 10.0 };
    // Rounding the width goes upwards by up to 2.5: asking for more bins centres it on what is advised.
    let ticks = round_ticks(0.0, largest, (1.5 * bins) as usize);
    let width = ticks.get(1).copied().unwrap_or(largest.max(1.0));
    let last = (largest / width).floor() as usize + 1;
    (0..=last).map(|k| k as f64 * width).collect()
}

/// The exceedance curve, given failure and with the stable realisations.
pub(super) fn exceedance(analysis: &Analysis, logarithmic: bool, mean_run: Option<&Deterministic>) -> Chart {
    let points = &analysis.curve;
    let largest = analysis.samples_m.iter().copied().fold(0.0, f64::max);
    let samples = analysis.samples_m.len() as f64;
    // The smallest share worth a tick: a tenth of a sample, and at least the 0.1 % that is asked for.
    let low = if logarithmic { 10f64.powf((0.1 / samples).min(5e-4).log10().floor()) } else { 0.0 };
    let right = if logarithmic { 1.5 * largest } else { 1.1 * largest };
    let start = analysis.estimate.p_failure.unwrap_or(1.0);
    let mut series = vec![
        Series::new(Layer::Band(band_steps(points, false)), SERIES[0], percent_interval(analysis)),
        Series::new(
            Layer::Line(steps(1.0, points.iter().map(|p| (p.distance_m, p.conditional)))),
            SERIES[0],
            "given failure",
        ),
    ];
    if analysis.estimate.stable > 0 {
        series.push(Series::new(
            Layer::Dashed(steps(start, points.iter().map(|p| (p.distance_m, p.unconditional)))),
            GREY,
            "stable included",
        ));
    }
    for family in analysis.families.iter().filter(|f| f.method == Method::Likelihood) {
        if logarithmic || family.best {
            let line = curve(0.0, right, |x| family.exceedance(x));
            series.push(Series::new(Layer::Line(line), family_colour(family.family), family.family.name()));
        }
    }
    series.extend(mean_line(mean_run));
    let y = match logarithmic {
        true => Axis::logarithmic("probability of exceedance", low, 1.0),
        false => Axis::linear("probability of exceedance", 0.0, 1.0),
    };
    Chart { x: Axis::linear("runout (m)", 0.0, right), y: y.percent(), series, legend: Legend::Above }
}

/// The corners of a falling step function that is `start` before the first point.
fn steps(start: f64, points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut corners = vec![(0.0, start)];
    let mut before = start;
    for (x, y) in points {
        corners.extend([(x, before), (x, y)]);
        before = y;
    }
    corners
}

/// The corners of the band of the conditional exceedance, or of its complement; its ends hold from each point to the next,
/// as the curve between them does.
fn band_steps(points: &[Point], complement: bool) -> Vec<(f64, f64, f64)> {
    let ends = |[low, high]: [f64; 2]| if complement { (1.0 - high, 1.0 - low) } else { (low, high) };
    let mut before = ends([1.0, 1.0]);
    let mut corners = vec![(0.0, before.0, before.1)];
    for point in points {
        let (low, high) = ends(point.conditional_interval);
        corners.extend([(point.distance_m, before.0, before.1), (point.distance_m, low, high)]);
        before = (low, high);
    }
    corners
}
