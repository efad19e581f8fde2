//! `[soil]` and `[[layers]]`: the materials.

use super::ground::boundary;
use super::{
    Checked, PA_PER_KPA, PA_PER_MPA, RAD_PER_DEG, between, non_negative, positive, refuse, within, word,
};
use crate::campaign::file::{CutoffText, LayerSection, SofteningSection, SoilSection};
use crate::campaign::{Analysis, Layer, Softening, Soil, Water};
use crate::site::Property;

/// Most layers: the points count them in 16 bits, and nobody draws more by hand.
const MOST_LAYERS: usize = 1000;

/// The soil under the name of `key`, with the properties in `random` left to the random fields; `why` says why a
/// property that is not there must be given.
fn check_constants(key: &str, raw: &SoilSection, random: &[Property], why: &str) -> Checked<Soil> {
    let at = |name: &str| format!("{key}.{name}");
    let constant = |p: Property, value: Option<f64>, unit: f64| -> Checked<Option<f64>> {
        let key = at(p.name());
        match (random.contains(&p), value) {
            (true, None) => Ok(None),
            (false, Some(value)) => Ok(Some(non_negative(&key, value)? * unit)),
            (true, Some(value)) => Err(refuse(&key, value, "it is a random property: leave it out here")),
            (false, None) => Err(refuse(&key, "(absent)", why)),
        }
    };
    let unit_weight = constant(Property::UnitWeight, raw.unit_weight_kn_m3, 1e3)?;
    let friction = constant(Property::FrictionAngle, raw.friction_angle_deg, RAD_PER_DEG)?;
    if let Some(angle) = raw.friction_angle_deg {
        between(&at("friction_angle_deg"), angle, 0.0, 80.0)?;
    }
    let (poisson, porosity) = (raw.poissons_ratio, raw.porosity);
    Ok(Soil {
        youngs_modulus_pa: positive(&at("youngs_modulus_mpa"), raw.youngs_modulus_mpa)? * PA_PER_MPA,
        poissons_ratio: within(
            &at("poissons_ratio"),
            poisson,
            (0.0..0.5).contains(&poisson),
            "it must be in [0, 0.5)",
        )?,
        cohesion_pa: constant(Property::Cohesion, raw.cohesion_kpa, PA_PER_KPA)?,
        friction_angle_rad: friction,
        unit_weight_n_m3: unit_weight,
        dilation_angle_rad: between(&at("dilation_angle_deg"), raw.dilation_angle_deg, 0.0, 60.0)?
            * RAD_PER_DEG,
        tension_cutoff_pa: match &raw.tension_cutoff_kpa {
            CutoffText::Value(value) => Some(non_negative(&at("tension_cutoff_kpa"), *value)? * PA_PER_KPA),
            CutoffText::Word(text) => word(&at("tension_cutoff_kpa"), text, &[("apex", None)])?,
        },
        softening: raw.softening.map(|s| check_softening(&at("softening"), s)).transpose()?,
        porosity: within(
            &at("porosity"),
            porosity,
            porosity > 0.0 && porosity < 1.0,
            "it must be in (0, 1)",
        )?,
        permeability_m_s: positive(&at("permeability_m_s"), raw.permeability_m_s)?,
    })
}

fn check_softening(key: &str, raw: SofteningSection) -> Checked<Softening> {
    let ratio = |name: &str, value: f64| between(&format!("{key}.{name}"), value, 0.0, 1.0);
    Ok(Softening {
        residual_cohesion_ratio: ratio("residual_cohesion_ratio", raw.residual_cohesion_ratio)?,
        residual_friction_ratio: ratio("residual_friction_ratio", raw.residual_friction_ratio)?,
        residual_dilation_ratio: ratio("residual_dilation_ratio", raw.residual_dilation_ratio)?,
        displacement_m: positive(&format!("{key}.displacement_m"), raw.displacement_m)?,
    })
}

/// `[soil]`: what the whole ground is made of, or what the layers share.
pub(super) fn check_soil(raw: &SoilSection, random: &[Property]) -> Checked<Soil> {
    check_constants("soil", raw, random, "it is not a random property: give its value")
}

