//! `runout fit`: the fit as tables (the paper's Tables 3 to 5 for two properties, 7 and 8 for three) or JSON.

use super::{Ending, Failure, print, print_json};
use crate::load;
use crate::table::{Table, number, optional, significant};
use clap::{Args, ValueEnum};
use runout_core::campaign::{Criterion, Recipe};
use runout_core::fit::{CopulaCandidate, CopulaFit, Dependence, Fit, MarginalFit};
use runout_core::site::Property;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;

/// `runout fit CAMPAIGN [--recipe paper|likelihood] [--json]`
#[derive(Debug, Args)]
pub struct FitArguments {
    /// Campaign file
    campaign: PathBuf,
    /// Fit by this recipe instead of the campaign file's
    #[arg(long, value_enum)]
    recipe: Option<RecipeName>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum RecipeName {
    /// Moments, inversion of Kendall's tau, ordinal ranks: the paper's printed numbers
    Paper,
    /// Maximum likelihood throughout, average ranks
    Likelihood,
}

#[derive(Serialize)]
struct Document<'a> {
    campaign: &'a str,
    spec_digest: String,
    #[serde(flatten)]
    fit: &'a Fit,
}

pub(super) fn fit(arguments: &FitArguments) -> Result<Ending, Failure> {
    let path = &arguments.campaign;
    let mut inputs = load::read(path)?;
    match arguments.recipe {
        Some(RecipeName::Paper) => inputs.campaign.fit.recipe = Recipe::Paper,
        Some(RecipeName::Likelihood) => inputs.campaign.fit.recipe = Recipe::Likelihood,
        None => {}
    }
    let loaded = load::fit_and_freeze(path, inputs)?;
    if arguments.json {
        print_json(&Document {
            campaign: &loaded.campaign.name,
            spec_digest: loaded.spec.digest(),
            fit: &loaded.fit,
        })?;
    } else {
        print(&tables(&loaded.campaign.name, &loaded.campaign.random, &loaded.fit))?;
    }
    Ok(Ending::Done)
}

/// The whole fit as text.
fn tables(name: &str, properties: &[Property], fit: &Fit) -> String {
    let recipe = match fit.recipe {
        Recipe::Paper => "paper (moments, Kendall's tau, ordinal ranks)",
        Recipe::Likelihood => "likelihood (maximum likelihood, average ranks)",
    };
    let criterion = match fit.criterion {
        Criterion::Aic => "AIC",
        Criterion::Bic => "BIC",
    };
    let tests = fit.tests.map_or_else(|| "nothing measured".to_owned(), |n| format!("{n} tests"));
    let mut text = format!("{name}: {tests}; recipe {recipe}; criterion {criterion}\n");
    let _ = write!(text, "\nMeasured properties\n{}", measured(properties, fit).render());
    if let Some(dependence) = fit.dependence.as_ref().filter(|_| properties.len() > 1) {
        let _ = write!(text, "\nCorrelation of the data\n{}", correlations(properties, dependence).render());
    }
    for property in properties {
        let marginal = &fit.marginals[property.name()];
        let _ = write!(
            text,
            "\nMarginal distribution of {}, chosen by {}\n",
            property.name(),
            marginal.chosen_by
        );
        text.push_str(&marginals(marginal, fit.criterion).render());
    }
    let _ = write!(text, "\nCopula, chosen by {}\n", fit.copula.chosen_by);
    text.push_str(&copulas(properties, &fit.copula, fit.criterion).render());
    text.push_str(
        "\n* is the choice. weight: support among the families by the criterion, exp(-difference / 2), normalised;\n\
         with few tests several families are near each other, and the choice is itself uncertain.\n",
    );
    text
}

fn measured(properties: &[Property], fit: &Fit) -> Table {
    let mut table = Table::new(["", "mean", "standard deviation", "mean of the choice", "sd of the choice"]);
    for property in properties {
        let marginal = &fit.marginals[property.name()];
        let chosen = marginal.candidates.iter().find(|c| c.family == marginal.best.family);
        table.row([
            property.name().to_owned(),
            optional(marginal.sample_mean),
            optional(marginal.sample_sd),
            optional(chosen.and_then(|c| c.mean)),
            optional(chosen.and_then(|c| c.sd)),
        ]);
    }
    table
}

fn correlations(properties: &[Property], dependence: &Dependence) -> Table {
    let mut table = Table::new(["", "Kendall tau_b", "Pearson r", "Spearman rho"]);
    for (i, j) in pairs(properties.len()) {
        table.row([
            format!("{}, {}", properties[i].name(), properties[j].name()),
            number(dependence.kendall_tau[i][j]),
            number(dependence.pearson[i][j]),
            number(dependence.spearman[i][j]),
        ]);
    }
    table
}

