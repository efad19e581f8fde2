//! The page's second half: what went in, and how to get the same out again.

use super::figures::{Figure, short_name};
use super::html::{captioned, escape, from_table, paragraph, table};
use super::page::{find, pair};
use super::{Findings, Material};
use crate::fit_tables;
use crate::machine::Machine;
use crate::table::significant;
use runout_core::campaign::{Model, Recipe, Slope, Surface};
use runout_core::slope;
use runout_proto::identity;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Site data and fits.
pub(super) fn soil(material: &Material<'_>, figures: &[Figure]) -> String {
    let (fit, properties) = (material.fit, &material.campaign.random);
    let mut html = String::new();
    let recipe = match fit.recipe {
        Recipe::Paper => "the paper's recipe (moments, inversion of Kendall's tau, ordinal ranks)",
        Recipe::Likelihood => "maximum likelihood (average ranks)",
    };
    match fit.tests {
        Some(n) => html.push_str(&paragraph(format!(
            "Fitted to {n} tests by {recipe}. With so few tests the fits are themselves uncertain, and families are near \
             each other: the weight is each family's support by the criterion. That uncertainty is in none of the intervals above."
        ))),
        None => html.push_str(&paragraph("Nothing was measured: every distribution is given in the campaign file.")),
    }
    let names: Vec<&str> =
        figures.iter().map(|f| f.name.as_str()).filter(|name| name.starts_with("soil-")).collect();
    html.push_str(&pair(figures, &names));
    html.push_str(&captioned("Measured and chosen", &from_table(&fit_tables::measured(properties, fit))));
    if let Some(dependence) = fit.dependence.as_ref().filter(|_| properties.len() > 1) {
        let correlations = from_table(&fit_tables::correlations(properties, dependence));
        html.push_str(&captioned("Correlations of the tests", &correlations));
    }
    for property in properties {
        let marginal = &fit.marginals[property.name()];
        let _ = writeln!(
            html,
            "<h3>Marginal distribution of {}, {}</h3>",
            short_name(*property),
            fit_tables::choice_in_words(marginal.chosen_by)
        );
        html.push_str(&from_table(&fit_tables::marginals(marginal, fit.criterion)));
    }
    let _ = writeln!(html, "<h3>Copula, {}</h3>", fit_tables::choice_in_words(fit.copula.chosen_by));
    html.push_str(&from_table(&fit_tables::copulas(properties, &fit.copula, fit.criterion)));
    if let Some(site) = material.site {
        let header: Vec<&str> =
            std::iter::once("test").chain(site.properties.iter().map(|p| p.name())).collect();
        let rows: Vec<(bool, Vec<String>)> = (0..site.tests())
            .map(|i| {
                let values = site.values.iter().map(|column| column[i].to_string());
                (false, std::iter::once((i + 1).to_string()).chain(values).collect())
            })
            .collect();
        let _ = writeln!(
            html,
            "<details><summary>The measured table</summary>{}</details>",
            captioned("Laboratory tests", &table(&header, &rows))
        );
    }
    html
}

/// The section in a sentence.
pub(super) fn section_in_words(model: &Model) -> String {
    let slope = &model.slope;
    format!(
        "The slope is {} m high at {}\u{b0}; the ground behind the toe is {} m long, the plain in front of it {} m, and the rigid \
         base lies {} m below the toe.",
        significant(slope::height_m(slope), 4),
        significant(slope::mean_angle_rad(slope).to_degrees(), 4),
        significant(-slope::rear_x(slope), 4),
        significant(slope.runout_plain_m, 4),
        significant(slope.foundation_depth_m, 4)
    )
}

/// The section, its materials, and every key of the campaign file: there are no others, because nothing that moves the
/// answer has a default.
pub(super) fn inputs(material: &Material<'_>, figures: &[Figure]) -> String {
    let rows = match material.campaign_text.parse::<toml::Table>() {
        Ok(file) => {
            let mut rows = Vec::new();
            flatten("", &toml::Value::Table(file), &mut rows);
            rows
        }
        // The text was parsed when the campaign started; a run directory that was edited since may be anything.
        Err(error) => vec![("campaign.toml".to_owned(), error.message().to_owned())],
    };
    let rows: Vec<(bool, Vec<String>)> = rows.into_iter().map(|(k, v)| (false, vec![k, v])).collect();
    let mut html = find(figures, "section");
    html.push_str(&paragraph(section_in_words(&material.spec.model)));
    html.push_str(&profile(&material.spec.model.slope));
    html.push_str(&paragraph(
        "As written in the campaign file. Nothing that moves the answer has a hidden default.",
    ));
    html + &captioned("The campaign file", &table(&["key", "value"], &rows))
}

/// The surveyed points, if the surface is a profile.
fn profile(slope: &Slope) -> String {
    let Surface::Profile { line, .. } = &slope.surface else { return String::new() };
    let rows: Vec<(bool, Vec<String>)> = line
        .points()
        .iter()
        .map(|point| (false, point.iter().map(|v| significant(*v, 7)).collect()))
        .collect();
    format!(
        "<details><summary>The surveyed profile, m from the toe</summary>{}</details>",
        table(&["x (m)", "y (m)"], &rows)
    )
}

/// Workers that are named one by one.
const MOST_WORKERS: usize = 20;

