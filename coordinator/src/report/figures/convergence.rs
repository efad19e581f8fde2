//! Charts of the outcomes in the order of their indices, and of what they settle to.

use super::super::analysis::{Analysis, ConvergencePoint};
use super::percent_interval;
use crate::picture::GREY;
use crate::picture::axes::Axis;
use crate::picture::chart::{Chart, Layer, Legend, SERIES, Series, Stack};
use runout_core::estimate::interval::Interval;

/// Dots of a chart; more would be one cloud.
const MOST_DOTS: usize = 4_000;
/// Room below zero for what stood, as a share of the longest runout.
const BELOW: f64 = 0.12;

/// Every sample by its realisation's index, with the running mean (the paper's Fig. 8a); what stood lies below zero.
pub(super) fn outcomes(analysis: &Analysis) -> Stack {
    let every = |count: usize| count.div_ceil(MOST_DOTS).max(1);
    let dots = analysis.indices.iter().zip(&analysis.samples_m).step_by(every(analysis.samples_m.len()));
    let dots = dots.map(|(index, runout_m)| (*index as f64, *runout_m)).collect();
    let points = &analysis.convergence;
    let at = |p: &ConvergencePoint| (p.realisations - 1) as f64;
    let band = points.iter().filter_map(|p| p.mean_interval_m.map(|[low, high]| (at(p), low.max(0.0), high)));
    let largest = analysis.samples_m.iter().copied().fold(0.0, f64::max);
    let last = analysis.estimate.realisations.saturating_sub(1).max(1);
    let mut series = vec![
        Series::new(Layer::Dots(dots), GREY, "samples"),
        Series::new(Layer::Band(band.collect()), SERIES[1], percent_interval(analysis)),
        Series::new(
            Layer::Line(points.iter().map(|p| (at(p), p.mean_m)).collect()),
            SERIES[1],
            "running mean",
        ),
    ];
    let below = if analysis.stable.is_empty() { 0.0 } else { BELOW * largest };
    if below > 0.0 {
        let stable = analysis.stable.iter().step_by(every(analysis.stable.len()));
        let stable = stable.map(|index| (*index as f64, -0.5 * below)).collect();
        series.push(Series::new(Layer::Dots(stable), SERIES[0], "stable"));
    }
    let chart = Chart {
        x: Axis::linear("index of the realisation", 0.0, last as f64),
        y: Axis::linear("runout (m)", -below, 1.05 * largest),
        series,
        legend: Legend::Above,
    };
    Stack(vec![chart])
}

/// Running mean, larger.
pub(super) fn mean(analysis: &Analysis) -> Chart {
    let line = analysis.convergence.iter().map(|p| (p.samples as f64, p.mean_m, p.mean_interval_m));
    settling(analysis, line.collect(), "samples", "mean runout (m)")
}

/// Running variance.
pub(super) fn variance(analysis: &Analysis) -> Chart {
    let line = analysis.convergence.iter().map(|p| (p.samples as f64, p.variance_m2, p.variance_interval_m2));
    settling(analysis, line.collect(), "samples", "variance of runout (m\u{b2})")
}

/// Running coefficient of variation.
pub(super) fn cov(analysis: &Analysis) -> Chart {
    let line = analysis.convergence.iter().map(|p| (p.samples as f64, p.cov, None));
    settling(analysis, line.collect(), "samples", "coefficient of variation")
}

/// Running probability of failure.
pub(super) fn failure(analysis: &Analysis) -> Chart {
    let line = analysis.failure.iter().map(|p| (p.realisations as f64, p.probability, Some(p.interval)));
    let chart = settling(analysis, line.collect(), "realisations", "probability of failure");
    Chart { y: chart.y.percent(), ..chart }
}

/// A running value with its interval and its last value; `points`: abscissa, value, interval.
fn settling(analysis: &Analysis, points: Vec<(f64, f64, Option<Interval>)>, x: &str, y: &str) -> Chart {
    let line: Vec<(f64, f64)> = points.iter().map(|p| (p.0, p.1)).collect();
    let band: Vec<(f64, f64, f64)> =
        points.iter().filter_map(|p| p.2.map(|[low, high]| (p.0, low.max(0.0), high))).collect();
    let (end, last) = line.last().copied().unwrap_or((1.0, 1.0));
    // The first samples' intervals are huge: the later nine tenths say what is shown.
    let settled = band.iter().skip(band.len() / 10).map(|b| (b.1, b.2));
    let settled = settled.chain(line.iter().skip(line.len() / 10).map(|p| (p.1, p.1)));
    let (low, high) = settled.fold((last, last), |(l, h), (a, b)| (f64::min(l, a), f64::max(h, b)));
    let margin = 0.08 * (high - low).max(1e-9);
    let mut series = Vec::new();
    if !band.is_empty() {
        series.push(Series::new(Layer::Band(band), SERIES[0], percent_interval(analysis)));
    }
    series.push(Series::new(Layer::Line(line), SERIES[0], "so far"));
    series.push(Series::new(Layer::Dashed(vec![(0.0, last), (end, last)]), GREY, "last value"));
    Chart {
        x: Axis::linear(x, 0.0, end),
        y: Axis::linear(y, (low - margin).max(0.0), high + margin),
        series,
        legend: Legend::Above,
    }
}
