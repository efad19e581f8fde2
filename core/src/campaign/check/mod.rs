//! From the raw campaign file to a checked [`Campaign`]: ranges, words, units.

mod analysis;
mod fit;
mod ground;
mod soil;
mod stop;
mod water;

use crate::campaign::file::{
    CampaignFile, FieldSection, FitSection, RunSection, SampleSection, SiteSection, ZeroRuleText,
};
use crate::campaign::{
    Autocorrelation, Campaign, CampaignError, Field, Model, OnFailure, Polyline, Run, RunoutMeasure, Sample,
    Site,
};
use crate::site::{Property, ZeroRule};
use std::fmt::Display;

const PA_PER_KPA: f64 = 1e3;
const PA_PER_MPA: f64 = 1e6;
const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

type Checked<T> = Result<T, CampaignError>;

/// Turns the raw file into a checked campaign; `profile` is the surface profile that it names.
pub(super) fn check(file: &CampaignFile, profile: Option<&Polyline>) -> Checked<Campaign> {
    if file.seed > i64::MAX as u64 {
        return Err(refuse("seed", file.seed, "a whole number from 0 to 2^63 - 1"));
    }
    if file.name.trim().is_empty() {
        return Err(refuse("name", "\"\"", "a name is needed"));
    }
    let site = file.site.as_ref().map(check_site).transpose()?;
    let random = random_properties(site.as_ref(), &file.fit)?;
    Ok(Campaign {
        name: file.name.clone(),
        seed: file.seed,
        model: check_model(file, &random, profile)?,
        fit: fit::check_fit(&file.fit, &random, site.is_some())?,
        site,
        random,
        stop: stop::check_stop(&file.stop)?,
        run: check_run(&file.run)?,
    })
}

fn check_model(file: &CampaignFile, random: &[Property], profile: Option<&Polyline>) -> Checked<Model> {
    let (slope, toe) = ground::check_slope(&file.slope, profile)?;
    let mesh = ground::check_mesh(&file.mesh, &slope)?;
    let soil = soil::check_soil(&file.soil, random)?;
    let layers = soil::check_layers(&file.layers, &file.soil, random, toe)?;
    let analysis = analysis::check_analysis(&file.analysis)?;
    let water = water::check_water(&file.water, &slope, toe, &analysis)?;
    soil::check_weights(&soil, &layers, &water, &analysis)?;
    Ok(Model {
        field: check_field(&file.field)?,
        obstacles: ground::check_obstacles(&file.obstacles, &slope, toe, &mesh)?,
        soil,
        layers,
        water,
        analysis,
        sample: check_sample(&file.sample)?,
        maximum_steps: at_least("run.maximum_steps", file.run.maximum_steps, 1)?,
        slope,
        mesh,
    })
}

fn refuse(key: &str, value: impl Display, allowed: &str) -> CampaignError {
    CampaignError::Value { key: key.to_owned(), value: value.to_string(), allowed: allowed.to_owned() }
}

fn within(key: &str, value: f64, ok: bool, allowed: &str) -> Checked<f64> {
    if value.is_finite() && ok { Ok(value) } else { Err(refuse(key, value, allowed)) }
}

fn positive(key: &str, value: f64) -> Checked<f64> {
    within(key, value, value > 0.0, "it must be greater than 0")
}

fn non_negative(key: &str, value: f64) -> Checked<f64> {
    within(key, value, value >= 0.0, "it must be 0 or greater")
}

fn share(key: &str, value: f64) -> Checked<f64> {
    within(key, value, (0.0..1.0).contains(&value), "it must be in [0, 1)")
}

fn between(key: &str, value: f64, low: f64, high: f64) -> Checked<f64> {
    within(key, value, (low..=high).contains(&value), &format!("it must be from {low} to {high}"))
}

fn at_least(key: &str, value: u64, least: u64) -> Checked<u64> {
    if value >= least { Ok(value) } else { Err(refuse(key, value, &format!("it must be {least} or more"))) }
}