/// Identity of the campaign, versions, who ran it, and the commands that give the same again.
pub(super) fn provenance(material: &Material<'_>, found: &Findings) -> String {
    let rows = [
        ("spec digest (BLAKE3)", material.spec.digest()),
        ("spec format", material.spec.format.to_string()),
        ("campaign seed", material.spec.seed.to_string()),
        ("build of this report", identity::build()),
    ];
    let rows: Vec<(bool, Vec<String>)> =
        rows.into_iter().map(|(k, v)| (false, vec![k.to_owned(), v])).collect();
    captioned("Identity", &table(&["what", "value"], &rows))
        + &work(material)
        + &replayed(material, found)
        + &paragraph(
            "Every realisation follows from the spec and its index alone, bit for bit, on any machine and in any order. \
             Run from this directory:",
        )
        + &format!(
            "<pre>{}</pre>\n",
            escape(
                "runout run campaign.toml --out again   # the whole campaign once more\n\
                 runout results again                   # the same table but for its last three columns\n\
                 runout replay . 0 --out replay         # one realisation, compared bit for bit, with pictures",
            )
        )
        + &paragraph(
            "Method after Ma et al. 2024, <i>Multivariate copula-based framework for stochastic analysis of landslide \
             runout distance</i> (\u{201c}the paper\u{201d} above).",
        )
}

/// Who ran the realisations, and how long they took.
fn work(material: &Material<'_>) -> String {
    let rows: Vec<(bool, Vec<String>)> = material
        .work
        .iter()
        .take(MOST_WORKERS)
        .map(|work| {
            let each = work.wall_s / work.realisations.max(1) as f64;
            let cells = vec![
                work.worker.clone(),
                work.realisations.to_string(),
                significant(each, 3),
                significant(work.wall_s / 3600.0, 3),
            ];
            (false, cells)
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let more = match material.work.len().saturating_sub(MOST_WORKERS) {
        0 => String::new(),
        more => paragraph(format!("And {more} workers more.")),
    };
    let header = ["worker", "realisations", "seconds each", "hours in all"];
    captioned("Who ran them", &table(&header, &rows))
        + &more
        + &machines(material)
        + &paragraph(
            "Workers were let in only with the coordinator's build and with the same digest of their arithmetic. The kind of \
             machine moves no bit; it is what a worker said when it registered, as far back as <code>events.log</code> goes.",
        )
}

/// The kinds of machines that took part; workers that came back from another kind count under all of theirs together.
fn machines(material: &Material<'_>) -> String {
    let mut kinds: BTreeMap<&[Machine], (u64, u64, f64)> = BTreeMap::new();
    for work in material.work {
        let (workers, realisations, wall_s) = kinds.entry(&work.machines).or_default();
        *workers += 1;
        *realisations += work.realisations;
        *wall_s += work.wall_s;
    }
    let each = |of: &dyn Fn(&Machine) -> String, machines: &[Machine]| -> String {
        let all: Vec<String> = machines.iter().map(of).collect();
        if all.is_empty() { "not noted".to_owned() } else { all.join(" / ") }
    };
    let rows = kinds.into_iter().map(|(machines, (workers, realisations, wall_s))| {
        let cells = vec![
            each(&|m| m.processor.clone(), machines),
            each(&|m| m.kernel.clone(), machines),
            each(&|m| m.cores.to_string(), machines),
            workers.to_string(),
            realisations.to_string(),
            significant(wall_s / realisations.max(1) as f64, 3),
        ];
        (false, cells)
    });
    let rows: Vec<(bool, Vec<String>)> = rows.take(MOST_WORKERS).collect();
    let header = ["processor", "instructions", "cores", "workers", "realisations", "seconds each"];
    captioned("On what machines", &table(&header, &rows))
}

/// What was run again for this page, and whether it gave the same.
fn replayed(material: &Material<'_>, found: &Findings) -> String {
    let count = material.replays.realisations.len();
    match (count, &found.differing[..]) {
        (0, _) => String::new(),
        (_, []) => paragraph(format!(
            "{count} realisations were replayed for this page, and every one gave the recorded outcome bit for bit."
        )),
        (_, differing) => {
            let named: Vec<String> = differing.iter().map(u64::to_string).collect();
            paragraph(format!(
                "<strong>Of {count} realisations replayed for this page, {} gave another outcome than the recorded one: {}.</strong> \
                 Another build ran them, or a machine computes wrongly: <code>runout replay</code> shows what differs.",
                differing.len(),
                named.join(", ")
            ))
        }
    }
}

/// Dotted keys and values in the order of the file's sections.
fn flatten(prefix: &str, value: &toml::Value, rows: &mut Vec<(String, String)>) {
    match value {
        toml::Value::Table(entries) => {
            // Plain values first, so that a section's own keys stand before its subsections'.
            let (sections, plain): (Vec<_>, Vec<_>) = entries.iter().partition(|(_, v)| is_section(v));
            for (key, value) in plain.into_iter().chain(sections) {
                let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                flatten(&path, value, rows);
            }
        }
        // Sections that are repeated count from 1, or go by their names.
        toml::Value::Array(items) if is_section(value) => {
            for (i, item) in items.iter().enumerate() {
                let name = item.get("name").and_then(toml::Value::as_str);
                let path = name.map_or_else(|| format!("{prefix}[{}]", i + 1), |n| format!("{prefix}.{n}"));
                flatten(&path, item, rows);
            }
        }
        toml::Value::String(text) => rows.push((prefix.to_owned(), text.clone())),
        other => rows.push((prefix.to_owned(), other.to_string())),
    }
}

fn is_section(value: &toml::Value) -> bool {
    let tables = |items: &Vec<toml::Value>| !items.is_empty() && items.iter().all(toml::Value::is_table);
    value.is_table() || value.as_array().is_some_and(tables)
}
