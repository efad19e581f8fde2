//! One analysis: from the in-situ state through the failure stage.

use super::insitu::InSitu;
use super::progress::{Cancelled, Progress};
use super::{PointProperties, Prepared, record};
use crate::campaign::{Formulation, WaterAboveTable};
use crate::gimp::{self, Body, End, Energy, InitialPoints, Limits, MaterialError, RestRule, State};
use crate::outcome::{Outcome, Reason};
use crate::profile::{LOOK_EVERY_S, Profile, Recorder, Stations};
use crate::slope;
use std::ops::ControlFlow;

/// Where the soil properties come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The random fields of this realisation.
    Index(u64),
    /// Every random property at its marginal's mean.
    Deterministic,
}

/// The points at one moment of the failure stage, in point order.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot<'a> {
    /// Time since the start of the failure stage, s.
    pub time_s: f64,
    /// Positions at the start of the failure stage, m.
    pub x0: &'a [f64],
    /// Positions at the start of the failure stage, m.
    pub y0: &'a [f64],
    /// Displacements since then, m.
    pub ux: &'a [f64],
    /// Displacements since then, m.
    pub uy: &'a [f64],
    /// Positions, velocities, effective stresses, pore pressures, porosities, volumes, plastic strains.
    pub state: &'a State,
    /// Strength and unit weight.
    pub properties: &'a PointProperties,
}

/// Why there is no end of a stage.
pub(super) enum Interruption {
    Cancelled,
    Failed(Reason),
}

impl From<MaterialError> for Interruption {
    fn from(_: MaterialError) -> Self {
        Interruption::Failed(Reason::BadMaterial)
    }
}

/// How the failure stage ended.
pub(super) struct Failure {
    pub(super) state: State,
    pub(super) end: End,
    pub(super) simulated_s: f64,
    pub(super) steps: u64,
    pub(super) energy: Energy,
    /// Whether the material still moved when the duration was over.
    pub(super) moving: bool,
    /// Present if the campaign asks for it.
    pub(super) profile: Option<Profile>,
}

/// Tells the first step at or after every multiple of a time.
struct Every {
    time_s: f64,
    next: u32,
}

impl Every {
    fn new(time_s: f64) -> Every {
        Every { time_s, next: 1 }
    }

    fn is_due(&mut self, now_s: f64) -> bool {
        let due = now_s >= f64::from(self.next) * self.time_s;
        if due {
            self.next = (now_s / self.time_s).floor() as u32 + 1;
        }
        due
    }
}