/// The layers, complete with what they share; `origin`: the toe in the file's coordinates.
pub(super) fn check_layers(
    raw: &[LayerSection],
    soil: &SoilSection,
    random: &[Property],
    origin: [f64; 2],
) -> Checked<Vec<Layer>> {
    if raw.len() > MOST_LAYERS {
        return Err(refuse("layers", raw.len(), &format!("at most {MOST_LAYERS} are supported")));
    }
    if !raw.is_empty() && !raw.iter().any(|layer| layer.random) {
        let allowed = "at least one layer must have random = true, or nothing is random";
        return Err(refuse("layers", "(none is random)", allowed));
    }
    let mut layers: Vec<Layer> = Vec::with_capacity(raw.len());
    for (i, layer) in raw.iter().enumerate() {
        if layer.name.trim().is_empty() || layers.iter().any(|other| other.name == layer.name) {
            let value = format!("\"{}\"", layer.name);
            return Err(refuse(
                &format!("layers[{}].name", i + 1),
                value,
                "each layer needs a name of its own",
            ));
        }
        let key = format!("layers.{}", layer.name);
        let last = i + 1 == raw.len();
        let bottom = match (&layer.bottom, last) {
            (Some(line), false) => Some(boundary(&format!("{key}.bottom"), line, origin)?),
            (None, true) => None,
            (Some(_), true) => {
                let allowed = "the last layer reaches to the base: leave it out";
                return Err(refuse(&format!("{key}.bottom"), "a value", allowed));
            }
            (None, false) => {
                let allowed = "a layer above another needs an elevation or a line [[x, y], ...]";
                return Err(refuse(&format!("{key}.bottom"), "(absent)", allowed));
            }
        };
        let soil = check_layer_soil(&key, layer, soil, random)?;
        layers.push(Layer { name: layer.name.clone(), bottom, soil });
    }
    Ok(layers)
}

fn check_layer_soil(
    key: &str,
    layer: &LayerSection,
    soil: &SoilSection,
    random: &[Property],
) -> Checked<Soil> {
    // A random property's constant is the layer's own or absent; any other is shared unless the layer gives it.
    let own = |p: Property, value: Option<f64>, shared: Option<f64>| {
        if random.contains(&p) { value } else { value.or(shared) }
    };
    let complete = SoilSection {
        youngs_modulus_mpa: layer.youngs_modulus_mpa.unwrap_or(soil.youngs_modulus_mpa),
        poissons_ratio: layer.poissons_ratio.unwrap_or(soil.poissons_ratio),
        cohesion_kpa: own(Property::Cohesion, layer.cohesion_kpa, soil.cohesion_kpa),
        friction_angle_deg: own(Property::FrictionAngle, layer.friction_angle_deg, soil.friction_angle_deg),
        unit_weight_kn_m3: own(Property::UnitWeight, layer.unit_weight_kn_m3, soil.unit_weight_kn_m3),
        dilation_angle_deg: layer.dilation_angle_deg.unwrap_or(soil.dilation_angle_deg),
        tension_cutoff_kpa: layer.tension_cutoff_kpa.as_ref().unwrap_or(&soil.tension_cutoff_kpa).clone(),
        softening: layer.softening.or(soil.softening),
        porosity: layer.porosity.unwrap_or(soil.porosity),
        permeability_m_s: layer.permeability_m_s.unwrap_or(soil.permeability_m_s),
    };
    let random = if layer.random { random } else { &[] };
    check_constants(key, &complete, random, "the layer is not random: give its value")
}

/// The solid's own weight must be positive: the total weight less that of the pores full of water; under free water the
/// whole must weigh more than the water it displaces.
pub(super) fn check_weights(
    soil: &Soil,
    layers: &[Layer],
    water: &Water,
    analysis: &Analysis,
) -> Checked<()> {
    check_weight("soil", soil, water, analysis)?;
    layers.iter().try_for_each(|l| check_weight(&format!("layers.{}", l.name), &l.soil, water, analysis))
}

fn check_weight(key: &str, soil: &Soil, water: &Water, analysis: &Analysis) -> Checked<()> {
    let Some(weight) = soil.unit_weight_n_m3 else { return Ok(()) };
    let of_water = water.density_kg_m3 * analysis.gravity_m_s2;
    let (least, what) = match water.free_water_level_m {
        Some(_) => (of_water, "the free water"),
        None => (soil.porosity * of_water, "the pore water"),
    };
    let allowed = format!("it must exceed the weight of {what}, {:.3} kN/m3", least / 1e3);
    within(&format!("{key}.unit_weight_kn_m3"), weight / 1e3, weight > least, &allowed).map(|_| ())
}
