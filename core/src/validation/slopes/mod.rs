//! Whole slopes: onset of failure, convergence, damping, and how stiff the pore water must be.
//!
//! All cases start from one homogeneous slope of the paper's size (H 15 m, rigid rough base at toe level, E 100 MPa,
//! nu 0.35, no dilation) and change what they are about. [`Slide::model`] is the only place that knows a campaign.

mod consolidation;
mod convergence;
mod damping;
mod log_spiral;
mod onset;
mod submerged;
mod water_modulus;

pub(super) use convergence::CONVERGENCE;
pub(super) use damping::DAMPING;
pub(super) use onset::ONSET;
pub(super) use submerged::SUBMERGED;
pub(super) use water_modulus::WATER_MODULUS;

use crate::campaign::{self, Model};
use crate::copula::Copula;
use crate::gimp::Kernel;
use crate::outcome::{Measures, Outcome, Reason};
use crate::realisation::{Prepared, Progress};
use crate::spec::{SPEC_FORMAT, Spec};
use crate::validation::{Check, Comparison};

/// A homogeneous slope and how it is analysed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slide {
    pub(super) height_m: f64,
    pub(super) angle_deg: f64,
    pub(super) crest_width_m: f64,
    pub(super) runout_plain_m: f64,
    pub(super) cohesion_kpa: f64,
    pub(super) friction_angle_deg: f64,
    pub(super) unit_weight_kn_m3: f64,
    pub(super) permeability_m_s: f64,
    pub(super) cell_m: f64,
    pub(super) two_phase: bool,
    /// The key `water.initial_pore_pressure`, and what belongs to it.
    pub(super) water: &'static str,
    pub(super) water_modulus_mpa: f64,
    pub(super) cavitation_suction_kpa: f64,
    pub(super) courant: f64,
    pub(super) pic_rate_per_s: f64,
    pub(super) local_damping: f64,
    pub(super) damping_rate_per_s: f64,
    pub(super) duration_s: f64,
}

/// No net pore pressure at the start.
pub(super) const NO_PORE_PRESSURE: &str = "initial_pore_pressure = \"none\"";

/// Example I of the reference paper with its printed mean strength, one phase, total weight: a clear failure (factor
/// of safety 0.845 by limit analysis). PIC at the rate that takes half a per cent a step at 0.4 m cells.
pub(super) const EXAMPLE_I: Slide = Slide {
    height_m: 15.0,
    angle_deg: 45.0,
    crest_width_m: 19.4,
    runout_plain_m: 30.0,
    cohesion_kpa: 11.41,
    friction_angle_deg: 21.14,
    unit_weight_kn_m3: 20.0,
    permeability_m_s: 1e-4,
    cell_m: 0.4,
    two_phase: false,
    water: NO_PORE_PRESSURE,
    water_modulus_mpa: 400.0,
    cavitation_suction_kpa: 100.0,
    courant: 0.8,
    pic_rate_per_s: 4.4,
    local_damping: 0.0,
    damping_rate_per_s: 0.0,
    duration_s: 10.0,
};

impl Slide {
    /// The model that a campaign with these inputs has.
    pub(super) fn model(&self) -> Model {
        let text = self.text();
        let mut model = match campaign::parse(&text) {
            Ok(campaign) => campaign.model,
            Err(error) => panic!("the validation's campaign is wrong: {error}\n{text}"),
        };
        model.soil.friction_angle_rad = Some(self.friction_angle_deg.to_radians());
        model
    }

    fn text(&self) -> String {
        let numbers = [
            ("{height_m}", self.height_m),
            ("{angle_deg}", self.angle_deg),
            ("{crest_width_m}", self.crest_width_m),
            ("{runout_plain_m}", self.runout_plain_m),
            ("{cohesion_kpa}", self.cohesion_kpa),
            ("{unit_weight_kn_m3}", self.unit_weight_kn_m3),
            ("{permeability_m_s}", self.permeability_m_s),
            ("{cell_m}", self.cell_m),
            ("{water_modulus_mpa}", self.water_modulus_mpa),
            ("{cavitation_suction_kpa}", self.cavitation_suction_kpa),
            ("{courant}", self.courant),
            ("{pic_rate_per_s}", self.pic_rate_per_s),
            ("{local_damping}", self.local_damping),
            ("{damping_rate_per_s}", self.damping_rate_per_s),
            ("{duration_s}", self.duration_s),
        ];
        let formulation = if self.two_phase { "two-phase" } else { "one-phase" };
        let words =
            include_str!("slope.toml").replace("{formulation}", formulation).replace("{water}", self.water);
        numbers.iter().fold(words, |text, (place, number)| text.replace(place, &format!("{number:?}")))
    }

    /// The spec of the homogeneous slope: nothing is random.
    pub(super) fn spec(&self) -> Spec {
        Spec {
            format: SPEC_FORMAT,
            seed: 1,
            random: Vec::new(),
            copula: Copula::Independent { dimension: 0 },
            model: self.model(),
        }
    }

    /// Runs it with the fastest kernel.
    pub(super) fn run(&self) -> Outcome {
        self.run_with(Kernel::best())
    }

    /// Runs it with `kernel`.
    pub(super) fn run_with(&self, kernel: Kernel) -> Outcome {
        let prepared = Prepared::new(self.spec(), kernel).expect("the validation's slope has points");
        prepared.deterministic(&Progress::default()).expect("nobody cancels a validation case")
    }
}

/// Example I in two phases: more room to run, and PIC at the rate that takes half a per cent of the shorter step.
pub(super) const TWO_PHASE: Slide =
    Slide { two_phase: true, pic_rate_per_s: 13.0, runout_plain_m: 40.0, ..EXAMPLE_I };

/// The 99.9 % quantile of displacement, m; not a number if the analysis failed, so that no check passes.
pub(super) fn runout_m(outcome: &Outcome) -> f64 {
    outcome.measures.as_ref().map_or(f64::NAN, |m: &Measures| m.displacement_q999_m)
}

/// How an analysis ended, for notes.
pub(super) fn ending(outcome: &Outcome) -> &'static str {
    if outcome.reason == Reason::StillMoving { "still moving at the end" } else { outcome.reason.name() }
}

/// A check, in one line.
pub(super) fn check(
    what: impl Into<String>,
    unit: &'static str,
    reference: f64,
    found: f64,
    comparison: Comparison,
) -> Check {
    Check { what: what.into(), unit, reference, found, comparison }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slide_becomes_the_model_it_says() {
        let model = Slide { two_phase: true, cell_m: 0.8, ..EXAMPLE_I }.model();
        assert_eq!(model.mesh.cell_size_m, 0.8);
        assert_eq!(model.soil.cohesion_pa, Some(11.41e3));
        assert!((model.soil.friction_angle_rad.unwrap().to_degrees() - 21.14).abs() < 1e-12);
        assert_eq!(model.water.bulk_modulus_pa, 4e8);
        assert!(!EXAMPLE_I.text().contains('{'), "{}", EXAMPLE_I.text());
    }
}
