//! The hazard along the ground: probability of being reached or lost, deposit depths, speeds; and how much moved.

use super::super::analysis::Analysis;
use super::super::hazard::{Hazard, Quantiles};
use super::super::reach::Probability;
use super::percent_interval;
use super::runout::{counts, edges};
use crate::picture::GREY;
use crate::picture::axes::Axis;
use crate::picture::chart::{Chart, Layer, Legend, SERIES, Series, Stack};
use runout_core::campaign::Model;
use runout_core::estimate::interval::Interval;
use runout_core::slope;

/// Places along the ground at which a probability is drawn.
const PLACES: usize = 240;
/// Room beyond the farthest front, as a share of the way there.
const BEYOND: f64 = 1.12;

/// The profile in front of the toe: probabilities and, where samples have profiles, depths and speeds.
pub(super) fn profile(model: &Model, analysis: &Analysis, hazard: Option<&Hazard>) -> Stack {
    let farthest = BEYOND * analysis.reach.farthest_m();
    let right = farthest.max(0.25 * slope::height_m(&model.slope)).min(model.slope.runout_plain_m);
    let x = Axis::linear("horizontal distance in front of the toe (m)", 0.0, right);
    let reach = |x| analysis.reach.in_front(x);
    let mut charts = vec![probability(analysis, x.clone(), reach, "probability of being reached")];
    if let Some(hazard) = hazard {
        if !hazard.deeper.is_empty() {
            charts.push(deposits(analysis, hazard, x.clone()));
        }
        charts.push(quantity(analysis, hazard, &hazard.depth_m, x.clone(), "deposit depth (m)"));
        charts.push(quantity(analysis, hazard, &hazard.speed_m_s, x, "highest speed (m/s)"));
    }
    Stack(charts)
}

/// The probability that the ground behind the crest's edge is lost.
pub(super) fn crest(model: &Model, analysis: &Analysis) -> Chart {
    let behind = slope::crest_edge_x(&model.slope) - slope::rear_x(&model.slope);
    let right = (BEYOND * analysis.reach.largest_retreat_m()).max(0.1 * behind).min(behind);
    let x = Axis::linear("distance behind the crest's edge (m)", 0.0, right);
    probability(analysis, x, |x| analysis.reach.behind(x), "probability of being lost")
}

/// A probability with its interval at places along the axis.
fn probability(analysis: &Analysis, x: Axis, at: impl Fn(f64) -> Option<Probability>, label: &str) -> Chart {
    let place = |k: usize| x.low + (x.high - x.low) * k as f64 / PLACES as f64;
    let points: Vec<(f64, Probability)> =
        (0..=PLACES).map(place).filter_map(|x| at(x).map(|p| (x, p))).collect();
    let top = points.iter().map(|(_, p)| p.interval[1]).fold(0.0, f64::max);
    let band = points.iter().map(|(x, p)| (*x, p.interval[0], p.interval[1])).collect();
    let line = points.iter().map(|(x, p)| (*x, p.share)).collect();
    Chart {
        x,
        y: Axis::linear(label, 0.0, (1.1 * top).clamp(0.01, 1.0)).percent(),
        series: vec![
            Series::new(Layer::Band(band), SERIES[0], percent_interval(analysis)),
            Series::new(Layer::Line(line), SERIES[0], "share of all realisations"),
        ],
        legend: Legend::Above,
    }
}

/// How probable deposits of some depths are, whether the slope fails or not: constant over each column.
fn deposits(analysis: &Analysis, hazard: &Hazard, x: Axis) -> Chart {
    let top = hazard.deeper.iter().flat_map(|d| &d.probabilities).map(|p| p.interval[1]).fold(0.0, f64::max);
    let mut series = Vec::new();
    for (deeper, colour) in hazard.deeper.iter().zip([SERIES[2], SERIES[3]]) {
        let ends: Vec<Interval> = deeper.probabilities.iter().map(|p| p.interval).collect();
        let shares: Vec<f64> = deeper.probabilities.iter().map(|p| p.share).collect();
        let name = format!("deeper than {} m", deeper.depth_m);
        series.push(Series::new(Layer::Band(band(hazard, &ends)), colour, percent_interval(analysis)));
        series.push(Series::new(Layer::Line(steps(hazard, &shares)), colour, name));
    }
    Chart {
        x,
        y: Axis::linear("probability of a deposit", 0.0, (1.1 * top).clamp(0.01, 1.0)).percent(),
        series,
        legend: Legend::Above,
    }
}

/// Quantiles of one quantity along the ground, given failure: constant over each column.
fn quantity(analysis: &Analysis, hazard: &Hazard, quantiles: &Quantiles, x: Axis, label: &str) -> Chart {
    let top = quantiles.largest.iter().copied().fold(0.0, f64::max);
    let shown =
        [(&quantiles.median, SERIES[0], "median"), (&quantiles.one_in_ten, SERIES[1], "exceeded by 1 in 10")];
    let mut series = Vec::new();
    for (quantile, colour, name) in shown {
        if let Some(intervals) = &quantile.intervals {
            series.push(Series::new(
                Layer::Band(band(hazard, intervals)),
                colour,
                percent_interval(analysis),
            ));
        }
        series.push(Series::new(Layer::Line(steps(hazard, &quantile.values)), colour, name));
    }
    series.push(Series::new(Layer::Dashed(steps(hazard, &quantiles.largest)), GREY, "largest"));
    Chart {
        x,
        y: Axis::linear(label, 0.0, if top > 0.0 { 1.08 * top } else { 1.0 }),
        series,
        legend: Legend::Above,
    }
}

/// A line that is constant over each column.
fn steps(hazard: &Hazard, values: &[f64]) -> Vec<(f64, f64)> {
    let half = 0.5 * hazard.column_m;
    let ends = |(x, value): (&f64, &f64)| [((x - half).max(0.0), *value), (x + half, *value)];
    hazard.x_m.iter().zip(values).flat_map(ends).collect()
}

/// A band that is constant over each column.
fn band(hazard: &Hazard, intervals: &[Interval]) -> Vec<(f64, f64, f64)> {
    let half = 0.5 * hazard.column_m;
    let ends =
        |(x, [low, high]): (&f64, &Interval)| [((x - half).max(0.0), *low, *high), (x + half, *low, *high)];
    hazard.x_m.iter().zip(intervals).flat_map(ends).collect()
}

/// A histogram of counts.
pub(super) fn amounts(values: &[f64], label: &str) -> Chart {
    let largest = values.iter().copied().fold(0.0, f64::max);
    let edges = edges(values, largest);
    let heights: Vec<f64> = counts(values, &edges).into_iter().map(|count| count as f64).collect();
    let top = heights.iter().copied().fold(1.0, f64::max);
    let right = edges[edges.len() - 1];
    Chart {
        x: Axis::linear(label, 0.0, right),
        y: Axis::linear("samples", 0.0, 1.08 * top),
        series: vec![Series::new(Layer::Bars { edges, heights }, SERIES[5], "")],
        legend: Legend::UpperRight,
    }
}
