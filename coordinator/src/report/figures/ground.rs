//! The hazard along the ground: probability of being reached or lost, deposit depths, speeds; and how much moved.

use super::super::analysis::Analysis;
use super::super::hazard::{Hazard, Quantiles};
use super::super::reach::Probability;
use super::percent_interval;
use super::runout::{counts, edges};
use crate::picture::axes::Axis;
use crate::picture::chart::{Chart, Layer, Legend, SERIES, Series, Stack};
use crate::picture::{GREY, INK};
use runout_core::campaign::Model;
use runout_core::slope;

/// Places along the ground at which a probability is drawn.
const PLACES: usize = 240;
/// Room beyond the farthest front, as a share of the way there.
const BEYOND: f64 = 1.12;

/// The profile along the ground: the section, probabilities and, where samples were replayed, depths and speeds.
pub(super) fn profile(model: &Model, analysis: &Analysis, hazard: Option<&Hazard>) -> Stack {
    let (left, right) = ends(model, analysis);
    let x = Axis::linear("horizontal distance from the toe (m)", left, right);
    let mut charts = vec![section(model, hazard, x.clone()), probability(model, analysis, x.clone())];
    if let Some(hazard) = hazard {
        charts.push(quantity(analysis, hazard, &hazard.depth_m, x.clone(), "deposit depth (m)"));
        charts.push(quantity(analysis, hazard, &hazard.speed_m_s, x, "highest speed (m/s)"));
    }
    Stack(charts)
}

/// From behind the largest retreat to beyond the farthest front, m.
fn ends(model: &Model, analysis: &Analysis) -> (f64, f64) {
    let edge = slope::crest_edge_x(&model.slope);
    let left = edge - (BEYOND * analysis.reach.largest_retreat_m()).max(0.25 * -edge).max(1.0);
    let right = (BEYOND * analysis.reach.farthest_m()).max(0.25 * slope::height_m(&model.slope));
    (left.max(slope::rear_x(&model.slope)), right.min(model.slope.runout_plain_m))
}

/// The ground before, and the deposits' surfaces on it.
fn section(model: &Model, hazard: Option<&Hazard>, x: Axis) -> Chart {
    let ground: Vec<(f64, f64)> =
        slope::surface_between(&model.slope, x.low, x.high).into_iter().map(|[x, y]| (x, y)).collect();
    let on_ground = |hazard: &Hazard, depths: &[f64]| -> Vec<(f64, f64)> {
        let top = |(x, depth): (&f64, &f64)| (*x, slope::ground_surface_y(&model.slope, *x) + depth);
        hazard.x_m.iter().zip(depths).map(top).collect()
    };
    let span = |(low, high): (f64, f64), y: f64| (low.min(y), high.max(y));
    let (low, high) = ground.iter().map(|p| p.1).fold((f64::INFINITY, f64::NEG_INFINITY), span);
    let mut series = vec![Series::new(Layer::Line(ground), INK, "ground before")];
    if let Some(hazard) = hazard {
        let depths = &hazard.depth_m;
        series.push(Series::new(Layer::Line(on_ground(hazard, &depths.median)), SERIES[0], "median deposit"));
        series.push(Series::new(
            Layer::Line(on_ground(hazard, &depths.one_in_ten)),
            SERIES[1],
            "exceeded in one of ten",
        ));
    }
    let margin = 0.08 * (high - low);
    Chart { x, y: Axis::linear("elevation (m)", low - margin, high + margin), series, legend: Legend::Above }
}

/// Probability of being reached in front of the toe and of being lost behind the crest's edge.
fn probability(model: &Model, analysis: &Analysis, x: Axis) -> Chart {
    let edge = slope::crest_edge_x(&model.slope);
    let places =
        |from: f64, to: f64| (0..=PLACES).map(move |k| from + (to - from) * k as f64 / PLACES as f64);
    let known = |found: Vec<(f64, Option<Probability>)>| -> Vec<(f64, Probability)> {
        found.into_iter().filter_map(|(x, p)| p.map(|p| (x, p))).collect()
    };
    let reach = &analysis.reach;
    let front = known(places(0.0, x.high).map(|x| (x, reach.in_front(x))).collect());
    let rear = known(places(x.low, edge).map(|x| (x, reach.behind(edge - x))).collect());
    let band = |points: &[(f64, Probability)]| {
        Layer::Band(points.iter().map(|(x, p)| (*x, p.interval[0], p.interval[1])).collect())
    };
    let line =
        |points: &[(f64, Probability)]| Layer::Line(points.iter().map(|(x, p)| (*x, p.share)).collect());
    let top = front.iter().chain(&rear).map(|(_, p)| p.interval[1]).fold(0.0, f64::max);
    let series = vec![
        Series::new(band(&rear), SERIES[3], ""),
        Series::new(line(&rear), SERIES[3], "ground lost behind the crest"),
        Series::new(band(&front), SERIES[0], percent_interval(analysis)),
        Series::new(line(&front), SERIES[0], "reached in front of the toe"),
    ];
    Chart {
        x,
        y: Axis::linear("probability", 0.0, (1.1 * top).clamp(0.01, 1.0)).percent(),
        series,
        legend: Legend::Above,
    }
}

/// Quantiles of one quantity along the ground, given failure.
fn quantity(analysis: &Analysis, hazard: &Hazard, quantiles: &Quantiles, x: Axis, label: &str) -> Chart {
    let along = |values: &[f64]| -> Vec<(f64, f64)> {
        hazard.x_m.iter().copied().zip(values.iter().copied()).collect()
    };
    let top = quantiles.largest.iter().copied().fold(0.0, f64::max);
    let mut series = Vec::new();
    if let Some(intervals) = &quantiles.median_interval {
        let band = hazard.x_m.iter().zip(intervals).map(|(x, [low, high])| (*x, *low, *high)).collect();
        let name = format!("median's {}", percent_interval(analysis));
        series.push(Series::new(Layer::Band(band), SERIES[0], name));
    }
    series.push(Series::new(Layer::Line(along(&quantiles.median)), SERIES[0], "median"));
    series.push(Series::new(Layer::Line(along(&quantiles.one_in_ten)), SERIES[1], "exceeded in one of ten"));
    series.push(Series::new(Layer::Dashed(along(&quantiles.largest)), GREY, "largest"));
    Chart {
        x,
        y: Axis::linear(label, 0.0, if top > 0.0 { 1.08 * top } else { 1.0 }),
        series,
        legend: Legend::Above,
    }
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
