//! `[fit]`: how marginals and copula are chosen.

use super::{Checked, non_negative, positive, refuse, within, word};
use crate::campaign::file::{CopulaChoiceText, FitSection, MarginalChoiceText};
use crate::campaign::{CopulaChoice, Criterion, FitSettings, MarginalChoice, Recipe};
use crate::copula;
use crate::marginal::{self, Marginal};
use crate::site::Property;

pub(super) fn check_fit(raw: &FitSection, random: &[Property], measured: bool) -> Checked<FitSettings> {
    let mut marginals = Vec::new();
    for p in random {
        let choice = match raw.marginals.get(p.name()) {
            Some(text) => check_marginal(&format!("fit.marginals.{}", p.name()), text)?,
            None => MarginalChoice::Auto,
        };
        let given = matches!(choice, MarginalChoice::Given(_) | MarginalChoice::Moments { .. });
        if !measured && !given {
            let key = format!("fit.marginals.{}", p.name());
            return Err(refuse(&key, "a family to fit", "without [site] give p and q, or mean and sd"));
        }
        marginals.push(choice);
    }
    Ok(FitSettings {
        recipe: word(
            "fit.recipe",
            &raw.recipe,
            &[("likelihood", Recipe::Likelihood), ("paper", Recipe::Paper)],
        )?,
        criterion: word(
            "fit.criterion",
            &raw.criterion,
            &[("aic", Criterion::Aic), ("bic", Criterion::Bic)],
        )?,
        marginals,
        copula: check_copula(raw.copula.as_ref(), random.len(), measured)?,
    })
}

fn check_marginal(key: &str, raw: &MarginalChoiceText) -> Checked<MarginalChoice> {
    let choices = marginal::Family::ALL.map(|f| (f.name(), f));
    let family = word(&format!("{key}.family"), &raw.family, &choices)?;
    match (raw.p, raw.q, raw.mean, raw.sd) {
        (None, None, None, None) => Ok(MarginalChoice::Family(family)),
        (Some(p), Some(q), None, None) => {
            let p_key = format!("{key}.p");
            let p = match family {
                marginal::Family::Weibull => positive(&p_key, p)?,
                _ => within(&p_key, p, true, "it must be finite")?,
            };
            Ok(MarginalChoice::Given(Marginal { family, p, q: positive(&format!("{key}.q"), q)? }))
        }
        (None, None, Some(mean), Some(sd)) => Ok(MarginalChoice::Moments {
            family,
            mean: positive(&format!("{key}.mean"), mean)?,
            sd: positive(&format!("{key}.sd"), sd)?,
        }),
        _ => Err(refuse(key, "a mixture", "give p and q, or mean and sd, or neither pair")),
    }
}

fn check_copula(raw: Option<&CopulaChoiceText>, dimension: usize, measured: bool) -> Checked<CopulaChoice> {
    let Some(raw) = raw else {
        if !measured && dimension > 1 {
            return Err(refuse("fit.copula", "(absent)", "without [site] the copula must be given"));
        }
        return Ok(CopulaChoice::Auto);
    };
    let family = word("fit.copula.family", &raw.family, &copula::Family::ALL.map(|f| (f.name(), f)))?;
    let two_only = matches!(family, copula::Family::Plackett | copula::Family::Frank | copula::Family::No16);
    if two_only && dimension != 2 {
        let allowed = format!("it joins exactly two properties, and the campaign has {dimension}");
        return Err(refuse("fit.copula.family", format!("\"{}\"", raw.family), &allowed));
    }
    if family != copula::Family::Independent && dimension < 2 {
        return Err(refuse("fit.copula.family", &raw.family, "with one property it must be \"independent\""));
    }
    if let Some(theta) = raw.theta {
        match family {
            copula::Family::Plackett => positive("fit.copula.theta", theta)?,
            copula::Family::No16 => non_negative("fit.copula.theta", theta)?,
            copula::Family::Frank => within("fit.copula.theta", theta, true, "it must be finite")?,
            _ => return Err(refuse("fit.copula.theta", theta, "this family has no theta")),
        };
    }
    let elliptical = matches!(family, copula::Family::Gaussian | copula::Family::StudentT);
    if let Some(matrix) = &raw.correlation {
        if !elliptical {
            return Err(refuse(
                "fit.copula.correlation",
                "a matrix",
                "this family has no correlation matrix",
            ));
        }
        check_correlation(matrix, dimension)?;
    }
    if let Some(nu) = raw.degrees_of_freedom {
        if family != copula::Family::StudentT {
            return Err(refuse("fit.copula.degrees_of_freedom", nu, "only student-t has degrees of freedom"));
        }
        within("fit.copula.degrees_of_freedom", nu, nu > 2.0, "it must be greater than 2")?;
    }
    let complete = match family {
        copula::Family::Independent => true,
        copula::Family::Gaussian => raw.correlation.is_some(),
        copula::Family::StudentT => raw.correlation.is_some() && raw.degrees_of_freedom.is_some(),
        _ => raw.theta.is_some(),
    };
    if !measured && !complete {
        return Err(refuse("fit.copula", &raw.family, "without [site] all of its parameters must be given"));
    }
    Ok(CopulaChoice::Family {
        family,
        theta: raw.theta,
        correlation: raw.correlation.clone(),
        degrees_of_freedom: raw.degrees_of_freedom,
    })
}

fn check_correlation(matrix: &[Vec<f64>], dimension: usize) -> Checked<()> {
    let key = "fit.copula.correlation";
    let square = matrix.len() == dimension && matrix.iter().all(|row| row.len() == dimension);
    let allowed = format!(
        "it must be a symmetric positive definite {dimension} by {dimension} matrix of ones on the diagonal"
    );
    let sound = square
        && (0..dimension).all(|i| {
            matrix[i][i] == 1.0
                && (0..dimension).all(|j| matrix[i][j] == matrix[j][i] && matrix[i][j].abs() <= 1.0)
        })
        && nalgebra::DMatrix::from_fn(dimension, dimension, |i, j| matrix[i][j]).cholesky().is_some();
    if sound { Ok(()) } else { Err(refuse(key, format!("{matrix:?}"), &allowed)) }
}