fn word<T: Copy>(key: &str, value: &str, choices: &[(&str, T)]) -> Checked<T> {
    choices.iter().find(|(name, _)| *name == value).map(|(_, choice)| *choice).ok_or_else(|| {
        let names: Vec<String> = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        refuse(key, format!("\"{value}\""), &format!("it must be {}", names.join(" or ")))
    })
}

fn needed<T>(key: &str, value: Option<T>, why: &str) -> Checked<T> {
    value.ok_or_else(|| refuse(key, "(absent)", why))
}

fn property(key: &str, name: &str) -> Checked<Property> {
    let choices: Vec<(&str, Property)> = Property::ALL.map(|p| (p.name(), p)).to_vec();
    word(key, name, &choices)
}

fn check_site(raw: &SiteSection) -> Checked<Site> {
    let mut columns = Vec::new();
    for (name, column) in &raw.columns {
        columns.push((property("site.columns", name)?, column.clone()));
    }
    if columns.is_empty() {
        return Err(refuse("site.columns", "{}", "name at least one property's column"));
    }
    columns.sort_by_key(|(p, _)| *p);
    let zeros = match &raw.zeros {
        ZeroRuleText::Word(text) => {
            word("site.zeros", text, &[("keep", ZeroRule::Keep), ("drop", ZeroRule::Drop)])?
        }
        ZeroRuleText::Floor { floor } => ZeroRule::Floor(positive("site.zeros.floor", *floor)?),
    };
    Ok(Site { data: raw.data.clone(), columns, zeros })
}

/// The measured properties, and those whose distribution is given.
fn random_properties(site: Option<&Site>, fit: &FitSection) -> Checked<Vec<Property>> {
    let mut random: Vec<Property> =
        site.map(|s| s.columns.iter().map(|(p, _)| *p).collect()).unwrap_or_default();
    for name in fit.marginals.keys() {
        let p = property("fit.marginals", name)?;
        if !random.contains(&p) {
            random.push(p);
        }
    }
    random.sort();
    if random.is_empty() {
        return Err(refuse("fit.marginals", "(none)", "at least one property must be measured or given"));
    }
    Ok(random)
}

fn check_field(raw: &FieldSection) -> Checked<Field> {
    Ok(Field {
        autocorrelation: word(
            "field.autocorrelation",
            &raw.autocorrelation,
            &[
                ("single-exponential", Autocorrelation::SingleExponential),
                ("squared-exponential", Autocorrelation::SquaredExponential),
                ("second-order-markov", Autocorrelation::SecondOrderMarkov),
                ("cosine-exponential", Autocorrelation::CosineExponential),
                ("binary-noise", Autocorrelation::BinaryNoise),
            ],
        )?,
        scale_horizontal_m: positive(
            "field.scale_of_fluctuation_horizontal_m",
            raw.scale_of_fluctuation_horizontal_m,
        )?,
        scale_vertical_m: positive(
            "field.scale_of_fluctuation_vertical_m",
            raw.scale_of_fluctuation_vertical_m,
        )?,
        rotation_rad: between("field.rotation_deg", raw.rotation_deg, -90.0, 90.0)? * RAD_PER_DEG,
    })
}

fn check_sample(raw: &SampleSection) -> Checked<Sample> {
    let measures =
        [RunoutMeasure::DisplacementQ999, RunoutMeasure::MaxDisplacement, RunoutMeasure::ToeAdvance];
    Ok(Sample {
        measure: word("sample.measure", &raw.measure, &measures.map(|m| (m.name(), m)))?,
        threshold_m: non_negative("sample.threshold_m", raw.threshold_m)?,
        profile: raw.profile,
    })
}

fn check_run(raw: &RunSection) -> Checked<Run> {
    Ok(Run {
        on_failure: word(
            "run.on_failure",
            &raw.on_failure,
            &[("exclude", OnFailure::Exclude), ("abort", OnFailure::Abort)],
        )?,
        audit_fraction: between("run.audit_fraction", raw.audit_fraction, 0.0, 1.0)?,
    })
}
