//! Which soil decides: rank correlation of the runout with the spatial mean of each random property, zone by zone.
//!
//! A realisation's fields follow from its index, so that they are drawn again here without any analysis. Zones are the
//! layers, and parts of the section: behind the crest's edge, under the upper and the lower half of the face, and below
//! toe level.

use super::picks;
use rayon::prelude::*;
use runout_core::campaign::Model;
use runout_core::estimate::interval::{Interval, two_sided_z};
use runout_core::fit::spearman;
use runout_core::outcome::{Outcome, OutcomeKind};
use runout_core::realisation::{PointProperties, Prepared, Source};
use runout_core::seed::Purpose;
use runout_core::site::Property;
use runout_core::slope;

/// Most realisations whose fields are drawn: their correlation is then known to about 0.04.
const MOST_REALISATIONS: usize = 2_000;

/// Fewest realisations of which a correlation is given.
const FEWEST_REALISATIONS: usize = 10;

/// Variance of Fisher's transform of Spearman's rho times n - 3 (Fieller, Hartley & Pearson 1957).
const SPEARMAN_VARIANCE: f64 = 1.06;

/// A rank correlation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correlation {
    /// Spearman's rho.
    pub rho: f64,
    /// Its interval by Fisher's transform.
    pub interval: Interval,
}

/// One property in one zone.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence {
    /// Property.
    pub property: Property,
    /// Zone.
    pub zone: String,
    /// Share of the points at which the property is random that lie in the zone.
    pub share: f64,
    /// With the runout measure of all realisations, stable ones included.
    pub of_all: Option<Correlation>,
    /// With the runout of the samples alone.
    pub of_samples: Option<Correlation>,
}

/// All of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sensitivity {
    /// Property by property, zone by zone.
    pub influences: Vec<Influence>,
    /// Realisations whose fields were drawn.
    pub realisations: usize,
    /// Samples among them.
    pub samples: usize,
    /// Confidence level of the intervals.
    pub confidence: f64,
}

/// Relates the outcomes' runout to their fields; nothing is found if nothing is random.
pub fn sensitivity(prepared: &Prepared, outcomes: &[Outcome], confidence: f64) -> Sensitivity {
    let spec = prepared.spec();
    let measure = spec.model.sample.measure;
    let runout = |o: &Outcome| o.measures.as_ref().map(|m| measure.of(m)).filter(|r| r.is_finite());
    let decided: Vec<(u64, bool, f64)> = outcomes
        .iter()
        .filter_map(|o| Some((o.index, o.outcome == OutcomeKind::Runout, runout(o)?)))
        .collect();
    let indices: Vec<u64> = decided.iter().map(|d| d.0).collect();
    let chosen = picks::chosen(&indices, MOST_REALISATIONS, spec.seed, Purpose::ReportSensitivity);
    let used: Vec<(u64, bool, f64)> =
        decided.into_iter().filter(|d| chosen.binary_search(&d.0).is_ok()).collect();
    let parts: Vec<(Property, Zone)> = spec
        .random
        .iter()
        .flat_map(|random| zones(prepared, random.property).into_iter().map(|zone| (random.property, zone)))
        .collect();
    let means: Vec<Vec<f64>> = used
        .par_iter()
        .map(|(index, ..)| {
            let properties = prepared.properties(Source::Index(*index));
            parts.iter().map(|(property, zone)| zone.mean(values(&properties, *property))).collect()
        })
        .collect();
    let correlation = |part: usize, samples_only: bool| {
        let kept = || used.iter().zip(&means).filter(|(d, _)| d.1 || !samples_only);
        let of_zone: Vec<f64> = kept().map(|(_, means)| means[part]).collect();
        let runouts: Vec<f64> = kept().map(|(d, _)| d.2).collect();
        correlation(&of_zone, &runouts, confidence)
    };
    let influences = parts.iter().enumerate().map(|(part, (property, zone))| Influence {
        property: *property,
        zone: zone.name.clone(),
        share: zone.share,
        of_all: correlation(part, false),
        of_samples: correlation(part, true),
    });
    Sensitivity {
        influences: influences.collect(),
        realisations: used.len(),
        samples: used.iter().filter(|d| d.1).count(),
        confidence,
    }
}

