//! The copula: candidates of the data's dimension by either recipe, and the choice among them.

use super::ranks::{kendall_tau, pearson, pseudo_observations};
use super::{CopulaCandidate, CopulaFit};
use crate::campaign::{CopulaChoice, Criterion, FitSettings, Recipe};
use crate::copula::{Copula, Family, LogDensity, Scores, correlation_of_tau};
use crate::marginal::fit::{aic, bic};
use crate::numeric::{Minimum, minimise, minimise_simplex};
use crate::special::normal_quantile;

/// Parameters that the campaign file gives for a forced family.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Given<'a> {
    pub(super) theta: Option<f64>,
    pub(super) correlation: Option<&'a Vec<Vec<f64>>>,
    pub(super) degrees_of_freedom: Option<f64>,
}

/// What a copula is fitted to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample<'a> {
    /// Measured values, one slice a property.
    pub(super) columns: &'a [&'a [f64]],
    /// Pseudo-observations, one vector a property.
    pub(super) uniforms: &'a [Vec<f64>],
}

/// Degrees of freedom that are tried: the density needs more than 2 for a variance, and beyond 300 the
/// log-likelihood of some tens of tests is within about 0.002 of the Gaussian copula's.
const DEGREES_OF_FREEDOM: [f64; 2] = [2.05, 300.0];

/// Fits the copula of `dimension` properties; `measured` is absent if any of them was not measured.
pub(super) fn fit(
    measured: Option<&Vec<&[f64]>>,
    dimension: usize,
    settings: &FitSettings,
) -> Result<CopulaFit, String> {
    if dimension < 2 {
        let best = Copula::Independent { dimension };
        return Ok(CopulaFit { best, chosen_by: "only-one", candidates: Vec::new() });
    }
    let (forced, given) = match &settings.copula {
        CopulaChoice::Auto => (None, Given::default()),
        CopulaChoice::Family { family, theta, correlation, degrees_of_freedom } => {
            let correlation = correlation.as_ref();
            (Some(*family), Given { theta: *theta, correlation, degrees_of_freedom: *degrees_of_freedom })
        }
    };
    let candidates = match measured {
        Some(columns) => all_candidates(columns, forced, given, settings.recipe),
        None => Vec::new(),
    };
    let (best, chosen_by) = match forced {
        None => (best_of(&candidates, settings.criterion)?, "criterion"),
        Some(Family::Independent) => (Copula::Independent { dimension }, "given"),
        Some(family) => match given.complete(family) {
            Some(copula) => (copula, "given"),
            None => (forced_one(&candidates, family)?, "forced"),
        },
    };
    best.check().map_err(|e| e.to_string())?;
    if best.dimension() != dimension {
        return Err(format!(
            "{} joins {} properties, not {dimension}",
            best.family().name(),
            best.dimension()
        ));
    }
    Ok(CopulaFit { best, chosen_by, candidates })
}

/// The families that are tried, in the order of the paper's Table 5.
///
/// The paper's candidates for two properties are four; its likelihood counterpart adds the Student t copula.
fn families(dimension: usize, recipe: Recipe) -> &'static [Family] {
    use Family::{Frank, Gaussian, No16, Plackett, StudentT};
    match (dimension, recipe) {
        (2, Recipe::Paper) => &[Gaussian, Plackett, Frank, No16],
        (2, Recipe::Likelihood) => &[Gaussian, Plackett, Frank, No16, StudentT],
        _ => &[Gaussian, StudentT],
    }
}

fn all_candidates(
    columns: &[&[f64]],
    forced: Option<Family>,
    given: Given,
    recipe: Recipe,
) -> Vec<CopulaCandidate> {
    let uniforms = pseudo_observations(columns, recipe);
    let sample = Sample { columns, uniforms: &uniforms };
    let mut tried = families(columns.len(), recipe).to_vec();
    if let Some(family) = forced.filter(|f| *f != Family::Independent && !tried.contains(f)) {
        tried.push(family);
    }
    let own = |family| if forced == Some(family) { given } else { Given::default() };
    tried.into_iter().map(|family| candidate(family, sample, own(family), recipe)).collect()
}

