//! The time loop: steps until rest, until the duration is over, or until something ends it.

use super::body::Body;
use super::rest::{RestRule, RestWatch, Stand};
use std::ops::ControlFlow;

/// How long a stage may last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Longest simulated time, s.
    pub duration_s: f64,
    /// Most steps.
    pub maximum_steps: u64,
    /// When to stop earlier; absent: never.
    pub rest: Option<RestRule>,
}

/// How a stage ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// The material has been at rest since this time, s.
    AtRest {
        /// Start of the time for which the rule for rest has held, s.
        since_s: f64,
    },
    /// The duration is over.
    Duration,
    /// The limit on steps was reached.
    StepLimit,
    /// The kinetic energy is no longer a finite number.
    NonFinite,
    /// A point has left the grid.
    LeftGrid,
    /// `each` asked to stop.
    Stopped,
}

/// Steps shorter than this share of the duration are not taken: they would only make up for round-off.
const LAST_STEP_SHARE: f64 = 1e-12;

/// Runs `body` for `limits`; `each` sees it after every step and may stop it.
pub fn run(body: &mut Body, limits: &Limits, each: &mut dyn FnMut(&Body) -> ControlFlow<()>) -> End {
    let start = body.time_s();
    let first_step = body.steps();
    let mut watch = limits.rest.map(|rule| {
        let mut stand = Stand::default();
        body.stand(&mut stand);
        RestWatch::new(rule, body.total_mass(), stand)
    });
    loop {
        let left = limits.duration_s - (body.time_s() - start);
        if left <= LAST_STEP_SHARE * limits.duration_s {
            return End::Duration;
        }
        if body.steps() - first_step >= limits.maximum_steps {
            return End::StepLimit;
        }
        let report = body.step(body.stable_step_s().min(left));
        if !report.kinetic_energy_j.is_finite() {
            return End::NonFinite;
        }
        if report.left_grid {
            return End::LeftGrid;
        }
        if each(body).is_break() {
            return End::Stopped;
        }
        let time = body.time_s() - start;
        let left = limits.duration_s - time;
        let since_s =
            watch.as_mut().and_then(|w| w.observe(time, left, report.kinetic_energy_j, |s| body.stand(s)));
        if let Some(since_s) = since_s {
            return End::AtRest { since_s };
        }
    }
}
