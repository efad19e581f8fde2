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
    let candidates = sample.map_or_else(Vec::new, |sample| marginal_candidates(sample, settings.recipe));
    let (best, chosen_by) = match choice {
        MarginalChoice::Auto => (best_of(&candidates, settings.criterion)?, "criterion"),
        MarginalChoice::Family(family) => (forced(&candidates, *family)?, "forced"),
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
        candidates,
        sample_mean: moments.map(|m| m.0),
        sample_sd: moments.map(|m| m.1),
    })
}

/// All four families fitted to one sample of non-negative values: a soil property, or runout distances in the report.
///
/// A family that cannot hold the sample comes without numbers and with a note.
pub fn marginal_candidates(sample: &[f64], recipe: Recipe) -> Vec<MarginalCandidate> {
    Family::ALL.iter().map(|&family| candidate(family, sample, recipe)).collect()
}

/// Fits one family by the recipe.
fn by_recipe(family: Family, sample: &[f64], recipe: Recipe) -> Result<Marginal, SampleError> {
    match recipe {
        Recipe::Paper => by_moments(family, sample),
        Recipe::Likelihood => by_likelihood(family, sample),
    }
}

fn candidate(family: Family, sample: &[f64], recipe: Recipe) -> MarginalCandidate {
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
        Err(why) => return MarginalCandidate { note: Some(why.to_string()), ..blank },
    };
    let (mean, sd) = marginal.moments();
    let log_likelihood = marginal.log_likelihood(sample);
    if !log_likelihood.is_finite() {
        // The method of moments can leave an outlier with a probability that rounds to zero.
        let note = "at these parameters the sample's likelihood is zero to rounding".to_owned();
        return MarginalCandidate { note: Some(note), ..blank };
    }
    MarginalCandidate {
        p: Some(marginal.p),
        q: Some(marginal.q),
        mean: Some(mean),
        sd: Some(sd),
        log_likelihood: Some(log_likelihood),
        aic: Some(aic(log_likelihood, PARAMETERS)),
        bic: Some(bic(log_likelihood, PARAMETERS, sample.len())),
        ..blank
    }
}

fn best_of(candidates: &[MarginalCandidate], criterion: Criterion) -> Result<Marginal, String> {
    let score = |candidate: &MarginalCandidate| match criterion {
        Criterion::Aic => candidate.aic,
        Criterion::Bic => candidate.bic,
    };
    candidates
        .iter()
        .filter_map(|candidate| Some((score(candidate)?, candidate.marginal()?)))
        .filter(|(score, _)| score.is_finite())
        // Of equals `min_by` keeps the first.
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, marginal)| marginal)
        .ok_or_else(|| match candidates.iter().find_map(|candidate| candidate.note.clone()) {
            Some(note) => format!("no family can hold the data: {note}"),
            None => "nothing was measured; give a family with p and q, or mean and sd".to_owned(),
        })
}

fn forced(candidates: &[MarginalCandidate], family: Family) -> Result<Marginal, String> {
    let candidate = candidates
        .iter()
        .find(|candidate| candidate.family == family)
        .ok_or("nothing was measured; give p and q, or mean and sd")?;
    candidate.marginal().ok_or_else(|| candidate.note.clone().unwrap_or_default())
}
