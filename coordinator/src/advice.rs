//! What `runout check` says about a campaign beyond that it is sound: warnings, and the choices that move the answer.
//!
//! The thresholds are rules of thumb, named here; they stop nothing.

use crate::table::significant;
use runout_core::campaign::{
    Campaign, Contact, Formulation, GroundSurface, InitialPorePressure, InitialStress, Model, RunoutMeasure,
    Softening, StopRule, Surface, VolumetricStrain, WaterAboveTable,
};
use runout_core::estimate::interval;
use runout_core::slope;

/// A field changes by about a standard deviation over a scale of fluctuation: fewer points than this across it see
/// noise rather than a field.
const FEWEST_POINTS_A_SCALE: f64 = 4.0;
/// Slides of saturated soil ran up to about one and a half times their slope's height; the wall must not stop them.
const ROOM_IN_HEIGHTS: f64 = 2.0;
/// A slip surface needs room behind the crest: about a slope's height.
const CREST_IN_HEIGHTS: f64 = 1.0;
/// Fewer cells over the height than this smear a shear band over a large part of the slope.
const FEWEST_CELLS_A_HEIGHT: f64 = 15.0;
/// The paper's rule fires by chance without some patience: at a median of 67 samples for the mean's part alone.
const LEAST_PATIENCE: u64 = 10;

/// Coefficient of variation of runout before any is known: the paper's two examples have 0.46 and 0.64.
pub const LIKELY_VARIATION: f64 = 0.5;

/// Slides that the interval rule is likely to need: the half-width z cv / sqrt(n) of the mean and, for samples as
/// normal ones, z / sqrt(2 n) of the standard deviation, both relative. Absent for the paper's rule, which is met by
/// chance, and for a rule of exceedances alone, whose probabilities nobody knows beforehand.
pub fn likely_samples(rule: &StopRule) -> Option<u64> {
    let StopRule::Interval { confidence, mean_half_width, sd_half_width, .. } = rule else { return None };
    let z = interval::two_sided_z(*confidence);
    let of_mean = mean_half_width.map(|width| (z * LIKELY_VARIATION / width).powi(2));
    let of_sd = sd_half_width.map(|width| 0.5 * (z / width).powi(2));
    of_mean.into_iter().chain(of_sd).reduce(f64::max).map(|n| n.ceil() as u64)
}

/// What may be wrong although it is allowed.
pub fn warnings(campaign: &Campaign) -> Vec<String> {
    let model = &campaign.model;
    let mut warnings = Vec::new();
    let spacing = model.mesh.point_spacing_m();
    for (key, scale) in
        [("horizontal", model.field.scale_horizontal_m), ("vertical", model.field.scale_vertical_m)]
    {
        if scale < FEWEST_POINTS_A_SCALE * spacing {
            warnings.push(format!(
                "field.scale_of_fluctuation_{key}_m = {scale} is only {:.1} point spacings: the points see noise, not a field",
                scale / spacing
            ));
        }
    }
    if let Some(samples) =
        likely_samples(&campaign.stop.rule).filter(|n| *n > campaign.stop.maximum_realisations)
    {
        warnings.push(format!(
            "stop.maximum_realisations = {} is less than the about {samples} slides that the rule is likely to need: the \
             campaign may end without convergence",
            campaign.stop.maximum_realisations
        ));
    }
    let slope = &model.slope;
    let height = slope::height_m(slope);
    if slope.runout_plain_m < ROOM_IN_HEIGHTS * height {
        warnings.push(format!(
            "slope.runout_plain_m = {} is less than {ROOM_IN_HEIGHTS} slope heights: long slides may reach the wall",
            slope.runout_plain_m
        ));
    }
    let crest_width = slope::crest_edge_x(slope) - slope::rear_x(slope);
    if crest_width < CREST_IN_HEIGHTS * height {
        let key = match slope.surface {
            Surface::Uniform { .. } => "slope.crest_width_m =",
            Surface::Profile { .. } => "the profile's ground behind slope.crest_x_m, m:",
        };
        let shown = significant(crest_width, 4);
        warnings.push(format!(
            "{key} {shown} is less than the slope's height: the rear wall may cut slip surfaces"
        ));
    }
    let cells = height / model.mesh.cell_size_m;
    if cells < FEWEST_CELLS_A_HEIGHT {
        warnings.push(format!(
            "{cells:.0} cells over the slope's height: shear bands are smeared, and runout depends on the cell size"
        ));
    }
    if let StopRule::Paper { patience, relative, .. } = campaign.stop.rule
        && patience < LEAST_PATIENCE
    {
        let absolute =
            if relative { "" } else { ", and an absolute tolerance ignores how far the slides run" };
        warnings.push(format!(
            "stop.patience = {patience}: the paper's rule can be met by chance{absolute}; the report gives intervals"
        ));
    }
    if model.analysis.formulation == Formulation::TwoPhase {
        if model.analysis.volumetric_strain == VolumetricStrain::Point {
            warnings.push(
                "analysis.volumetric_strain = \"point\": two-phase points lock, runout comes out short"
                    .to_owned(),
            );
        }
        if model.analysis.pressure_relaxation_rate_per_s == 0.0 {
            warnings.push(
                "analysis.pressure_relaxation_rate_per_s = 0: pore pressures of two-phase points oscillate and may blow up"
                    .to_owned(),
            );
        }
    }
    warnings
}