impl Prepared {
    /// Runs one analysis; `observer` sees the points at the start of the failure stage, at the first step at or after
    /// every multiple of `every_s`, and at the end. Observing moves no outcome.
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` was asked to stop.
    pub fn analyse(
        &self,
        source: Source,
        every_s: f64,
        observer: &mut dyn FnMut(&Snapshot<'_>),
        progress: &Progress,
    ) -> Result<Outcome, Cancelled> {
        let index = match source {
            Source::Index(index) => index,
            Source::Deterministic => 0,
        };
        let properties = self.properties(source);
        let start = match self.in_situ(&properties, progress) {
            Ok(state) => state,
            Err(Interruption::Cancelled) => return Err(Cancelled),
            Err(Interruption::Failed(reason)) => return Ok(record::unstarted(self, index, reason)),
        };
        match self.failure_stage(&start, &properties, every_s, observer, progress) {
            Ok(failure) => Ok(record::outcome(self, index, &start, &failure)),
            Err(Interruption::Cancelled) => Err(Cancelled),
            Err(Interruption::Failed(reason)) => Ok(record::unstarted(self, index, reason)),
        }
    }

    /// Real strengths and pore water, from the in-situ state at rest.
    fn failure_stage(
        &self,
        start: &InSitu,
        properties: &PointProperties,
        every_s: f64,
        observer: &mut dyn FnMut(&Snapshot<'_>),
        progress: &Progress,
    ) -> Result<Failure, Interruption> {
        let analysis = &self.spec.model.analysis;
        let mut body = Body::new(self.failure_setup(self.failure_points(start, properties)), self.kernel)?;
        body.set_threads(self.threads.clone());
        let rest = RestRule {
            kinetic_energy_share: analysis.rest_kinetic_energy_share,
            velocity_m_s: analysis.rest_velocity_m_s,
            hold_s: analysis.rest_hold_s,
            pressure_change_pa: analysis.rest_pore_pressure_change_pa,
        };
        let limits = Limits {
            duration_s: analysis.duration_s,
            maximum_steps: self.spec.model.maximum_steps,
            rest: analysis.stop_at_rest.then_some(rest),
        };
        let steps_before = progress.steps();
        let (mut observed, mut looked) = (Every::new(every_s), Every::new(LOOK_EVERY_S));
        let model = &self.spec.model;
        let mut recorder =
            model.sample.profile.then(|| Recorder::new(Stations::of(&model.slope, &model.mesh)));
        // The last stretch of the duration tells whether the material still moves.
        let stretch_start = analysis.duration_s - analysis.rest_hold_s;
        let mut before_stretch: Option<(f64, Vec<[f64; 2]>)> = None;
        if every_s.is_finite() {
            self.observe(0.0, start, body.state(), properties, observer);
        }
        let end = gimp::run(&mut body, &limits, &mut |body| {
            progress.advance(steps_before + body.steps(), body.time_s());
            if observed.is_due(body.time_s()) {
                self.observe(body.time_s(), start, body.state(), properties, observer);
            }
            if let Some(recorder) = recorder.as_mut().filter(|_| looked.is_due(body.time_s())) {
                recorder.look(body.motion());
            }
            if before_stretch.is_none() && body.time_s() >= stretch_start {
                before_stretch = Some((body.time_s(), body.positions()));
            }
            if progress.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        if end == End::Stopped {
            return Err(Interruption::Cancelled);
        }
        let state = body.state();
        if every_s.is_finite() {
            self.observe(body.time_s(), start, state.clone(), properties, observer);
        }
        let moving = before_stretch.is_some_and(|(since, before)| {
            gimp::net_velocity(&before, &body.positions(), body.time_s() - since) > analysis.rest_velocity_m_s
        });
        Ok(Failure {
            end,
            simulated_s: body.time_s(),
            steps: body.steps(),
            energy: body.energy(),
            moving,
            profile: recorder.map(|mut recorder| {
                recorder.look(body.motion());
                recorder.finish()
            }),
            state,
        })
    }

    fn observe(
        &self,
        time_s: f64,
        start: &InSitu,
        state: State,
        properties: &PointProperties,
        observer: &mut dyn FnMut(&Snapshot<'_>),
    ) {
        let less = |now: &[f64], before: &[f64]| -> Vec<f64> {
            now.iter().zip(before).map(|(a, b)| a - b).collect()
        };
        let (ux, uy) = (less(&state.x, &start.x), less(&state.y, &start.y));
        let snapshot =
            Snapshot { time_s, x0: &start.x, y0: &start.y, ux: &ux, uy: &uy, state: &state, properties };
        observer(&snapshot);
    }

    /// The failure stage's points.
    pub(super) fn failure_points(&self, start: &InSitu, properties: &PointProperties) -> InitialPoints {
        let model = &self.spec.model;
        let volume = self.points.spacing_m * self.points.spacing_m;
        let count = self.points.len();
        let may_hold = model.analysis.formulation == Formulation::TwoPhase
            && model.water.above_table == WaterAboveTable::Held;
        InitialPoints {
            x: start.x.clone(),
            y: start.y.clone(),
            velocity: vec![[0.0; 2]; count],
            // The mass stays; the volume is that of the loaded state.
            density: (0..count)
                .map(|i| {
                    properties.unit_weight_n_m3[i] / model.analysis.gravity_m_s2 * volume / start.volume[i]
                })
                .collect(),
            volume: start.volume.clone(),
            stress: start.stress.clone(),
            pressure: start.pressure.clone(),
            cohesion: properties.cohesion_pa.clone(),
            friction_angle: properties.friction_angle_rad.clone(),
            material: self.materials.clone(),
            water_held: (0..count).map(|i| may_hold && self.is_water_held(i)).collect(),
            force: vec![[0.0; 2]; count],
        }
    }

    /// Whether point `i` starts above the water table: its water can hang in the skeleton, whose effective stresses carry
    /// its weight from the start.
    fn is_water_held(&self, i: usize) -> bool {
        let water = &self.spec.model.water;
        let level = slope::water::pressure_level_m(&self.spec.model.slope, water, self.points.x[i]);
        level.is_none_or(|level| self.points.y[i] >= level)
    }
}