fn candidate(family: Family, sample: Sample, given: Given, recipe: Recipe) -> CopulaCandidate {
    let blank = CopulaCandidate {
        family,
        theta: None,
        correlation: None,
        degrees_of_freedom: None,
        log_likelihood: None,
        aic: None,
        bic: None,
        tail_lower: None,
        tail_upper: None,
        cramer_von_mises: None,
        p_value: None,
        note: None,
    };
    let fitted = by_recipe(family, sample, given, recipe).and_then(|copula| {
        let log_likelihood = log_likelihood(&copula, sample.uniforms).map_err(|e| e.to_string())?;
        Ok((copula, log_likelihood))
    });
    let (copula, log_likelihood) = match fitted {
        Ok(fitted) => fitted,
        Err(why) => return CopulaCandidate { note: Some(why), ..blank },
    };
    let dimension = sample.columns.len();
    let free = given.free_parameters(family, dimension);
    // The strongest tails of any pair.
    let tails = (0..dimension)
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .map(|(i, j)| copula.tail_dependence(i, j))
        .fold((0.0, 0.0), |(l, u): (f64, f64), (lower, upper)| (l.max(lower), u.max(upper)));
    let (correlation, degrees_of_freedom) = match &copula {
        Copula::Gaussian { correlation } => (Some(correlation.clone()), None),
        Copula::StudentT { correlation, degrees_of_freedom } => {
            (Some(correlation.clone()), Some(*degrees_of_freedom))
        }
        _ => (None, None),
    };
    let gaussian_limit = degrees_of_freedom == Some(DEGREES_OF_FREEDOM[1]);
    let note = "the likelihood rises with the degrees of freedom up to the largest tried: the Gaussian limit";
    CopulaCandidate {
        note: gaussian_limit.then(|| note.to_owned()),
        theta: copula.theta(),
        correlation,
        degrees_of_freedom,
        log_likelihood: Some(log_likelihood),
        aic: Some(aic(log_likelihood, free)),
        bic: Some(bic(log_likelihood, free, sample.columns[0].len())),
        tail_lower: Some(tails.0),
        tail_upper: Some(tails.1),
        ..blank
    }
}

/// Log-likelihood of pseudo-observations, one vector a property.
fn log_likelihood(copula: &Copula, uniforms: &[Vec<f64>]) -> Result<f64, crate::copula::CopulaError> {
    let density = LogDensity::new(copula)?;
    let mut u = vec![0.0; uniforms.len()];
    let mut total = 0.0;
    for row in 0..uniforms[0].len() {
        u.iter_mut().zip(uniforms).for_each(|(u, column)| *u = column[row]);
        total += density.at(&u);
    }
    Ok(total)
}

/// Fits one family by the recipe. The error says why it does not apply.
pub(super) fn by_recipe(
    family: Family,
    sample: Sample,
    given: Given,
    recipe: Recipe,
) -> Result<Copula, String> {
    if let Some(copula) = given.complete(family) {
        return Ok(copula);
    }
    let copula = match (family, recipe) {
        (Family::StudentT, _) => student_t(sample, given, recipe)?,
        (Family::Gaussian, _) => Copula::Gaussian { correlation: correlation(sample, recipe)? },
        (_, Recipe::Paper) => {
            let tau = kendall_tau(sample.columns[0], sample.columns[1]);
            Copula::of_kendall_tau(family, tau).ok_or_else(|| out_of_reach(family, tau))?
        }
        (_, Recipe::Likelihood) => pair_by_likelihood(family, sample.uniforms)?,
    };
    copula.check().map_err(|_| "the ranks are perfectly dependent; no density exists".to_owned())?;
    Ok(copula)
}

fn out_of_reach(family: Family, tau: f64) -> String {
    let range = if family == Family::No16 { "[-1, 1/3)" } else { "(-1, 1)" };
    format!("Kendall's tau is {tau:.4}; the family's range is {range}")
}

/// Maximum likelihood of a family with one theta, over a monotone function of theta.
fn pair_by_likelihood(family: Family, uniforms: &[Vec<f64>]) -> Result<Copula, String> {
    // Ranges of the searched coordinate reach |tau| of 0.99 and more; cells are narrower than the likelihood's peak
    // for fewer than some thousand tests.
    let (low, high, cells, theta): (f64, f64, usize, fn(f64) -> f64) = match family {
        Family::Frank => (-500.0, 500.0, 100, |x| x),
        Family::No16 => (-25.0, 13.0, 40, libm::exp),
        _ => (-25.0, 25.0, 50, libm::exp),
    };
    let loss = |x: f64| {
        let copula = Copula::with_theta(family, theta(x));
        copula.and_then(|c| log_likelihood(&c, uniforms).ok()).map_or(f64::INFINITY, |l| -l)
    };
    let found = minimise(low, high, cells, loss);
    if found.at_end {
        let tau = kendall_tau(&uniforms[0], &uniforms[1]);
        return Err(format!(
            "the likelihood rises to the end of theta's range; {}",
            out_of_reach(family, tau)
        ));
    }
    Copula::with_theta(family, theta(found.x)).ok_or_else(|| "no theta".to_owned())
}

