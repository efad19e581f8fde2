//! Charts of the site data: each property's distribution function with the families fitted to it, and each pair's tests
//! beside draws from the fitted distribution.

use super::super::Material;
use super::{curve, family_colour};
use crate::gallery::property_label;
use crate::picture::axes::{Axis, round_ticks};
use crate::picture::chart::{Chart, Layer, Legend, SERIES, Series};
use crate::picture::{GREY, INK};
use rand::Rng;
use runout_core::copula::Sampler;
use runout_core::fit::MarginalFit;
use runout_core::marginal::Marginal;
use runout_core::seed::{self, Purpose};
use runout_core::site::Property;
use runout_core::special::normal_quantile;

/// Draws in a chart of a pair.
const DRAWS: usize = 600;
/// Share of the distribution beyond the drawn range, on either side.
const OUTSIDE: f64 = 0.002;

/// The tests' distribution function and the families'; the chosen one last.
pub(super) fn marginal(property: Property, fit: &MarginalFit, measured: Option<&[f64]>) -> Chart {
    let (low, high) = range(&fit.best, measured);
    let mut series = Vec::new();
    if let Some(values) = measured {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let mut corners = vec![(low, 0.0)];
        for (i, x) in sorted.iter().enumerate() {
            let n = sorted.len() as f64;
            corners.extend([(*x, i as f64 / n), (*x, (i + 1) as f64 / n)]);
        }
        corners.push((high, 1.0));
        series.push(Series::new(Layer::Line(corners), GREY, "tests"));
    }
    let line = |m: &Marginal| curve(low, high, |x| m.cdf(x));
    let others = fit.candidates.iter().filter_map(|c| c.marginal()).filter(|m| *m != fit.best);
    for other in others {
        series.push(Series::new(
            Layer::Dashed(line(&other)),
            family_colour(other.family),
            other.family.name(),
        ));
    }
    let chosen = format!("{}, chosen", fit.best.family.name());
    series.push(Series::new(Layer::Line(line(&fit.best)), family_colour(fit.best.family), chosen));
    Chart {
        x: Axis::linear(property_label(property), low, high),
        y: Axis::linear("cumulative probability", 0.0, 1.0).percent(),
        series,
        legend: Legend::Above,
    }
}

/// Two properties' tests, and draws from the chosen marginals and copula.
pub(super) fn pair(material: &Material<'_>, i: usize, j: usize) -> Option<Chart> {
    let properties = &material.campaign.random;
    let measured = |k: usize| {
        let site = material.site?;
        site.properties.iter().position(|p| *p == properties[k]).map(|column| &site.values[column])
    };
    let draws = draws(material)?;
    let best = |k: usize| &material.fit.marginals[properties[k].name()].best;
    let axis = |k: usize| {
        let (low, high) = range(best(k), measured(k).map(Vec::as_slice));
        Axis::linear(property_label(properties[k]), low, high)
    };
    let points = |x: &[f64], y: &[f64]| x.iter().copied().zip(y.iter().copied()).collect();
    let mut series =
        vec![Series::new(Layer::Dots(points(&draws[i], &draws[j])), SERIES[5], "drawn from the fit")];
    if let Some((x, y)) = measured(i).zip(measured(j)) {
        series.push(Series::new(Layer::Marks(points(x, y)), INK, "tests"));
    }
    Some(Chart { x: axis(i), y: axis(j), series, legend: Legend::Above })
}

/// Values of each property in independent soils: the copula's uniforms through the marginals.
fn draws(material: &Material<'_>) -> Option<Vec<Vec<f64>>> {
    let spec = material.spec;
    let sampler = Sampler::new(&spec.copula).ok()?;
    let mut stream = seed::stream(spec.seed, 0, Purpose::ReportScatter);
    let mut values = vec![Vec::with_capacity(DRAWS); spec.random.len()];
    for _ in 0..DRAWS {
        // The middle of 2^52 steps: never 0 or 1.
        let mut normal = || normal_quantile(((stream.next_u64() >> 12) as f64 + 0.5) / (1u64 << 52) as f64);
        let mut soil: Vec<[f64; 1]> = spec.random.iter().map(|_| [normal()]).collect();
        let mixing = sampler.mixing(&mut stream);
        let mut fields: Vec<&mut [f64]> = soil.iter_mut().map(|v| v.as_mut_slice()).collect();
        sampler.uniforms(&mut fields, mixing);
        for ((column, random), [uniform]) in values.iter_mut().zip(&spec.random).zip(&soil) {
            column.push(random.marginal.quantile(*uniform));
        }
    }
    Some(values)
}

/// Where the chart ends: what the distribution leaves out on either side, and the tests.
fn range(best: &Marginal, measured: Option<&[f64]>) -> (f64, f64) {
    let ends = (best.quantile(OUTSIDE), best.quantile(1.0 - OUTSIDE));
    let tests = measured.unwrap_or_default().iter().copied();
    let (low, high) = tests.fold(ends, |(l, h), v| (l.min(v), h.max(v)));
    // From zero unless that would waste most of the chart.
    let low = if low < 0.5 * high { 0.0 } else { low };
    let step = round_ticks(low, high, 8);
    let step = step.get(1).map_or(0.0, |second| second - step[0]);
    if step > 0.0 { ((low / step).floor() * step, (high / step).ceil() * step) } else { (low, high) }
}
