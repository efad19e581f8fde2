//! The report's charts.

use super::analysis::Analysis;
use super::families::{FittedFamily, Method};
use crate::picture::axes::{Axis, round_ticks};
use crate::picture::chart::{Chart, Layer, Legend, SERIES, Series};
use crate::picture::section::Section;
use crate::picture::{self, GREY, INK, PictureError};
use plotters::style::RGBColor;
use runout_core::campaign::{InitialPorePressure, Model};
use runout_core::marginal::Family;

/// Abscissae of a smooth curve: more would show the rounding to whole pixels as a tremble.
const CURVE_POINTS: usize = 96;

/// A chart as SVG with the name of its file and its caption.
#[derive(Debug, Clone)]
pub struct Figure {
    /// File name without extension.
    pub name: &'static str,
    /// Caption in plain words.
    pub caption: String,
    /// SVG document.
    pub svg: String,
}

/// The section as the campaign file gives it.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn section(model: &Model) -> Result<Figure, PictureError> {
    let mut caption = "The section before failure, to scale".to_owned();
    if !model.layers.is_empty() {
        caption.push_str("; layers by their names");
    }
    if model.water.initial_pore_pressure != InitialPorePressure::None {
        caption.push_str("; dashed: water table at the start where it is below the ground");
    }
    if model.water.free_water_level_m.is_some() {
        caption.push_str("; blue: free water");
    }
    if !model.obstacles.is_empty() {
        caption.push_str("; dark: rigid obstacles, their sides on the grid");
    }
    Ok(Figure { name: "section", caption: caption + ".", svg: picture::svg(&Section::of(model))? })
}

/// Every figure that the outcomes allow, in the order in which the page shows them.
///
/// # Errors
/// A chart that cannot be drawn.
pub fn figures(analysis: &Analysis) -> Result<Vec<Figure>, PictureError> {
    let percent = analysis.estimate.confidence * 100.0;
    let mut figures = Vec::new();
    let mut add = |name, caption: String, chart: Chart| -> Result<(), PictureError> {
        figures.push(Figure { name, caption, svg: picture::svg(&chart)? });
        Ok(())
    };
    if analysis.samples_m.len() < 2 {
        return Ok(figures);
    }
    add(
        "histogram-likelihood",
        "Histogram of the samples of runout with the four families fitted by maximum likelihood.".to_owned(),
        histogram(analysis, Method::Likelihood),
    )?;
    add(
        "histogram-moments",
        "The same histogram with the four families fitted by the method of moments, as the paper does."
            .to_owned(),
        histogram(analysis, Method::Moments),
    )?;
    add(
        "exceedance",
        format!(
            "Probability that the runout exceeds a distance: given failure (curve, with pointwise {percent:.0} % \
             interval), and with the stable realisations included (dashed)."
        ),
        exceedance(analysis, false),
    )?;
    add(
        "exceedance-log",
        format!(
            "The same on a logarithmic scale, with the fitted families (maximum likelihood), which are all that \
             speaks beyond the largest sample. Pointwise {percent:.0} % interval."
        ),
        exceedance(analysis, true),
    )?;
    add(
        "convergence-mean",
        format!("Mean runout after each sample, with its {percent:.0} % interval."),
        convergence(analysis, false),
    )?;
    add(
        "convergence-variance",
        format!("Variance of runout after each sample, with its {percent:.0} % interval."),
        convergence(analysis, true),
    )?;
    Ok(figures)
}

fn histogram(analysis: &Analysis, method: Method) -> Chart {
    let samples = &analysis.samples_m;
    let largest = samples.iter().copied().fold(0.0, f64::max);
    let edges = edges(samples, largest);
    let width = edges[1] - edges[0];
    let mut counts = vec![0u64; edges.len() - 1];
    for sample in samples {
        let bin = ((sample - edges[0]) / width) as usize;
        counts[bin.min(edges.len() - 2)] += 1;
    }
    let heights: Vec<f64> = counts.iter().map(|c| *c as f64 / (samples.len() as f64 * width)).collect();
    let right = edges[edges.len() - 1].max(1.15 * largest);
    let families: Vec<&FittedFamily> = analysis.families.iter().filter(|f| f.method == method).collect();
    let curves: Vec<Vec<(f64, f64)>> =
        families.iter().map(|f| curve(right / CURVE_POINTS as f64, right, |x| f.density(x))).collect();
    let highest = heights.iter().copied().fold(0.0, f64::max);
    // A density may rise without bound at zero: the bars say how high the chart is.
    let top = curves.iter().flatten().map(|p| p.1).fold(highest, f64::max).min(1.6 * highest);
    let mut series = vec![Series::new(Layer::Bars { edges, heights }, SERIES[5], "samples")];
    for (family, points) in families.iter().zip(curves) {
        series.push(Series::new(Layer::Line(points), colour(family.family), family.family.name()));
    }
    Chart {
        x: Axis::linear("runout (m)", 0.0, right),
        y: Axis::linear("probability density (1/m)", 0.0, 1.05 * top),
        series,
        legend: Legend::UpperRight,
    }
}