/// The choices that are known to move runout by tens of percent or more, as made in this campaign.
pub fn choices(campaign: &Campaign) -> Vec<String> {
    let model = &campaign.model;
    let analysis = &model.analysis;
    let mut choices = vec![match analysis.formulation {
        Formulation::OnePhase => "one phase: total unit weight, no pore pressure".to_owned(),
        Formulation::TwoPhase => {
            let start = match &model.water.initial_pore_pressure {
                InitialPorePressure::None => {
                    "no pore pressure at the start, so that only excess pore pressure develops \
                     (a water table at the ground surface multiplies runout)"
                }
                InitialPorePressure::Hydrostatic(_) => {
                    "hydrostatic pore pressure below a water table at the start"
                }
            };
            let free = model.water.free_water_level_m.map_or_else(String::new, |level| {
                format!("; free water stands {} m above the toe", significant(level, 4))
            });
            let surface = match model.water.ground_surface {
                GroundSurface::Drained => "drained",
                GroundSurface::Closed => "closed",
            };
            let above = match model.water.above_table {
                WaterAboveTable::Held => "the skeleton holds the water above the table",
                WaterAboveTable::Sinks => "the water above the table sinks, which raises the pressure below",
            };
            format!("two phases: {start}{free}; {above}; the ground surface is {surface}")
        }
    }];
    if analysis.volumetric_strain == VolumetricStrain::Point {
        choices.push("each point's own volumetric strain: stiffer than the cell average".to_owned());
    }
    choices.push(format!(
        "damping: local_damping = {}, pic_rate_per_s = {}, damping_rate_per_s = {} (all shorten runout)",
        analysis.local_damping, analysis.pic_rate_per_s, analysis.damping_rate_per_s
    ));
    choices.push(
        match model.sample.measure {
            RunoutMeasure::DisplacementQ999 => "runout is the 99.9 % quantile of displacement",
            RunoutMeasure::MaxDisplacement => {
                "runout is the largest displacement of any point: a single sprayed point can set it"
            }
            RunoutMeasure::ToeAdvance => {
                "runout is the advance of the contiguous front, some metres less than displacement"
            }
        }
        .to_owned(),
    );
    choices.extend(ground_choices(model));
    let bands = if softening_materials(model).is_empty() {
        "there is no softening length, so that bands are as wide as cells"
    } else {
        "bands are as wide as cells; softening goes with the displacement across them"
    };
    let (size, side) = (model.mesh.cell_size_m, model.mesh.points_per_cell_side);
    choices.push(format!("cell size {size} m and {} points a cell: {bands}", side * side));
    choices
}

/// Softening, layers, base, obstacles and in-situ stresses.
fn ground_choices(model: &Model) -> Vec<String> {
    let mut choices = Vec::new();
    for (name, s) in softening_materials(model) {
        choices.push(format!(
            "{name}strength softens to {} of the cohesion and {} of the friction angle, most of it within {} m of shear",
            s.residual_cohesion_ratio, s.residual_friction_ratio, s.displacement_m
        ));
    }
    if let Contact::Friction(coefficient) = model.slope.base {
        choices.push(format!(
            "the soil can slide on the rigid base with a friction coefficient of {coefficient}"
        ));
    }
    match model.obstacles.len() {
        0 => {}
        1 => choices.push("a rigid obstacle stands in the way".to_owned()),
        n => choices.push(format!("{n} rigid obstacles stand in the way")),
    }
    if let InitialStress::K0(ratio) = model.analysis.initial_stress {
        choices.push(format!(
            "in-situ stresses by K0 = {ratio}: not in equilibrium under inclined ground, which the start of the failure \
             stage makes up for by moving"
        ));
    }
    choices
}

/// The softening of the materials that soften, with their names if they are layers.
fn softening_materials(model: &Model) -> Vec<(String, Softening)> {
    let name = |i: usize| model.layers.get(i).map_or_else(String::new, |layer| format!("{}: ", layer.name));
    let softens = |s: &Softening| s.residual_cohesion_ratio < 1.0 || s.residual_friction_ratio < 1.0;
    let materials = model.materials().into_iter().enumerate();
    materials.filter_map(|(i, soil)| soil.softening.filter(softens).map(|s| (name(i), s))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_likely_number_is_that_of_the_widest_interval() {
        let rule = |mean_half_width, sd_half_width| StopRule::Interval {
            confidence: 0.95,
            mean_half_width,
            sd_half_width,
            exceedance: Vec::new(),
        };
        // (1.95996 * 0.5 / 0.05)^2 = 384.1 and (1.95996 / 0.15)^2 / 2 = 85.4.
        assert_eq!(likely_samples(&rule(Some(0.05), Some(0.15))), Some(385));
        assert_eq!(likely_samples(&rule(None, Some(0.15))), Some(86));
        assert_eq!(likely_samples(&rule(None, None)), None);
    }
}
