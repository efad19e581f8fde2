//! From the raw campaign file to a checked [`Campaign`]: ranges, words, units.

mod fit;
mod stop;

use crate::campaign::file::{
    AnalysisSection, CampaignFile, CutoffText, FieldSection, FitSection, MeshSection, RunSection,
    SampleSection, SiteSection, SlopeSection, SoilSection, WaterSection, WaterTableText, ZeroRuleText,
};
use crate::campaign::{
    Analysis, Autocorrelation, Campaign, CampaignError, Field, Formulation, GroundSurface,
    InitialPorePressure, Mesh, Model, OnFailure, PointDomain, Run, RunoutMeasure, Sample, Site, Slope, Soil,
    VelocityFilter, VolumetricStrain, Water, WaterTable,
};
use crate::site::{Property, ZeroRule};
use std::fmt::Display;

const PA_PER_KPA: f64 = 1e3;
const PA_PER_MPA: f64 = 1e6;
const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

type Checked<T> = Result<T, CampaignError>;

/// Turns the raw file into a checked campaign.
pub(super) fn check(file: &CampaignFile) -> Checked<Campaign> {
    if file.seed > i64::MAX as u64 {
        return Err(refuse("seed", file.seed, "a whole number from 0 to 2^63 - 1"));
    }
    if file.name.trim().is_empty() {
        return Err(refuse("name", "\"\"", "a name is needed"));
    }
    let site = file.site.as_ref().map(check_site).transpose()?;
    let random = random_properties(site.as_ref(), &file.fit)?;
    let slope = check_slope(&file.slope)?;
    let mesh = check_mesh(&file.mesh, &slope)?;
    let soil = check_soil(&file.soil, &random)?;
    let water = check_water(&file.water, &slope)?;
    let analysis = check_analysis(&file.analysis)?;
    check_weight(&soil, &water, &analysis)?;
    Ok(Campaign {
        name: file.name.clone(),
        seed: file.seed,
        fit: fit::check_fit(&file.fit, &random, site.is_some())?,
        model: Model {
            field: check_field(&file.field)?,
            soil,
            water,
            analysis,
            sample: check_sample(&file.sample)?,
            maximum_steps: at_least("run.maximum_steps", file.run.maximum_steps, 1)?,
            slope,
            mesh,
        },
        site,
        random,
        stop: stop::check_stop(&file.stop)?,
        run: check_run(&file.run)?,
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

fn check_slope(raw: &SlopeSection) -> Checked<Slope> {
    Ok(Slope {
        height_m: positive("slope.height_m", raw.height_m)?,
        angle_rad: between("slope.angle_deg", raw.angle_deg, 1.0, 90.0)? * RAD_PER_DEG,
        crest_width_m: positive("slope.crest_width_m", raw.crest_width_m)?,
        foundation_depth_m: non_negative("slope.foundation_depth_m", raw.foundation_depth_m)?,
        runout_plain_m: positive("slope.runout_plain_m", raw.runout_plain_m)?,
    })
}

fn check_mesh(raw: &MeshSection, slope: &Slope) -> Checked<Mesh> {
    let side = positive("mesh.cell_size_m", raw.cell_size_m)?;
    if side > slope.height_m / 4.0 {
        let allowed = format!("it must be at most a quarter of slope.height_m ({} m)", slope.height_m / 4.0);
        return Err(refuse("mesh.cell_size_m", side, &allowed));
    }
    match raw.points_per_cell_side {
        2..=4 => Ok(Mesh { cell_size_m: side, points_per_cell_side: raw.points_per_cell_side }),
        n => Err(refuse("mesh.points_per_cell_side", n, "it must be 2, 3 or 4")),
    }
}

fn check_soil(raw: &SoilSection, random: &[Property]) -> Checked<Soil> {
    let constant = |p: Property, value: Option<f64>, unit: f64| -> Checked<Option<f64>> {
        let key = format!("soil.{}", p.name());
        match (random.contains(&p), value) {
            (true, None) => Ok(None),
            (false, Some(value)) => Ok(Some(non_negative(&key, value)? * unit)),
            (true, Some(value)) => Err(refuse(&key, value, "it is a random property: leave it out here")),
            (false, None) => Err(refuse(&key, "(absent)", "it is not a random property: give its value")),
        }
    };
    let unit_weight = constant(Property::UnitWeight, raw.unit_weight_kn_m3, 1e3)?;
    let friction = constant(Property::FrictionAngle, raw.friction_angle_deg, RAD_PER_DEG)?;
    if let Some(angle) = raw.friction_angle_deg {
        between("soil.friction_angle_deg", angle, 0.0, 80.0)?;
    }
    Ok(Soil {
        youngs_modulus_pa: positive("soil.youngs_modulus_mpa", raw.youngs_modulus_mpa)? * PA_PER_MPA,
        poissons_ratio: within(
            "soil.poissons_ratio",
            raw.poissons_ratio,
            (0.0..0.5).contains(&raw.poissons_ratio),
            "it must be in [0, 0.5)",
        )?,
        cohesion_pa: constant(Property::Cohesion, raw.cohesion_kpa, PA_PER_KPA)?,
        friction_angle_rad: friction,
        unit_weight_n_m3: unit_weight,
        dilation_angle_rad: between("soil.dilation_angle_deg", raw.dilation_angle_deg, 0.0, 60.0)?
            * RAD_PER_DEG,
        tension_cutoff_pa: match &raw.tension_cutoff_kpa {
            CutoffText::Value(value) => Some(non_negative("soil.tension_cutoff_kpa", *value)? * PA_PER_KPA),
            CutoffText::Word(text) => word("soil.tension_cutoff_kpa", text, &[("apex", None)])?,
        },
        porosity: within(
            "soil.porosity",
            raw.porosity,
            raw.porosity > 0.0 && raw.porosity < 1.0,
            "it must be in (0, 1)",
        )?,
        permeability_m_s: positive("soil.permeability_m_s", raw.permeability_m_s)?,
    })
}

/// The solid's own weight must be positive: the total weight less that of the pores full of water.
fn check_weight(soil: &Soil, water: &Water, analysis: &Analysis) -> Checked<()> {
    let Some(weight) = soil.unit_weight_n_m3 else { return Ok(()) };
    let pore_water = soil.porosity * water.density_kg_m3 * analysis.gravity_m_s2;
    let allowed = format!("it must exceed the weight of the pore water, {:.3} kN/m3", pore_water / 1e3);
    within("soil.unit_weight_kn_m3", weight / 1e3, weight > pore_water, &allowed).map(|_| ())
}

fn check_water(raw: &WaterSection, slope: &Slope) -> Checked<Water> {
    let table = || -> Checked<WaterTable> {
        let why = "\"hydrostatic\" needs \"ground-surface\" or an elevation above the toe, m";
        match needed("water.water_table", raw.water_table.as_ref(), why)? {
            WaterTableText::Word(text) => {
                word("water.water_table", text, &[("ground-surface", WaterTable::GroundSurface)])
            }
            WaterTableText::Elevation(value) => Ok(WaterTable::ElevationM(between(
                "water.water_table",
                *value,
                -slope.foundation_depth_m,
                slope.height_m,
            )?)),
        }
    };
    let initial = match raw.initial_pore_pressure.as_str() {
        "hydrostatic" => InitialPorePressure::Hydrostatic(table()?),
        other => word(
            "water.initial_pore_pressure",
            other,
            &[
                ("none", InitialPorePressure::None),
                ("hydrostatic", InitialPorePressure::Hydrostatic(WaterTable::GroundSurface)),
            ],
        )?,
    };
    Ok(Water {
        density_kg_m3: positive("water.density_kg_m3", raw.density_kg_m3)?,
        bulk_modulus_pa: positive("water.bulk_modulus_mpa", raw.bulk_modulus_mpa)? * PA_PER_MPA,
        initial_pore_pressure: initial,
        ground_surface: word(
            "water.ground_surface",
            &raw.ground_surface,
            &[("drained", GroundSurface::Drained), ("closed", GroundSurface::Closed)],
        )?,
        cavitation_suction_pa: non_negative("water.cavitation_suction_kpa", raw.cavitation_suction_kpa)?
            * PA_PER_KPA,
    })
}

fn check_analysis(raw: &AnalysisSection) -> Checked<Analysis> {
    Ok(Analysis {
        formulation: word(
            "analysis.formulation",
            &raw.formulation,
            &[("one-phase", Formulation::OnePhase), ("two-phase", Formulation::TwoPhase)],
        )?,
        gravity_m_s2: between("analysis.gravity_m_s2", raw.gravity_m_s2, 1e-3, 1e3)?,
        courant_number: within(
            "analysis.courant_number",
            raw.courant_number,
            raw.courant_number > 0.0 && raw.courant_number <= 1.0,
            "it must be in (0, 1]",
        )?,
        volumetric_strain: word(
            "analysis.volumetric_strain",
            &raw.volumetric_strain,
            &[("cell-average", VolumetricStrain::CellAverage), ("point", VolumetricStrain::Point)],
        )?,
        pressure_relaxation_rate_per_s: non_negative(
            "analysis.pressure_relaxation_rate_per_s",
            raw.pressure_relaxation_rate_per_s,
        )?,
        pic_rate_per_s: non_negative("analysis.pic_rate_per_s", raw.pic_rate_per_s)?,
        velocity_filter: word(
            "analysis.velocity_filter",
            &raw.velocity_filter,
            &[("pic", VelocityFilter::Pic), ("xpic", VelocityFilter::Xpic)],
        )?,
        local_damping: share("analysis.local_damping", raw.local_damping)?,
        damping_rate_per_s: non_negative("analysis.damping_rate_per_s", raw.damping_rate_per_s)?,
        point_domain: word(
            "analysis.point_domain",
            &raw.point_domain,
            &[("uniform", PointDomain::Uniform), ("stretched", PointDomain::Stretched)],
        )?,
        gravity_stage_damping: share("analysis.gravity_stage_damping", raw.gravity_stage_damping)?,
        gravity_stage_s: positive("analysis.gravity_stage_s", raw.gravity_stage_s)?,
        duration_s: positive("analysis.duration_s", raw.duration_s)?,
        stop_at_rest: raw.stop_at_rest,
        rest_kinetic_energy_share: share(
            "analysis.rest_kinetic_energy_share",
            raw.rest_kinetic_energy_share,
        )?,
        rest_velocity_m_s: non_negative("analysis.rest_velocity_m_s", raw.rest_velocity_m_s)?,
        rest_hold_s: non_negative("analysis.rest_hold_s", raw.rest_hold_s)?,
        rest_pore_pressure_change_pa: positive(
            "analysis.rest_pore_pressure_change_kpa",
            raw.rest_pore_pressure_change_kpa,
        )? * PA_PER_KPA,
    })
}

fn check_sample(raw: &SampleSection) -> Checked<Sample> {
    let measures =
        [RunoutMeasure::DisplacementQ999, RunoutMeasure::MaxDisplacement, RunoutMeasure::ToeAdvance];
    Ok(Sample {
        measure: word("sample.measure", &raw.measure, &measures.map(|m| (m.name(), m)))?,
        threshold_m: non_negative("sample.threshold_m", raw.threshold_m)?,
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
