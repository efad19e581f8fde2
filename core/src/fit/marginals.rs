//! One property's marginal: all four families as candidates, and the choice among them.

use super::{MarginalCandidate, MarginalFit};
use crate::campaign::{Criterion, FitSettings, MarginalChoice, Recipe};
use crate::marginal::fit::{SampleError, aic, bic, by_likelihood, by_moments, sample_moments};
use crate::marginal::{Family, Marginal};

/// Number of parameters of every marginal family.
const PARAMETERS: usize = 2;

/// Fits one property; `sample` is absent if it was not measured. The error says why, for people.
pub(super) fn fit(
    sample: Option<&[f64]>,
    choice: &MarginalChoice,
    settings: &FitSettings,
) -> Result<MarginalFit, String> {
    let fitted: Vec<(MarginalCandidate, Option<Marginal>)> = match sample {
        Some(sample) => {
            Family::ALL.iter().map(|&family| candidate(family, sample, settings.recipe)).collect()
        }
        None => Vec::new(),
    };
    let (best, chosen_by) = match choice {
        MarginalChoice::Auto => (best_of(&fitted, settings.criterion)?, "criterion"),
        MarginalChoice::Family(family) => (forced(&fitted, *family)?, "forced"),
        MarginalChoice::Given(marginal) => {
            marginal.check().map_err(|e| e.to_string())?;
            (*marginal, "given")
        }
        MarginalChoice::Moments { family, mean, sd } => {
            (Marginal::from_moments(*family, *mean, *sd).map_err(|e| e.to_string())?, "given")
        }
    };
    let moments = sample.map(sample_moments);
    Ok(MarginalFit {
        best,
        chosen_by,
        candidates: fitted.into_iter().map(|(candidate, _)| candidate).collect(),
        sample_mean: moments.map(|m| m.0),
        sample_sd: moments.map(|m| m.1),
    })
}

/// Fits one family by the recipe.
pub(super) fn by_recipe(family: Family, sample: &[f64], recipe: Recipe) -> Result<Marginal, SampleError> {
    match recipe {
        Recipe::Paper => by_moments(family, sample),
        Recipe::Likelihood => by_likelihood(family, sample),
    }
}

fn candidate(family: Family, sample: &[f64], recipe: Recipe) -> (MarginalCandidate, Option<Marginal>) {
    let blank = MarginalCandidate {
        family,
        p: None,
        q: None,
        mean: None,
        sd: None,
        log_likelihood: None,
        aic: None,
        bic: None,
        note: None,
    };
    let marginal = match by_recipe(family, sample, recipe) {
        Ok(marginal) => marginal,
        Err(why) => return (MarginalCandidate { note: Some(why.to_string()), ..blank }, None),
    };
    let (mean, sd) = marginal.moments();
    let log_likelihood = marginal.log_likelihood(sample);
    let candidate = MarginalCandidate {
        p: Some(marginal.p),
        q: Some(marginal.q),
        mean: Some(mean),
        sd: Some(sd),
        log_likelihood: Some(log_likelihood),
        aic: Some(aic(log_likelihood, PARAMETERS)),
        bic: Some(bic(log_likelihood, PARAMETERS, sample.len())),
        ..blank
    };
    (candidate, Some(marginal))
}

fn best_of(
    fitted: &[(MarginalCandidate, Option<Marginal>)],
    criterion: Criterion,
) -> Result<Marginal, String> {
    let score = |candidate: &MarginalCandidate| match criterion {
        Criterion::Aic => candidate.aic,
        Criterion::Bic => candidate.bic,
    };
    fitted
        .iter()
        .filter_map(|(candidate, marginal)| Some((score(candidate)?, (*marginal)?)))
        .filter(|(score, _)| score.is_finite())
        // The first of equals: `min_by` keeps the earliest.
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, marginal)| marginal)
        .ok_or_else(|| match fitted.iter().find_map(|(candidate, _)| candidate.note.clone()) {
            Some(note) => format!("no family can hold the data: {note}"),
            None => "nothing was measured; give a family with p and q, or mean and sd".to_owned(),
        })
}

fn forced(fitted: &[(MarginalCandidate, Option<Marginal>)], family: Family) -> Result<Marginal, String> {
    let (candidate, marginal) = fitted
        .iter()
        .find(|(candidate, _)| candidate.family == family)
        .ok_or("nothing was measured; give p and q, or mean and sd")?;
    marginal.ok_or_else(|| candidate.note.clone().unwrap_or_default())
}
