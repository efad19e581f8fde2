//! A failure stage whose steps can be timed: what a realisation costs, without running one.
//!
//! It starts from what every realisation has (points, weights, mean strengths) and from stresses guessed in place of a
//! gravity stage's. Its steps do the work of a realisation's first ones and are as long; where it goes means nothing.

use super::{Prepared, Source};
use crate::gimp::Body;

/// Ratio of horizontal to vertical effective stress that is guessed: a friction angle of 30 degrees by Jaky (1944).
const GUESSED_K0: f64 = 0.5;

/// A failure stage under way.
#[derive(Debug)]
pub struct Trial(Body);

impl Prepared {
    /// A failure stage at its start; `None` if it cannot be analysed at mean properties.
    pub fn trial(&self) -> Option<Trial> {
        let properties = self.properties(Source::Deterministic);
        let start = self.at_rest_pressure(&properties, GUESSED_K0);
        let setup = self.failure_setup(self.failure_points(&start, &properties));
        Body::new(setup, self.kernel).ok().map(Trial)
    }
}

impl Trial {
    /// Takes one step, as long as the Courant number allows; returns its length, s.
    pub fn step(&mut self) -> f64 {
        let dt_s = self.0.stable_step_s();
        self.0.step(dt_s);
        dt_s
    }
}
