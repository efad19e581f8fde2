//! Goodness of fit of the copulas: Cramer-von Mises statistics with p-values by parametric bootstrap.
//!
//! Two properties: S_n, the squared distance between the empirical copula and the fitted one, summed over the tests
//! (Genest, Remillard and Beaudoin 2009, Eq. 2). Three and more: the same distance after Rosenblatt's transform, between
//! the empirical distribution and independence (their S_n^(C)), because the elliptical distribution functions have no
//! closed form there.
//!
//! The bootstrap imposes the ties of the data on each of its samples; without that, ties alone make p-values too small
//! (for the Elkhorn River data 0.03 to 0.06 in place of 0.18 to 0.27). Degrees of freedom of a Student t copula stay as fitted,
//! as in R's `gofCopula`; everything else is refitted to each sample by the recipe of the fit, always on average ranks.

use super::copulas::{Given, Sample, by_recipe};
use super::ranks::{average, pseudo_observations};
use super::{Fit, column};
use crate::campaign::Recipe;
use crate::copula::{Copula, Family, Sampler, cholesky};
use crate::seed::{Purpose, stream};
use crate::site::SiteData;
use crate::special::{StudentT, normal_cdf, normal_quantile, standard_normal};
use serde::Serialize;

/// Replicates that know a p-value of 0.05 to 0.015 and cost less than a second for some tens of tests.
pub const GOODNESS_REPLICATES: usize = 200;

/// How well one copula family describes the data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GoodnessOfFit {
    /// Family.
    pub family: Family,
    /// Cramer-von Mises statistic of the average-rank pseudo-observations.
    pub cramer_von_mises: f64,
    /// Share of bootstrap samples, from the fitted copula, that lie at least as far from their own fit:
    /// (1/2 + their number) / (replicates + 1).
    pub p_value: f64,
}

/// Tests every fitted copula candidate of `fit` against `data`, with `replicates` bootstrap samples each.
///
/// Empty where the random properties were not measured together. The same `seed` gives the same result. The paper reports
/// no such test; for its recipe this is the test of its estimates.
pub fn goodness_of_fit(fit: &Fit, data: &SiteData, replicates: usize, seed: u64) -> Vec<GoodnessOfFit> {
    let columns: Option<Vec<&[f64]>> = fit.properties().into_iter().map(|p| column(data, p)).collect();
    let Some(columns) = columns.filter(|columns| columns.len() > 1) else {
        return Vec::new();
    };
    let observed = pseudo_observations(&columns, Recipe::Likelihood);
    fit.copula
        .candidates
        .iter()
        .filter_map(|candidate| test(&candidate.copula()?, &observed, fit.recipe, replicates, seed))
        .collect()
}

fn test(
    copula: &Copula,
    observed: &[Vec<f64>],
    recipe: Recipe,
    replicates: usize,
    seed: u64,
) -> Option<GoodnessOfFit> {
    let sampler = Sampler::new(copula).ok()?;
    let family = copula.family();
    let statistic = distance(copula, observed)?;
    // A stream per family: their results do not depend on which others are tested.
    let place = Family::ALL.iter().position(|&f| f == family)? as u64;
    let mut rng = stream(seed, place, Purpose::GoodnessOfFit);
    let ties: Vec<Vec<f64>> = observed.iter().map(|column| sorted(column)).collect();
    let rows = observed[0].len();
    let (mut farther, mut made) = (0_usize, 0_usize);
    for _ in 0..replicates {
        let mut drawn = vec![vec![0.0; rows]; observed.len()];
        for row in 0..rows {
            let mixing = sampler.mixing(&mut rng);
            drawn.iter_mut().for_each(|column| column[row] = standard_normal(&mut rng));
            let mut cells: Vec<&mut [f64]> = drawn.iter_mut().map(|c| &mut c[row..=row]).collect();
            sampler.uniforms(&mut cells, mixing);
        }
        let uniforms: Vec<Vec<f64>> = drawn.iter().zip(&ties).map(|(c, ties)| impose_ties(c, ties)).collect();
        // A replicate whose own fit does not exist cannot be compared.
        if let Some(value) = refit(copula, &uniforms, recipe).and_then(|own| distance(&own, &uniforms)) {
            made += 1;
            farther += usize::from(value >= statistic);
        }
    }
    let p_value = (farther as f64 + 0.5) / (made as f64 + 1.0);
    Some(GoodnessOfFit { family, cramer_von_mises: statistic, p_value })
}

