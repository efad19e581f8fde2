//! The soil properties of the material points in one realisation.

use super::{Prepared, Source};
use crate::site::Property;

const PA_PER_KPA: f64 = 1e3;
const N_PER_KN: f64 = 1e3;
const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// Properties of each point, in point order, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct PointProperties {
    /// Cohesion, Pa.
    pub cohesion_pa: Vec<f64>,
    /// Friction angle, rad.
    pub friction_angle_rad: Vec<f64>,
    /// Saturated unit weight, N/m3.
    pub unit_weight_n_m3: Vec<f64>,
}

impl Prepared {
    /// The properties of the points in `source`: random fields where the spec has them, constants elsewhere. They
    /// are what the distributions give and may lie outside what can be analysed.
    pub fn properties(&self, source: Source) -> PointProperties {
        let count = self.points.len();
        let soil = &self.spec.model.soil;
        let constant = |value: Option<f64>| vec![value.unwrap_or(f64::NAN); count];
        let mut properties = PointProperties {
            cohesion_pa: constant(soil.cohesion_pa),
            friction_angle_rad: constant(soil.friction_angle_rad),
            unit_weight_n_m3: constant(soil.unit_weight_n_m3),
        };
        let values = match (source, &self.fields) {
            (Source::Index(index), Some(plan)) => plan.sample(self.spec.seed, index).values,
            _ => self.spec.random.iter().map(|r| vec![r.marginal.mean(); count]).collect(),
        };
        for (random, values) in self.spec.random.iter().zip(values) {
            let (place, unit) = match random.property {
                Property::Cohesion => (&mut properties.cohesion_pa, PA_PER_KPA),
                Property::FrictionAngle => (&mut properties.friction_angle_rad, RAD_PER_DEG),
                Property::UnitWeight => (&mut properties.unit_weight_n_m3, N_PER_KN),
            };
            *place = values.into_iter().map(|value| value * unit).collect();
        }
        properties
    }

    /// Whether the unit weight differs from realisation to realisation.
    pub(super) fn unit_weight_is_random(&self) -> bool {
        self.spec.random.iter().any(|r| r.property == Property::UnitWeight)
    }
}
