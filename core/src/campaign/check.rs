//! From the raw campaign file to a checked [`Campaign`]: ranges, words, units.

use super::file::{
    AnalysisSection, CampaignFile, CopulaChoiceText, CutoffText, FieldSection, FitSection,
    MarginalChoiceText, MeshSection, RunSection, SampleSection, SiteSection, SlopeSection, SoilSection,
    StopSection, WaterSection, WaterTableText, ZeroRuleText,
};
use super::{
    Analysis, Autocorrelation, Campaign, CampaignError, CopulaChoice, Criterion, ExceedanceTarget, Field,
    FitSettings, Formulation, GroundSurface, InitialPorePressure, MarginalChoice, Mesh, Model, OnFailure,
    Recipe, Run, RunoutMeasure, Sample, Site, Slope, Soil, Stop, StopRule, VolumetricStrain, Water,
    WaterTable,
};
use crate::copula;
use crate::marginal::{self, Marginal};
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
        fit: check_fit(&file.fit, &random, site.is_some())?,
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
        stop: check_stop(&file.stop)?,
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

fn check_fit(raw: &FitSection, random: &[Property], measured: bool) -> Checked<FitSettings> {
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
        local_damping: share("analysis.local_damping", raw.local_damping)?,
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

fn check_stop(raw: &StopSection) -> Checked<Stop> {
    let minimum = at_least("stop.minimum_realisations", raw.minimum_realisations, 1)?;
    Ok(Stop {
        rule: match raw.rule.as_str() {
            "paper" => paper_rule(raw)?,
            "interval" => interval_rule(raw)?,
            other => {
                word("stop.rule", other, &[("paper", ()), ("interval", ())]).and_then(|()| paper_rule(raw))?
            }
        },
        minimum_realisations: minimum,
        maximum_realisations: at_least("stop.maximum_realisations", raw.maximum_realisations, minimum)?,
    })
}

fn paper_rule(raw: &StopSection) -> Checked<StopRule> {
    let foreign = [
        ("stop.confidence", raw.confidence.is_some()),
        ("stop.mean_half_width", raw.mean_half_width.is_some()),
        ("stop.sd_half_width", raw.sd_half_width.is_some()),
        ("stop.exceedance", !raw.exceedance.is_empty()),
    ];
    refuse_foreign(&foreign, "it belongs to rule \"interval\"")?;
    let why = "rule \"paper\" needs it";
    Ok(StopRule::Paper {
        tolerance: positive("stop.tolerance", needed("stop.tolerance", raw.tolerance, why)?)?,
        relative: needed("stop.relative", raw.relative, why)?,
        patience: at_least("stop.patience", needed("stop.patience", raw.patience, why)?, 1)?,
    })
}

fn interval_rule(raw: &StopSection) -> Checked<StopRule> {
    let foreign = [
        ("stop.tolerance", raw.tolerance.is_some()),
        ("stop.relative", raw.relative.is_some()),
        ("stop.patience", raw.patience.is_some()),
    ];
    refuse_foreign(&foreign, "it belongs to rule \"paper\"")?;
    let confidence = needed("stop.confidence", raw.confidence, "rule \"interval\" needs it")?;
    let mut exceedance = Vec::new();
    for target in &raw.exceedance {
        exceedance.push(ExceedanceTarget {
            distance_m: non_negative("stop.exceedance.distance_m", target.distance_m)?,
            half_width: positive("stop.exceedance.half_width", target.half_width)?,
        });
    }
    if raw.mean_half_width.is_none() && raw.sd_half_width.is_none() && exceedance.is_empty() {
        let allowed = "give mean_half_width, sd_half_width or [[stop.exceedance]]";
        return Err(refuse("stop.mean_half_width", "(absent)", allowed));
    }
    Ok(StopRule::Interval {
        confidence: within(
            "stop.confidence",
            confidence,
            (0.5..1.0).contains(&confidence),
            "it must be in [0.5, 1)",
        )?,
        mean_half_width: raw.mean_half_width.map(|v| positive("stop.mean_half_width", v)).transpose()?,
        sd_half_width: raw.sd_half_width.map(|v| positive("stop.sd_half_width", v)).transpose()?,
        exceedance,
    })
}

fn refuse_foreign(keys: &[(&str, bool)], allowed: &str) -> Checked<()> {
    match keys.iter().find(|(_, present)| *present) {
        Some((key, _)) => Err(refuse(key, "a value", allowed)),
        None => Ok(()),
    }
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
