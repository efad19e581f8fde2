//! What a slide can be coloured by.

use super::{edge_units, property_label};
use crate::picture::soil::range;
use clap::ValueEnum;
use colorous::Gradient;
use runout_core::realisation::Snapshot;
use runout_core::site::Property;

const PER_KILO: f64 = 1e-3;

/// A quantity on the material points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Colour {
    /// Displacement since failure began
    Displacement,
    /// Speed
    Speed,
    /// Equivalent plastic strain
    PlasticStrain,
    /// Pore pressure, compression positive
    PorePressure,
    /// Mean effective stress, compression positive
    MeanStress,
    /// Largest shear stress in the section
    ShearStress,
    /// Porosity
    Porosity,
    /// Cohesion before softening
    Cohesion,
    /// Friction angle before softening
    FrictionAngle,
    /// Unit weight
    UnitWeight,
}

impl Colour {
    /// The name on the command line and of files.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Name and unit at the colour bar.
    pub fn label(self) -> &'static str {
        match self {
            Colour::Displacement => "displacement (m)",
            Colour::Speed => "speed (m/s)",
            Colour::PlasticStrain => "plastic strain",
            Colour::PorePressure => "pore pressure (kPa)",
            Colour::MeanStress => "mean effective stress (kPa)",
            Colour::ShearStress => "largest shear stress (kPa)",
            Colour::Porosity => "porosity",
            Colour::Cohesion => property_label(Property::Cohesion),
            Colour::FrictionAngle => property_label(Property::FrictionAngle),
            Colour::UnitWeight => property_label(Property::UnitWeight),
        }
    }

    /// What the picture shows, in a sentence's words.
    pub fn in_words(self) -> &'static str {
        match self {
            Colour::Displacement => "displacement of every material point",
            Colour::PlasticStrain => "equivalent plastic strain",
            other => other.label().split(" (").next().unwrap_or_default(),
        }
    }

    /// Colour map, and whether it is turned round: all are perceptually uniform.
    pub fn gradient(self) -> (Gradient, bool) {
        match self {
            // What has not sheared is light, shear bands are dark.
            Colour::PlasticStrain => (colorous::INFERNO, true),
            Colour::Speed => (colorous::MAGMA, false),
            _ => (colorous::VIRIDIS, false),
        }
    }

    /// The ends of the colour bar for these values.
    pub fn range(self, values: &[f64]) -> (f64, f64) {
        match self {
            Colour::PlasticStrain => (0.0, strain_top(values)),
            Colour::Displacement | Colour::Speed | Colour::ShearStress => range(values, true),
            _ => range(values, false),
        }
    }

    /// The quantity at the points.
    pub fn values(self, snapshot: &Snapshot<'_>) -> Vec<f64> {
        let state = snapshot.state;
        let length = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect();
        let property = |property| edge_units(property, snapshot.properties);
        let of_stress = |f: &dyn Fn([f64; 4]) -> f64| -> Vec<f64> {
            let stress =
                |i: usize| [state.stress_xx[i], state.stress_yy[i], state.stress_zz[i], state.stress_xy[i]];
            (0..state.x.len()).map(|i| PER_KILO * f(stress(i))).collect()
        };
        match self {
            Colour::Displacement => length(snapshot.ux, snapshot.uy),
            Colour::Speed => length(&state.vx, &state.vy),
            Colour::PlasticStrain => state.plastic_strain.clone(),
            Colour::PorePressure => state.pressure.iter().map(|p| PER_KILO * p).collect(),
            // Tension is positive in the solver.
            Colour::MeanStress => of_stress(&|[xx, yy, zz, _]| -(xx + yy + zz) / 3.0),
            Colour::ShearStress => of_stress(&|[xx, yy, _, xy]| (0.5 * (xx - yy)).hypot(xy)),
            Colour::Porosity => state.porosity.clone(),
            Colour::Cohesion => property(Property::Cohesion),
            Colour::FrictionAngle => property(Property::FrictionAngle),
            Colour::UnitWeight => property(Property::UnitWeight),
        }
    }
}

/// The 99.5 % quantile: shear bands are thin, and a few torn points would darken all others.
fn strain_top(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let place = (0.995 * sorted.len().saturating_sub(1) as f64) as usize;
    sorted.get(place).copied().filter(|top| *top > 0.0).unwrap_or(1.0)
}
