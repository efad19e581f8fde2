//! `runout fit`: the fit as tables (the paper's Tables 3 to 5 for two properties, 7 and 8 for three) or JSON.

use super::{Failure, print, print_json};
use crate::fit_tables::{choice_in_words, copulas, correlations, marginals, measured, pairs};
use crate::load;
use crate::table::{list, significant};
use clap::{Args, ValueEnum};
use runout_core::campaign::{Criterion, Recipe};
use runout_core::fit::{
    Fit, GOODNESS_REPLICATES, Interval, UNCERTAINTY_REPLICATES, Uncertainty, goodness_of_fit, uncertainty,
};
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
    /// Test the copulas' goodness of fit and give the fit's own uncertainty, by resampling (some seconds)
    #[arg(long)]
    goodness: bool,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    uncertainty: Option<Uncertainty>,
}

pub(super) fn fit(arguments: &FitArguments) -> Result<(), Failure> {
    let path = &arguments.campaign;
    let mut inputs = load::read(path)?;
    match arguments.recipe {
        Some(RecipeName::Paper) => inputs.campaign.fit.recipe = Recipe::Paper,
        Some(RecipeName::Likelihood) => inputs.campaign.fit.recipe = Recipe::Likelihood,
        None => {}
    }
    let mut loaded = load::fit_and_freeze(path, inputs)?;
    let mut sampling = None;
    if let Some(site) = loaded.site.as_ref().filter(|_| arguments.goodness) {
        let seed = loaded.campaign.seed;
        let results = goodness_of_fit(&loaded.fit, site, GOODNESS_REPLICATES, seed);
        loaded.fit.add_goodness_of_fit(&results);
        sampling = Some(uncertainty(&loaded.fit, site, UNCERTAINTY_REPLICATES, seed));
    }
    if arguments.json {
        print_json(&Document {
            campaign: &loaded.campaign.name,
            spec_digest: loaded.spec.digest(),
            fit: &loaded.fit,
            uncertainty: sampling,
        })?;
    } else {
        let mut text = tables(&loaded.campaign.name, &loaded.campaign.random, &loaded.fit);
        if let Some(sampling) = sampling {
            text.push_str(&uncertainty_in_words(&loaded.campaign.random, &sampling));
        }
        print(&text)?;
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
            "\nMarginal distribution of {}, {}\n",
            property.name(),
            choice_in_words(marginal.chosen_by)
        );
        text.push_str(&marginals(marginal, fit.criterion).render());
    }
    let _ = write!(text, "\nCopula, {}\n", choice_in_words(fit.copula.chosen_by));
    text.push_str(&copulas(properties, &fit.copula, fit.criterion).render());
    text.push_str(
        "\n* is the choice. weight: support among the families by the criterion, exp(-difference / 2), normalised;\n\
         with few tests several families are near each other, and the choice is itself uncertain.\n",
    );
    text
}

/// What resampling the tests says of the fit itself.
fn uncertainty_in_words(properties: &[Property], uncertainty: &Uncertainty) -> String {
    let mut text =
        format!("\nUncertainty of the fit: 95 % intervals of {} resamples\n", uncertainty.replicates);
    let show = |i: &Interval| format!("{} to {}", significant(i.lower, 4), significant(i.upper, 4));
    let mut rows = Vec::new();
    for (property, found) in &uncertainty.properties {
        let error = significant(found.mean_standard_error, 3);
        rows.push((format!("{property}, mean"), format!("{} (standard error {error})", show(&found.mean))));
        rows.push((format!("{property}, standard deviation"), show(&found.sd)));
    }
    for ((i, j), tau) in pairs(properties.len()).zip(&uncertainty.kendall_tau) {
        rows.push((format!("tau_b, {} and {}", properties[i].name(), properties[j].name()), show(tau)));
    }
    rows.extend(uncertainty.theta.iter().map(|theta| ("theta of the chosen copula".to_owned(), show(theta))));
    text.push_str(&list(&rows));
    text
}
