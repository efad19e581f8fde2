//! The in-situ state: where the points are and how they are stressed when failure begins.
//!
//! By a gravity stage: the elastic, drained ground under its weight, damped to rest. Under free water the stage sees
//! sigma + P I in place of the total stress sigma, P = rho_w g (level - y) being the free water's pressure carried on
//! into the ground: its divergence takes the weight of the water from all ground below the level, and the ground
//! surface is free of load. The effective stress is that sum plus p - P.
//!
//! Or by K0: total vertical stress from the weight of the points above in the same column and of the free water on top
//! of it; horizontal effective stress K0 times the vertical (Jaky 1944 relates it to the friction angle); no shear.

use super::analysis::Interruption;
use super::progress::Progress;
use super::{PointProperties, Prepared};
use crate::campaign::{Formulation, InitialStress};
use crate::gimp::{self, Body, End, InitialPoints, Limits};
use crate::outcome::Reason;
use crate::slope::water;
use std::ops::ControlFlow;

/// The points when failure begins, at rest, in point order.
#[derive(Debug, Clone)]
pub(super) struct InSitu {
    /// Position, m.
    pub(super) x: Vec<f64>,
    /// Position, m.
    pub(super) y: Vec<f64>,
    /// Volume, m2.
    pub(super) volume: Vec<f64>,
    /// Effective stress xx, yy, zz, xy (total, if there is one phase), tension positive, Pa.
    pub(super) stress: Vec<[f64; 4]>,
    /// Pore pressure, Pa.
    pub(super) pressure: Vec<f64>,
}

impl Prepared {
    /// The in-situ state: computed, or kept from an earlier realisation.
    pub(super) fn in_situ(
        &self,
        properties: &PointProperties,
        progress: &Progress,
    ) -> Result<InSitu, Interruption> {
        if let Some(state) = self.in_situ.get() {
            return Ok(state.clone());
        }
        let state = match self.spec.model.analysis.initial_stress {
            InitialStress::Gravity => self.gravity_stage(properties, progress)?,
            InitialStress::K0(ratio) => self.at_rest_pressure(properties, ratio),
        };
        if !self.unit_weight_is_random() {
            // Another thread may have been first; its state has the same bits.
            let _ = self.in_situ.set(state.clone());
        }
        Ok(state)
    }

    fn gravity_stage(
        &self,
        properties: &PointProperties,
        progress: &Progress,
    ) -> Result<InSitu, Interruption> {
        let limits = Limits {
            duration_s: self.spec.model.analysis.gravity_stage_s,
            maximum_steps: u64::MAX,
            rest: None,
        };
        let mut body = Body::new(self.gravity_setup(self.gravity_points(properties)), self.kernel)?;
        let end = gimp::run(&mut body, &limits, &mut |body| {
            progress.advance(body.steps(), 0.0);
            if progress.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        match end {
            End::Duration | End::AtRest { .. } | End::StepLimit => {}
            End::NonFinite => return Err(Interruption::Failed(Reason::NonFinite)),
            End::LeftGrid => return Err(Interruption::Failed(Reason::LeftGrid)),
            End::Stopped => return Err(Interruption::Cancelled),
        }
        let state = body.state();
        let pressure = self.initial_pressures();
        let stress = (0..self.points.len())
            .map(|i| {
                let more = pressure[i] - self.free_water_pressure(i);
                [
                    state.stress_xx[i] + more,
                    state.stress_yy[i] + more,
                    state.stress_zz[i] + more,
                    state.stress_xy[i],
                ]
            })
            .collect();
        Ok(InSitu { x: state.x, y: state.y, volume: state.volume, stress, pressure })
    }

    /// Elastic and unstressed; below free water less the weight of the water that they displace.
    fn gravity_points(&self, properties: &PointProperties) -> InitialPoints {
        let model = &self.spec.model;
        let positions: Vec<[f64; 2]> =
            self.points.x.iter().zip(&self.points.y).map(|(&x, &y)| [x, y]).collect();
        let volume = self.points.spacing_m * self.points.spacing_m;
        let size = self.points.spacing_m;
        let buoyancy = |y: f64| water::submerged_share(&model.water, y, size) * model.water.density_kg_m3;
        let weights = properties.unit_weight_n_m3.iter().zip(&self.points.y);
        InitialPoints {
            density: weights.map(|(w, &y)| w / model.analysis.gravity_m_s2 - buoyancy(y)).collect(),
            material: self.materials.clone(),
            ..InitialPoints::at_rest(&positions, volume, 0.0)
        }
    }

    /// K0: column by column from the top.
    pub(super) fn at_rest_pressure(&self, properties: &PointProperties, ratio: f64) -> InSitu {
        let points = &self.points;
        let model = &self.spec.model;
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|&a, &b| points.x[a].total_cmp(&points.x[b]).then(points.y[b].total_cmp(&points.y[a])));
        let pressure = self.initial_pressures();
        let mut stress = vec![[0.0; 4]; points.len()];
        let (mut column, mut overburden) = (f64::NAN, 0.0);
        for i in order {
            if points.x[i] != column {
                column = points.x[i];
                // The free water on top weighs as much as its pressure at half a point above the first.
                let top = points.y[i] + 0.5 * points.spacing_m;
                let depth = model.water.free_water_level_m.map_or(0.0, |level| (level - top).max(0.0));
                overburden = model.water.density_kg_m3 * model.analysis.gravity_m_s2 * depth;
            }
            let weight = properties.unit_weight_n_m3[i] * points.spacing_m;
            let vertical = overburden + 0.5 * weight - pressure[i];
            stress[i] = [-ratio * vertical, -vertical, -ratio * vertical, 0.0];
            overburden += weight;
        }
        let volume = vec![points.spacing_m * points.spacing_m; points.len()];
        InSitu { x: points.x.clone(), y: points.y.clone(), volume, stress, pressure }
    }

    /// Initial pore pressures, Pa; there are none without water.
    fn initial_pressures(&self) -> Vec<f64> {
        let model = &self.spec.model;
        let gravity = model.analysis.gravity_m_s2;
        let points = &self.points;
        if model.analysis.formulation == Formulation::OnePhase {
            return vec![0.0; points.len()];
        }
        let at = |x, y| water::initial_pressure(&model.slope, &model.water, gravity, x, y, points.spacing_m);
        points.x.iter().zip(&points.y).map(|(&x, &y)| at(x, y)).collect()
    }

    fn free_water_pressure(&self, i: usize) -> f64 {
        let model = &self.spec.model;
        water::free_water_pressure(
            &model.water,
            model.analysis.gravity_m_s2,
            self.points.y[i],
            self.points.spacing_m,
        )
    }
}
