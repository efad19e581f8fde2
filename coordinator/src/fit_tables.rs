//! The tables of a fit, shared by `runout fit` and the report.

use crate::table::{Table, number, optional, significant};
use runout_core::campaign::Criterion;
use runout_core::fit::{CopulaCandidate, CopulaFit, Dependence, Fit, MarginalFit};
use runout_core::marginal::Marginal;
use runout_core::site::Property;

/// Mean and standard deviation of the data and of the chosen distribution (the paper's Table 3).
pub fn measured(properties: &[Property], fit: &Fit) -> Table {
    let mut table = Table::new(["", "mean", "standard deviation", "mean of the choice", "sd of the choice"]);
    for property in properties {
        let marginal = &fit.marginals[property.name()];
        table.row([
            property.name().to_owned(),
            optional(marginal.sample_mean),
            optional(marginal.sample_sd),
            number(marginal.best.mean()),
            number(marginal.best.sd()),
        ]);
    }
    table
}

/// Rank and linear correlations of every pair (the paper's Table 3).
pub fn correlations(properties: &[Property], dependence: &Dependence) -> Table {
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

/// The families fitted to one property (the paper's Tables 4 and 7); the first column marks the choice.
pub fn marginals(fit: &MarginalFit, criterion: Criterion) -> Table {
    let mut table =
        Table::new(["", "family", "p", "q", "mean", "sd", "log-likelihood", "AIC", "BIC", "weight"]);
    let values: Vec<Option<f64>> = fit.candidates.iter().map(|c| by(criterion, c.aic, c.bic)).collect();
    let weights = weights(&values);
    for (candidate, weight) in fit.candidates.iter().zip(weights) {
        table.row([
            star(candidate.marginal() == Some(fit.best)),
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
    if fit.candidates.iter().all(|c| c.marginal() != Some(fit.best)) {
        let Marginal { family, p, q } = fit.best;
        let mut row = vec![star(true), family.name().to_owned()];
        row.extend([p, q, fit.best.mean(), fit.best.sd()].map(number));
        row.extend(std::iter::repeat_n("-".to_owned(), 4));
        row.push("given in the campaign file, not fitted".to_owned());
        table.row(row);
    }
    table
}

/// The copulas fitted (the paper's Tables 5 and 8); the first column marks the choice.
pub fn copulas(properties: &[Property], fit: &CopulaFit, criterion: Criterion) -> Table {
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

/// Who chose a family, in words.
pub fn choice_in_words(chosen_by: &str) -> &str {
    match chosen_by {
        "criterion" => "chosen by the criterion",
        "forced" => "family as in the campaign file",
        "given" => "given in the campaign file",
        "only-one" => "the only one there is",
        other => other,
    }
}

/// Every pair of places below `dimension`, in the order (0, 1), (0, 2), (1, 2).
pub fn pairs(dimension: usize) -> impl Iterator<Item = (usize, usize)> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::load;
    use std::path::Path;

    /// The paper's reading of Elkhorn River gives the friction angle's distribution, with another mean than the data's.
    #[test]
    fn a_given_distribution_is_the_choice_and_not_the_fit_of_its_family() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../campaigns/elkhorn-river/paper.toml");
        let loaded = load(Path::new(file)).unwrap();
        let fit = &loaded.fit.marginals["friction_angle_deg"];
        let table = marginals(fit, loaded.fit.criterion).render();
        let chosen: Vec<&str> = table.lines().filter(|line| line.starts_with('*')).collect();
        assert_eq!(chosen.len(), 1, "{table}");
        assert!(chosen[0].contains("weibull") && chosen[0].contains("21.14"), "{table}");
        let means = measured(&loaded.campaign.random, &loaded.fit).render();
        assert!(means.lines().any(|line| line.contains("27.144") && line.contains("21.14")), "{means}");
    }
}