fn marginals(fit: &MarginalFit, criterion: Criterion) -> Table {
    let mut table =
        Table::new(["", "family", "p", "q", "mean", "sd", "log-likelihood", "AIC", "BIC", "weight"]);
    let values: Vec<Option<f64>> = fit.candidates.iter().map(|c| by(criterion, c.aic, c.bic)).collect();
    let weights = weights(&values);
    for (candidate, weight) in fit.candidates.iter().zip(weights) {
        table.row([
            star(candidate.family == fit.best.family),
            candidate.family.name().to_owned(),
            optional(candidate.p),
            optional(candidate.q),
            optional(candidate.mean),
            optional(candidate.sd),
            optional(candidate.log_likelihood),
            optional(candidate.aic),
            optional(candidate.bic),
            weight,
            candidate.note.clone().unwrap_or_default(),
        ]);
    }
    if fit.candidates.is_empty() {
        table.row(["*", fit.best.family.name(), &number(fit.best.p), &number(fit.best.q), "given"]);
    }
    table
}

fn copulas(properties: &[Property], fit: &CopulaFit, criterion: Criterion) -> Table {
    let matrix = properties.len() > 2;
    let mut header = vec![String::new(), "family".to_owned()];
    match matrix {
        true => header.extend(
            pairs(properties.len())
                .map(|(i, j)| format!("{}-{}", short(properties[i]), short(properties[j]))),
        ),
        false => header.push("theta".to_owned()),
    }
    header.extend(
        ["d.o.f.", "log-likelihood", "AIC", "BIC", "weight", "lower tail", "upper tail"].map(String::from),
    );
    let tested = fit.candidates.iter().any(|c| c.cramer_von_mises.is_some());
    if tested {
        header.extend(["S_n", "p-value"].map(String::from));
    }
    let mut table = Table::new(header);
    let best = family_name(&fit.best);
    let values: Vec<Option<f64>> = fit.candidates.iter().map(|c| by(criterion, c.aic, c.bic)).collect();
    for (candidate, weight) in fit.candidates.iter().zip(weights(&values)) {
        let mut row = vec![star(candidate.family.name() == best), candidate.family.name().to_owned()];
        row.extend(parameters(candidate, properties.len(), matrix));
        row.extend(
            [candidate.degrees_of_freedom, candidate.log_likelihood, candidate.aic, candidate.bic]
                .map(optional),
        );
        row.push(weight);
        row.extend([candidate.tail_lower, candidate.tail_upper].map(optional));
        if tested {
            row.extend([candidate.cramer_von_mises, candidate.p_value].map(optional));
        }
        row.push(candidate.note.clone().unwrap_or_default());
        table.row(row);
    }
    if fit.candidates.is_empty() {
        table.row(["*".to_owned(), best]);
    }
    table
}

/// One cell per correlation for more than two properties, one cell for the parameter of two.
fn parameters(candidate: &CopulaCandidate, dimension: usize, matrix: bool) -> Vec<String> {
    let entry = |i: usize, j: usize| candidate.correlation.as_ref().map(|m| m[i][j]);
    if matrix {
        pairs(dimension).map(|(i, j)| optional(entry(i, j))).collect()
    } else {
        let off_diagonal = if dimension == 2 { entry(0, 1) } else { None };
        vec![optional(candidate.theta.or(off_diagonal))]
    }
}

fn family_name(copula: &runout_core::copula::Copula) -> String {
    let value = serde_json::to_value(copula).unwrap_or_default();
    value["family"].as_str().unwrap_or_default().to_owned()
}

fn short(property: Property) -> &'static str {
    match property {
        Property::Cohesion => "c",
        Property::FrictionAngle => "phi",
        Property::UnitWeight => "gamma",
    }
}

fn pairs(dimension: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..dimension).flat_map(move |i| (i + 1..dimension).map(move |j| (i, j)))
}

fn by(criterion: Criterion, aic: Option<f64>, bic: Option<f64>) -> Option<f64> {
    match criterion {
        Criterion::Aic => aic,
        Criterion::Bic => bic,
    }
}

fn star(chosen: bool) -> String {
    if chosen { "*" } else { "" }.to_owned()
}

/// Akaike weights (Burnham and Anderson 2002, section 2.9) as cells; a dash where a family does not apply.
fn weights(values: &[Option<f64>]) -> Vec<String> {
    let least = values.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let support = |v: &Option<f64>| v.map(|v| (-0.5 * (v - least)).exp());
    let sum: f64 = values.iter().filter_map(support).sum();
    values.iter().map(|v| support(v).map_or_else(|| "-".to_owned(), |s| significant(s / sum, 3))).collect()
}
