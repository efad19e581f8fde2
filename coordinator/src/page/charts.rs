//! The page's two charts, and what they say in a sentence.

use super::snapshot::{Curves, ExceedancePoint, MeanPoint};
use crate::picture::axes::Axis;
use crate::picture::chart::{Chart, Layer, Legend, SERIES, Series};
use crate::picture::{self, INK};
use crate::report::html::figure;

/// Fewest samples of a chart.
const FEWEST: u64 = 2;

/// The exceedance curve as a figure; `p_failure` is where its unconditional form begins.
pub(super) fn exceedance(curves: &Curves, p_failure: Option<f64>, confidence: f64) -> String {
    let points = &curves.exceedance;
    let (Some(last), true) = (points.last(), points.len() > 1) else {
        return nothing_yet();
    };
    let interval = format!("{:.0} % interval", 100.0 * confidence);
    let chart = Chart {
        x: Axis::linear("runout (m)", 0.0, 1.05 * last.distance_m),
        y: Axis::linear("probability of exceedance", 0.0, 1.0).percent(),
        series: vec![
            Series::new(Layer::Band(band(points)), SERIES[0], &interval),
            Series::new(Layer::Line(steps(1.0, points, |p| p.conditional)), SERIES[0], "given failure"),
            Series::new(
                Layer::Dashed(steps(p_failure.unwrap_or(1.0), points, |p| p.unconditional)),
                INK,
                "stable included",
            ),
        ],
        legend: Legend::UpperRight,
    };
    let at = |share: f64| points.iter().find(|p| p.conditional <= share).unwrap_or(last).distance_m;
    let caption = format!(
        "Share of the slides that run further than a distance, with its pointwise {interval}. So far half of them run \
         further than {:.2} m, one in ten further than {:.2} m; the longest ran {:.2} m.",
        at(0.5),
        at(0.1),
        last.distance_m
    );
    drawn(&chart, &caption)
}

/// The mean after each sample as a figure.
pub(super) fn mean(curves: &Curves, confidence: f64) -> String {
    let points = &curves.mean;
    let Some(last) = points.last().filter(|p| p.samples >= FEWEST) else { return nothing_yet() };
    // The first samples' intervals are huge: the later nine tenths say what is shown.
    let settled = points.iter().skip(points.len() / 10);
    let ends = |p: &MeanPoint| p.interval_m.unwrap_or([p.mean_m; 2]);
    let (low, high) =
        settled.fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(ends(p)[0]), high.max(ends(p)[1])));
    let margin = 0.08 * (high - low).max(1e-9);
    let interval = format!("{:.0} % interval", 100.0 * confidence);
    let line: Vec<(f64, f64)> = points.iter().map(|p| (p.samples as f64, p.mean_m)).collect();
    let band = points.iter().filter_map(|p| p.interval_m.map(|[l, h]| (p.samples as f64, l, h))).collect();
    let chart = Chart {
        // A few samples would have fractions on the axis.
        x: Axis::linear("slides", 0.0, last.samples.max(10) as f64),
        y: Axis::linear("mean runout (m)", (low - margin).max(0.0), high + margin),
        series: vec![
            Series::new(Layer::Band(band), SERIES[0], &interval),
            Series::new(Layer::Line(line), SERIES[0], "mean"),
        ],
        legend: Legend::Above,
    };
    let [low, high] = ends(last);
    let caption = format!(
        "Mean runout after each slide, in the order of the indices, with its {interval}: {:.3} m ({low:.3} to {high:.3} m) \
         after {} slides.",
        last.mean_m, last.samples
    );
    drawn(&chart, &caption)
}

fn drawn(chart: &Chart, caption: &str) -> String {
    match picture::svg(chart) {
        Ok(svg) => figure(&svg, caption),
        Err(error) => format!("<p>{}</p>", crate::report::html::escape(&error.to_string())),
    }
}

fn nothing_yet() -> String {
    "<p class=\"empty\">There is a curve once two slopes have failed.</p>".to_owned()
}

/// The corners of a falling step function that is `start` before the first point.
fn steps(start: f64, points: &[ExceedancePoint], value: impl Fn(&ExceedancePoint) -> f64) -> Vec<(f64, f64)> {
    let mut corners = vec![(0.0, start)];
    let mut before = start;
    for point in points {
        corners.extend([(point.distance_m, before), (point.distance_m, value(point))]);
        before = value(point);
    }
    corners
}

/// The corners of the band, whose ends hold from each point to the next.
fn band(points: &[ExceedancePoint]) -> Vec<(f64, f64, f64)> {
    let mut corners = vec![(0.0, 1.0, 1.0)];
    let mut before = [1.0, 1.0];
    for point in points {
        let [low, high] = point.interval;
        corners.extend([(point.distance_m, before[0], before[1]), (point.distance_m, low, high)]);
        before = [low, high];
    }
    corners
}