/// The Gaussian copula's matrix by the recipe.
///
/// The paper inverts tau for two properties, and for three takes Pearson's correlation of the normal scores (its
/// Table 8).
fn correlation(sample: Sample, recipe: Recipe) -> Result<Vec<Vec<f64>>, String> {
    let scores = normal_scores(sample.uniforms);
    match recipe {
        Recipe::Paper if sample.columns.len() == 2 => {
            Ok(pair_matrix(correlation_of_tau(kendall_tau(sample.columns[0], sample.columns[1]))))
        }
        Recipe::Paper => Ok(matrix(scores.len(), |i, j| pearson(&scores[i], &scores[j]))),
        Recipe::Likelihood => {
            let start = matrix(scores.len(), |i, j| pearson(&scores[i], &scores[j]));
            let scores = Scores::normal(&scores);
            best_correlation(&start, |r| scores.log_likelihood(r).map_or(f64::INFINITY, |l| -l))
                .ok_or_else(|| "the ranks are perfectly dependent".to_owned())
        }
    }
}

/// The Student t copula: its matrix by the recipe, its degrees of freedom always by maximum likelihood.
fn student_t(sample: Sample, given: Given, recipe: Recipe) -> Result<Copula, String> {
    let fixed = match (given.correlation, recipe) {
        (Some(matrix), _) => Some(matrix.clone()),
        (None, Recipe::Paper) => Some(correlation(sample, recipe)?),
        (None, Recipe::Likelihood) => None,
    };
    let start = match &fixed {
        Some(matrix) => matrix.clone(),
        None => correlation(sample, recipe)?,
    };
    let best = |scores: &Scores| match &fixed {
        Some(matrix) => Some(matrix.clone()),
        None => t_correlation(&start, scores),
    };
    let scores = |nu: f64| Scores::student_t(nu, sample.uniforms);
    let loss = |nu: f64| {
        let scores = scores(nu);
        best(&scores).and_then(|r| scores.log_likelihood(&r)).map_or(f64::INFINITY, |l| -l)
    };
    let degrees_of_freedom = match given.degrees_of_freedom {
        Some(nu) => nu,
        None => {
            let [low, high] = DEGREES_OF_FREEDOM.map(libm::log);
            let Minimum { x, at_end, .. } = minimise(low, high, 12, |x| loss(libm::exp(x)));
            if at_end && x > 0.5 * (low + high) { DEGREES_OF_FREEDOM[1] } else { libm::exp(x) }
        }
    };
    let correlation = best(&scores(degrees_of_freedom)).ok_or("the ranks are perfectly dependent")?;
    Ok(Copula::StudentT { correlation, degrees_of_freedom })
}

/// Maximum likelihood of the t copula's matrix at the degrees of freedom of its scores.
fn t_correlation(start: &[Vec<f64>], scores: &Scores) -> Option<Vec<Vec<f64>>> {
    best_correlation(start, |r| scores.log_likelihood(r).map_or(f64::INFINITY, |l| -l))
}

/// The correlation matrix that minimises `loss`, near `start`.
fn best_correlation(start: &[Vec<f64>], loss: impl Fn(&[Vec<f64>]) -> f64) -> Option<Vec<Vec<f64>>> {
    if start.len() == 2 {
        // |rho| up to 0.999998.
        const END: f64 = 6.8;
        let found = minimise(-END, END, 30, |x| loss(&pair_matrix(libm::tanh(x))));
        return (!found.at_end && found.value.is_finite()).then(|| pair_matrix(libm::tanh(found.x)));
    }
    let from = partial_correlations(start)?;
    let (x, value) = minimise_simplex(&from, 0.1, |x| loss(&matrix_of_partials(x, start.len())));
    value.is_finite().then(|| matrix_of_partials(&x, start.len()))
}

