//! How uncertain the fit is with so few tests: resampling whole rows (Efron 1979), percentile intervals.
//!
//! Rows are drawn with replacement, so that dependence and ties stay those of the data. With 25 tests percentile intervals
//! are a little too narrow; they show the order of the uncertainty, not its third digit.

use super::copulas::{Given, Sample, by_recipe};
use super::ranks::{kendall_tau, pseudo_observations};
use super::{Fit, column};
use crate::copula::Family;
use crate::marginal::fit::sample_moments;
use crate::seed::{Purpose, stream};
use crate::site::SiteData;
use rand_chacha::rand_core::Rng;
use serde::Serialize;
use std::collections::BTreeMap;

/// Resamples that know an interval's ends to about a tenth of its width; some hundredths of a second.
pub const UNCERTAINTY_REPLICATES: usize = 1000;

/// A 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// 2.5 % quantile of the resampled values.
    pub lower: f64,
    /// 97.5 % quantile.
    pub upper: f64,
}

/// Uncertainty of one property's moments, edge unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PropertyUncertainty {
    /// Standard error of the sample mean.
    pub mean_standard_error: f64,
    /// Interval of the mean.
    pub mean: Interval,
    /// Interval of the standard deviation.
    pub sd: Interval,
}

/// Sampling uncertainty of a fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Number of resamples.
    pub replicates: usize,
    /// By property name, as far as measured.
    pub properties: BTreeMap<&'static str, PropertyUncertainty>,
    /// Kendall's tau of each pair, in the order (0, 1), (0, 2), (1, 2); empty for one property.
    pub kendall_tau: Vec<Interval>,
    /// Parameter of the chosen two-property copula, refitted by the recipe; absent for other copulas and where fewer
    /// than half of the resamples could be fitted.
    pub theta: Option<Interval>,
}

/// Resamples the rows of `data` and refits what `fit` chose.
///
/// Properties that were not measured are left out. The same `seed` gives the same result.
pub fn uncertainty(fit: &Fit, data: &SiteData, replicates: usize, seed: u64) -> Uncertainty {
    let measured: Vec<(&'static str, &[f64])> =
        fit.properties().into_iter().filter_map(|p| Some((p.name(), column(data, p)?))).collect();
    let n = measured.len();
    let pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect();
    let mut rng = stream(seed, 0, Purpose::ReportBootstrap);
    let (mut means, mut sds) = (vec![Vec::new(); n], vec![Vec::new(); n]);
    let (mut taus, mut thetas) = (vec![Vec::new(); pairs.len()], Vec::new());
    for _ in 0..replicates {
        let rows: Vec<usize> = (0..data.tests()).map(|_| below(data.tests(), &mut rng)).collect();
        let drawn: Vec<Vec<f64>> =
            measured.iter().map(|(_, column)| rows.iter().map(|&row| column[row]).collect()).collect();
        for (place, column) in drawn.iter().enumerate() {
            let (mean, sd) = sample_moments(column);
            means[place].push(mean);
            sds[place].push(sd);
        }
        for (values, &(i, j)) in taus.iter_mut().zip(&pairs) {
            values.push(kendall_tau(&drawn[i], &drawn[j]));
        }
        thetas.extend(theta(fit, &drawn));
    }
    let property = |(place, (name, _)): (usize, &(&'static str, &[f64]))| {
        let (mean, sd) = (interval(&mut means[place]), interval(&mut sds[place]));
        let (_, mean_standard_error) = sample_moments(&means[place]);
        (*name, PropertyUncertainty { mean_standard_error, mean, sd })
    };
    Uncertainty {
        replicates,
        properties: measured.iter().enumerate().map(property).collect(),
        kendall_tau: taus.iter_mut().map(|values| interval(values)).collect(),
        theta: (2 * thetas.len() > replicates).then(|| interval(&mut thetas)),
    }
}

/// Theta of the chosen two-property family, fitted to resampled columns.
fn theta(fit: &Fit, drawn: &[Vec<f64>]) -> Option<f64> {
    let family = fit.copula.best.family();
    if drawn.len() != 2 || fit.copula.chosen_by == "given" || family == Family::StudentT {
        return None;
    }
    let columns: Vec<&[f64]> = drawn.iter().map(Vec::as_slice).collect();
    let uniforms = pseudo_observations(&columns, fit.recipe);
    let sample = Sample { columns: &columns, uniforms: &uniforms };
    by_recipe(family, sample, Given::default(), fit.recipe).ok()?.theta()
}

/// A whole number below `n`; the bias of the multiplication, n / 2^64, is far below any resampling error.
fn below(n: usize, rng: &mut impl Rng) -> usize {
    ((u128::from(rng.next_u64()) * n as u128) >> 64) as usize
}

/// The 2.5 % and 97.5 % quantiles, interpolated between order statistics.
fn interval(values: &mut [f64]) -> Interval {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * values.len().saturating_sub(1) as f64;
        let low = libm::floor(place) as usize;
        let high = (low + 1).min(values.len().saturating_sub(1));
        let pick = |k: usize| values.get(k).copied().unwrap_or(f64::NAN);
        pick(low) + (place - low as f64) * (pick(high) - pick(low))
    };
    Interval { lower: at(0.025), upper: at(0.975) }
}
