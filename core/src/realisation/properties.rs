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
    /// Place of the material among [`crate::campaign::Model::materials`].
    pub material: Vec<u16>,
}

impl Prepared {
    /// The properties of the points in `source`: each material's constants, and the random fields where it has none.
    /// They are what the distributions give and may lie outside what can be analysed.
    pub fn properties(&self, source: Source) -> PointProperties {
        let count = self.points.len();
        let values = match (source, &self.fields) {
            (Source::Index(index), Some(plan)) => plan.sample(self.spec.seed, index).values,
            _ => self.spec.random.iter().map(|r| vec![r.marginal.mean(); count]).collect(),
        };
        let materials = self.spec.model.materials();
        let of_points = |property: Property, unit: f64| {
            let constants: Vec<Option<f64>> = materials.iter().map(|soil| soil.constant(property)).collect();
            let random = self.spec.random.iter().position(|r| r.property == property);
            let field = |i: usize| random.map_or(f64::NAN, |j| values[j][i] * unit);
            let at = |i: usize| constants[usize::from(self.materials[i])].unwrap_or_else(|| field(i));
            (0..count).map(at).collect()
        };
        PointProperties {
            cohesion_pa: of_points(Property::Cohesion, PA_PER_KPA),
            friction_angle_rad: of_points(Property::FrictionAngle, RAD_PER_DEG),
            unit_weight_n_m3: of_points(Property::UnitWeight, N_PER_KN),
            material: self.materials.clone(),
        }
    }

    /// Whether the unit weight of any point differs from realisation to realisation.
    pub(super) fn unit_weight_is_random(&self) -> bool {
        self.spec.model.materials().iter().any(|soil| soil.unit_weight_n_m3.is_none())
    }
}