/// A correlation matrix from unconstrained numbers: hyperbolic tangents of them are the canonical partial
/// correlations, row by row (Lewandowski, Kurowicka and Joe 2009), so that every matrix is positive definite.
fn matrix_of_partials(x: &[f64], n: usize) -> Vec<Vec<f64>> {
    let mut partials = x.iter();
    let mut factor = Vec::with_capacity(n);
    for i in 0..n {
        let mut rest = 1.0;
        let mut row = Vec::with_capacity(n);
        for partial in partials.by_ref().take(i) {
            let z = libm::tanh(*partial);
            row.push(z * libm::sqrt(rest));
            rest *= 1.0 - z * z;
        }
        row.push(libm::sqrt(rest));
        factor.push(row);
    }
    matrix(n, |i, j| factor[i].iter().zip(&factor[j]).map(|(a, b): (&f64, &f64)| a * b).sum())
}

/// The inverse of [`matrix_of_partials`].
fn partial_correlations(correlation: &[Vec<f64>]) -> Option<Vec<f64>> {
    let factor = crate::copula::cholesky(correlation)?;
    let mut x = Vec::new();
    for (i, row) in factor.iter().enumerate() {
        let mut rest = 1.0;
        for &entry in &row[..i] {
            let z: f64 = entry / libm::sqrt(rest);
            x.push(libm::atanh(z));
            rest *= 1.0 - z * z;
        }
    }
    Some(x)
}

fn pair_matrix(rho: f64) -> Vec<Vec<f64>> {
    vec![vec![1.0, rho], vec![rho, 1.0]]
}

/// A symmetric matrix with ones on its diagonal from its lower triangle.
fn matrix(n: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let at = |i: usize, j: usize| if i == j { 1.0 } else { entry(i.max(j), i.min(j)) };
    (0..n).map(|i| (0..n).map(|j| at(i, j)).collect()).collect()
}

fn normal_scores(uniforms: &[Vec<f64>]) -> Vec<Vec<f64>> {
    uniforms.iter().map(|column| column.iter().map(|&u| normal_quantile(u)).collect()).collect()
}

fn best_of(candidates: &[CopulaCandidate], criterion: Criterion) -> Result<Copula, String> {
    let score = |candidate: &CopulaCandidate| match criterion {
        Criterion::Aic => candidate.aic,
        Criterion::Bic => candidate.bic,
    };
    candidates
        .iter()
        .filter_map(|candidate| Some((score(candidate).filter(|s| s.is_finite())?, candidate.copula()?)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, copula)| copula)
        .ok_or_else(|| match candidates.iter().find_map(|candidate| candidate.note.clone()) {
            Some(note) => format!("no family can hold the dependence: {note}"),
            None => "not all properties were measured together; give the copula".to_owned(),
        })
}

fn forced_one(candidates: &[CopulaCandidate], family: Family) -> Result<Copula, String> {
    let found = candidates.iter().find(|candidate| candidate.family == family);
    let candidate = found.ok_or("not all properties were measured together; give all of its parameters")?;
    candidate.copula().ok_or_else(|| {
        format!("{} does not apply: {}", family.name(), candidate.note.clone().unwrap_or_default())
    })
}

impl Given<'_> {
    /// The copula, if nothing is left to fit.
    fn complete(&self, family: Family) -> Option<Copula> {
        match family {
            Family::Independent => None,
            Family::Gaussian => Some(Copula::Gaussian { correlation: self.correlation?.clone() }),
            Family::StudentT => Some(Copula::StudentT {
                correlation: self.correlation?.clone(),
                degrees_of_freedom: self.degrees_of_freedom?,
            }),
            Family::Plackett | Family::Frank | Family::No16 => Copula::with_theta(family, self.theta?),
        }
    }

    /// Number of parameters that were fitted, for the criteria.
    fn free_parameters(&self, family: Family, dimension: usize) -> usize {
        let matrix = if self.correlation.is_some() { 0 } else { dimension * (dimension - 1) / 2 };
        match family {
            Family::Independent => 0,
            Family::Gaussian => matrix,
            Family::StudentT => matrix + usize::from(self.degrees_of_freedom.is_none()),
            Family::Plackett | Family::Frank | Family::No16 => usize::from(self.theta.is_none()),
        }
    }
}