/// Pseudo-observations with the ties of the data: the k-th smallest value gets the k-th smallest observed one.
fn impose_ties(drawn: &[f64], ties: &[f64]) -> Vec<f64> {
    // Drawn values are distinct, so that their average ranks are whole numbers.
    average(drawn).into_iter().map(|rank| ties[rank as usize - 1]).collect()
}

fn refit(copula: &Copula, uniforms: &[Vec<f64>], recipe: Recipe) -> Option<Copula> {
    let columns: Vec<&[f64]> = uniforms.iter().map(Vec::as_slice).collect();
    let sample = Sample { columns: &columns, uniforms };
    let degrees_of_freedom = match copula {
        Copula::StudentT { degrees_of_freedom, .. } => Some(*degrees_of_freedom),
        _ => None,
    };
    by_recipe(copula.family(), sample, Given { degrees_of_freedom, ..Given::default() }, recipe).ok()
}

/// The Cramer-von Mises statistic of pseudo-observations, one vector a property.
fn distance(copula: &Copula, uniforms: &[Vec<f64>]) -> Option<f64> {
    if let [u, v] = uniforms {
        return u.iter().zip(v).map(|(&u, &v)| Some((u, v, copula.cdf(u, v)?))).try_fold(
            0.0,
            |sum, place| {
                let (a, b, fitted) = place?;
                let below = u.iter().zip(v).filter(|(u, v)| **u <= a && **v <= b).count();
                let gap = below as f64 / u.len() as f64 - fitted;
                Some(sum + gap * gap)
            },
        );
    }
    let rows = transformed(copula, uniforms)?;
    let n = rows.len() as f64;
    let gap = |place: &Vec<f64>| {
        let below = rows.iter().filter(|row| row.iter().zip(place).all(|(a, b)| a <= b)).count();
        let gap = below as f64 / n - place.iter().product::<f64>();
        gap * gap
    };
    Some(rows.iter().map(gap).sum())
}

/// Rosenblatt's transform of an elliptical copula, one vector a test: each property given those before it.
fn transformed(copula: &Copula, uniforms: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let (correlation, nu) = match copula {
        Copula::Gaussian { correlation } => (correlation, None),
        Copula::StudentT { correlation, degrees_of_freedom } => (correlation, Some(*degrees_of_freedom)),
        _ => return None,
    };
    let factor = cholesky(correlation)?;
    let margin = nu.map(StudentT::new);
    let score = |u: f64| margin.map_or_else(|| normal_quantile(u), |t| t.quantile(u));
    let row = |test: usize| {
        let (mut whitened, mut squares, mut out) = (Vec::new(), 0.0, Vec::new());
        for (i, weights) in factor.iter().enumerate() {
            let known: f64 = whitened.iter().zip(weights).map(|(w, l): (&f64, &f64)| w * l).sum();
            let own = (score(uniforms[i][test]) - known) / weights[i];
            out.push(match nu {
                None => normal_cdf(own),
                // Given i others, Student t with i more degrees of freedom and a scale that grows with them.
                Some(nu) => {
                    let more = nu + i as f64;
                    StudentT::new(more).cdf(own * libm::sqrt(more / (nu + squares)))
                }
            });
            squares += own * own;
            whitened.push(own);
        }
        out
    };
    Some((0..uniforms[0].len()).map(row).collect())
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}
