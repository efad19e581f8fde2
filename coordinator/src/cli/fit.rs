//! `runout fit`: the fit as tables (the paper's Tables 3 to 5 for two properties, 7 and 8 for three) or JSON.

use super::{Failure, print, print_json};
use crate::fit_tables::{copulas, correlations, marginals, measured};
use crate::load;
use clap::{Args, ValueEnum};
use runout_core::campaign::{Criterion, Recipe};
use runout_core::fit::Fit;
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

pub(super) fn fit(arguments: &FitArguments) -> Result<(), Failure> {
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
    Ok(())
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
