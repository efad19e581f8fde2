//! One analysis: gravity stage, then failure stage.

use super::progress::{Cancelled, Progress};
use super::{PointProperties, Prepared, record};
use crate::campaign::{Formulation, GroundSurface, InitialPorePressure, Model};
use crate::gimp::{
    self, Body, Conditions, Controls, End, Fluid, InitialPoints, Limits, Material, MaterialError, RestRule,
    Setup, State, Support,
};
use crate::outcome::{Outcome, Reason};
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
enum Interruption {
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
    /// Whether the material still moved when the duration was over.
    pub(super) moving: bool,
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
        let start = match self.gravity_state(&properties, progress) {
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

    /// The end of the gravity stage: computed, or kept from an earlier realisation.
    fn gravity_state(
        &self,
        properties: &PointProperties,
        progress: &Progress,
    ) -> Result<State, Interruption> {
        if let Some(state) = self.gravity.get() {
            return Ok(state.clone());
        }
        let state = self.gravity_stage(properties, progress)?;
        if !self.unit_weight_is_random() {
            // Another thread may have been first; its state has the same bits.
            let _ = self.gravity.set(state.clone());
        }
        Ok(state)
    }

    /// Elastic, drained, total weight, damped.
    fn gravity_stage(
        &self,
        properties: &PointProperties,
        progress: &Progress,
    ) -> Result<State, Interruption> {
        let model = &self.spec.model;
        let positions: Vec<[f64; 2]> =
            self.points.x.iter().zip(&self.points.y).map(|(&x, &y)| [x, y]).collect();
        let volume = self.points.spacing_m * self.points.spacing_m;
        let mut points = InitialPoints::at_rest(&positions, volume, 0.0);
        points.density =
            properties.unit_weight_n_m3.iter().map(|w| w / model.analysis.gravity_m_s2).collect();
        let mut setup = self.setup(points);
        setup.controls.formulation = Formulation::OnePhase;
        setup.controls.local_damping = model.analysis.gravity_stage_damping;
        let mut body = Body::new(setup, self.kernel)?;
        let limits =
            Limits { duration_s: model.analysis.gravity_stage_s, maximum_steps: u64::MAX, rest: None };
        let end = gimp::run(&mut body, &limits, &mut |body| {
            progress.advance(body.steps(), 0.0);
            if progress.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        match end {
            End::Duration | End::AtRest { .. } | End::StepLimit => Ok(body.state()),
            End::NonFinite => Err(Interruption::Failed(Reason::NonFinite)),
            End::LeftGrid => Err(Interruption::Failed(Reason::LeftGrid)),
            End::Stopped => Err(Interruption::Cancelled),
        }
    }

    /// Real strengths and pore water, from the gravity stage's stresses at rest.
    fn failure_stage(
        &self,
        start: &State,
        properties: &PointProperties,
        every_s: f64,
        observer: &mut dyn FnMut(&Snapshot<'_>),
        progress: &Progress,
    ) -> Result<Failure, Interruption> {
        let analysis = &self.spec.model.analysis;
        let mut body = Body::new(self.setup(self.failure_points(start, properties)), self.kernel)?;
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
        let mut next_observation = 1;
        // The last stretch of the duration tells whether the material still moves.
        let stretch_start = analysis.duration_s - analysis.rest_hold_s;
        let mut before_stretch: Option<(f64, Vec<[f64; 2]>)> = None;
        if every_s.is_finite() {
            self.observe(0.0, start, body.state(), properties, observer);
        }
        let end = gimp::run(&mut body, &limits, &mut |body| {
            progress.advance(steps_before + body.steps(), body.time_s());
            if body.time_s() >= f64::from(next_observation) * every_s {
                self.observe(body.time_s(), start, body.state(), properties, observer);
                next_observation = (body.time_s() / every_s).floor() as u32 + 1;
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
        Ok(Failure { end, simulated_s: body.time_s(), steps: body.steps(), moving, state })
    }

    fn observe(
        &self,
        time_s: f64,
        start: &State,
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

    /// The failure stage's points: effective stress is total stress plus the initial pore pressure.
    fn failure_points(&self, start: &State, properties: &PointProperties) -> InitialPoints {
        let model = &self.spec.model;
        let volume = self.points.spacing_m * self.points.spacing_m;
        let count = self.points.len();
        let pressure: Vec<f64> = (0..count).map(|i| self.initial_pressure(i)).collect();
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
            stress: (0..count)
                .map(|i| {
                    let p = pressure[i];
                    [
                        start.stress_xx[i] + p,
                        start.stress_yy[i] + p,
                        start.stress_zz[i] + p,
                        start.stress_xy[i],
                    ]
                })
                .collect(),
            pressure,
            cohesion: properties.cohesion_pa.clone(),
            friction_angle: properties.friction_angle_rad.clone(),
            material: vec![0; count],
            water_held: vec![false; count],
            force: vec![[0.0; 2]; count],
        }
    }

    /// Initial pore pressure of point `i`, Pa; there is none without water.
    fn initial_pressure(&self, i: usize) -> f64 {
        let model = &self.spec.model;
        match (model.analysis.formulation, model.water.initial_pore_pressure) {
            (Formulation::TwoPhase, InitialPorePressure::Hydrostatic(table)) => slope::hydrostatic_pressure(
                &model.slope,
                &model.water,
                table,
                model.analysis.gravity_m_s2,
                self.points.x[i],
                self.points.y[i],
            ),
            _ => 0.0,
        }
    }

    /// The spec's slope with these points: rigid fixed base, rollers left and right, failure stage's controls.
    fn setup(&self, points: InitialPoints) -> Setup {
        let Model { mesh, soil, water, analysis, .. } = &self.spec.model;
        Setup {
            grid: self.grid,
            points_per_cell_side: mesh.points_per_cell_side,
            conditions: Conditions {
                left: Support::Roller,
                right: Support::Roller,
                bottom: Support::Fixed,
                top: Support::Open,
                gravity_m_s2: [0.0, -analysis.gravity_m_s2],
                closed_surface: water.ground_surface == GroundSurface::Closed,
                free_water_level_m: None,
            },
            obstacles: Vec::new(),
            fluid: Fluid {
                density_kg_m3: water.density_kg_m3,
                bulk_modulus_pa: water.bulk_modulus_pa,
                cavitation_suction_pa: water.cavitation_suction_pa,
                gravity_m_s2: analysis.gravity_m_s2,
            },
            materials: vec![Material {
                youngs_modulus_pa: soil.youngs_modulus_pa,
                poissons_ratio: soil.poissons_ratio,
                dilation_angle_rad: soil.dilation_angle_rad,
                tension_cutoff_pa: soil.tension_cutoff_pa,
                softening: None,
                porosity: soil.porosity,
                permeability_m_s: soil.permeability_m_s,
            }],
            controls: Controls {
                formulation: analysis.formulation,
                volumetric_strain: analysis.volumetric_strain,
                pressure_relaxation_rate_per_s: analysis.pressure_relaxation_rate_per_s,
                pic_rate_per_s: analysis.pic_rate_per_s,
                velocity_filter: analysis.velocity_filter,
                local_damping: analysis.local_damping,
                damping_rate_per_s: analysis.damping_rate_per_s,
                point_domain: analysis.point_domain,
                courant_number: analysis.courant_number,
            },
            points,
        }
    }
}