/// Spearman's rho with its interval; absent with too few values.
fn correlation(x: &[f64], y: &[f64], confidence: f64) -> Option<Correlation> {
    if x.len() < FEWEST_REALISATIONS {
        return None;
    }
    let rho = spearman(x, y);
    let half = two_sided_z(confidence) * (SPEARMAN_VARIANCE / (x.len() as f64 - 3.0)).sqrt();
    let ends = [rho.atanh() - half, rho.atanh() + half].map(f64::tanh);
    Some(Correlation { rho, interval: ends })
}

/// Some of the material points.
struct Zone {
    name: String,
    points: Vec<usize>,
    share: f64,
}

impl Zone {
    fn mean(&self, values: &[f64]) -> f64 {
        self.points.iter().map(|i| values[*i]).sum::<f64>() / self.points.len() as f64
    }
}

fn values(properties: &PointProperties, property: Property) -> &[f64] {
    match property {
        Property::Cohesion => &properties.cohesion_pa,
        Property::FrictionAngle => &properties.friction_angle_rad,
        Property::UnitWeight => &properties.unit_weight_n_m3,
    }
}

/// The zones in which `property` is random at some points.
fn zones(prepared: &Prepared, property: Property) -> Vec<Zone> {
    let model = &prepared.spec().model;
    let materials = model.materials();
    let points = prepared.layout();
    let random: Vec<usize> = (0..points.len())
        .filter(|i| materials[usize::from(prepared.materials()[*i])].constant(property).is_none())
        .collect();
    let place = |i: usize| part(model, points.x[i], points.y[i]).to_owned();
    let layer = |i: usize| {
        let layer = model.layers.get(usize::from(prepared.materials()[i]));
        format!("layer {}", layer.map_or("", |layer| layer.name.as_str()))
    };
    let mut zones = vec![Zone { name: "whole section".to_owned(), points: random.clone(), share: 1.0 }];
    for name in PARTS {
        add(&mut zones, name, &random, &place);
    }
    if model.layers.len() > 1 {
        for name in model.layers.iter().map(|layer| format!("layer {}", layer.name)) {
            add(&mut zones, &name, &random, &layer);
        }
    }
    zones.retain(|zone| !zone.points.is_empty());
    zones
}

fn add(zones: &mut Vec<Zone>, name: &str, random: &[usize], of: &dyn Fn(usize) -> String) {
    let points: Vec<usize> = random.iter().copied().filter(|i| of(*i) == name).collect();
    let share = points.len() as f64 / random.len().max(1) as f64;
    zones.push(Zone { name: name.to_owned(), points, share });
}

const PARTS: [&str; 4] = [
    "behind the crest's edge",
    "under the face, upper half",
    "under the face, lower half",
    "below toe level",
];

/// The part of the section in which a point lies.
fn part(model: &Model, x: f64, y: f64) -> &'static str {
    if y < 0.0 || x > 0.0 {
        PARTS[3]
    } else if x <= slope::crest_edge_x(&model.slope) {
        PARTS[0]
    } else if y >= 0.5 * slope::height_m(&model.slope) {
        PARTS[1]
    } else {
        PARTS[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n = 28: the half-width of Fisher's transform is 1.95996 sqrt(1.06 / 25) = 0.403582, so that an uncorrelated pair's
    /// interval ends at tanh of that, 0.383009.
    #[test]
    fn intervals_follow_fishers_transform() {
        let x: Vec<f64> = (0..28).map(f64::from).collect();
        let same = correlation(&x, &x, 0.95).unwrap();
        assert_eq!(same.rho, 1.0);
        // Ranks that rise and fall: no correlation with the index.
        let tent: Vec<f64> = (0..28).map(|i| f64::from(if i < 14 { i } else { 27 - i })).collect();
        let none = correlation(&x, &tent, 0.95).unwrap();
        assert!(none.rho.abs() < 1e-12, "{}", none.rho);
        assert!((none.interval[1] - 0.383_009).abs() < 1e-6, "{:?}", none.interval);
        assert_eq!(correlation(&x[..9], &x[..9], 0.95), None);
    }
}