/// A family has one colour in every chart.
fn colour(family: Family) -> RGBColor {
    match family {
        Family::TruncNormal => SERIES[2],
        Family::Lognormal => SERIES[4],
        Family::TruncGumbel => SERIES[3],
        Family::Weibull => SERIES[1],
    }
}

/// Bins of round width from zero: about as wide as Freedman and Diaconis (1981) advise, 2 IQR / n^(1/3).
fn edges(samples: &[f64], largest: f64) -> Vec<f64> {
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

fn exceedance(analysis: &Analysis, logarithmic: bool) -> Chart {
    let points = &analysis.curve;
    let largest = analysis.samples_m.iter().copied().fold(0.0, f64::max);
    let samples = analysis.samples_m.len() as f64;
    // The smallest share worth a tick: a tenth of a sample, and at least the 0.1 % that is asked for.
    let low = if logarithmic { 10f64.powf((0.1 / samples).min(5e-4).log10().floor()) } else { 0.0 };
    let right = if logarithmic { 1.5 * largest } else { 1.1 * largest };
    let band = points.iter().map(|p| (p.distance_m, p.conditional_interval[0], p.conditional_interval[1]));
    let start = analysis.estimate.p_failure.unwrap_or(1.0);
    let mut series = vec![
        Series::new(
            Layer::Band(band_steps(band)),
            SERIES[0],
            format!("{:.0} % interval", analysis.estimate.confidence * 100.0),
        ),
        Series::new(
            Layer::Line(steps(1.0, points.iter().map(|p| (p.distance_m, p.conditional)))),
            SERIES[0],
            "given failure",
        ),
        Series::new(
            Layer::Dashed(steps(start, points.iter().map(|p| (p.distance_m, p.unconditional)))),
            INK,
            "stable included",
        ),
    ];
    let fitted = analysis.families.iter().filter(|f| f.method == Method::Likelihood);
    for family in fitted {
        if logarithmic || family.best {
            let points = curve(0.0, right, |x| family.exceedance(x));
            series.push(Series::new(Layer::Line(points), colour(family.family), family.family.name()));
        }
    }
    let y = match logarithmic {
        true => Axis::logarithmic("probability of exceedance", low, 1.0),
        false => Axis::linear("probability of exceedance", 0.0, 1.0),
    };
    Chart { x: Axis::linear("runout (m)", 0.0, right), y: y.percent(), series, legend: Legend::UpperRight }
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

/// The corners of a band whose ends hold from each point to the next, as the curve between them does.
fn band_steps(points: impl Iterator<Item = (f64, f64, f64)>) -> Vec<(f64, f64, f64)> {
    let mut corners = vec![(0.0, 1.0, 1.0)];
    let mut before = (1.0, 1.0);
    for (x, low, high) in points {
        corners.extend([(x, before.0, before.1), (x, low, high)]);
        before = (low, high);
    }
    corners
}

fn convergence(analysis: &Analysis, variance: bool) -> Chart {
    let points = &analysis.convergence;
    let value = |p: &super::analysis::ConvergencePoint| if variance { p.variance_m2 } else { p.mean_m };
    let interval = |p: &super::analysis::ConvergencePoint| {
        if variance { p.variance_interval_m2 } else { p.mean_interval_m }
    };
    let line: Vec<(f64, f64)> = points.iter().map(|p| (p.samples as f64, value(p))).collect();
    let band: Vec<(f64, f64, f64)> =
        points.iter().filter_map(|p| interval(p).map(|[low, high]| (p.samples as f64, low, high))).collect();
    let last = line.last().map_or(1.0, |p| p.1);
    // The first samples' intervals are huge: the later nine tenths say what is shown.
    let settled = band.iter().skip(band.len() / 10);
    let (low, high) = settled.fold((last, last), |(l, h), b| (f64::min(l, b.1), f64::max(h, b.2)));
    let (low, high) =
        line.iter().skip(line.len() / 10).fold((low, high), |(l, h), p| (l.min(p.1), h.max(p.1)));
    let margin = 0.08 * (high - low).max(1e-9);
    let ending = last_line(&line, last);
    let mut series = vec![
        Series::new(
            Layer::Band(band),
            SERIES[0],
            format!("{:.0} % interval", analysis.estimate.confidence * 100.0),
        ),
        Series::new(Layer::Line(line), SERIES[0], if variance { "variance" } else { "mean" }),
    ];
    series.push(Series::new(Layer::Dashed(ending), GREY, "last value"));
    let label = if variance { "variance of runout (m\u{b2})" } else { "mean runout (m)" };
    let samples = points.last().map_or(1.0, |p| p.samples as f64);
    Chart {
        x: Axis::linear("samples", 0.0, samples),
        y: Axis::linear(label, (low - margin).max(0.0), high + margin),
        series,
        legend: Legend::Above,
    }
}

fn last_line(line: &[(f64, f64)], last: f64) -> Vec<(f64, f64)> {
    line.last().map(|end| vec![(0.0, last), (end.0, last)]).unwrap_or_default()
}

fn curve(from: f64, to: f64, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    (0..=CURVE_POINTS)
        .map(|k| from + (to - from) * k as f64 / CURVE_POINTS as f64)
        .map(|x| (x, f(x)))
        .filter(|p| p.1.is_finite())
        .collect()
}
