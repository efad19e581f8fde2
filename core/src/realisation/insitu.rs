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
use super::{PointProperties, Prepared, Source};
use crate::campaign::{Formulation, InitialStress};
use crate::gimp::{self, Body, End, InitialPoints, Limits};
use crate::outcome::Reason;
use crate::slope::water;
use std::ops::ControlFlow;
use std::sync::Arc;

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

/// Length of the gravity stage from the stresses of the mean unit weights, as a share of that from none.
///
/// Those stresses are off by some 2 % of the largest, which a stage from none takes a good part of its time to come down
/// to. Measured on salt-creek (unit weight varying by 8 %) against a stage of 6 s: after a third of its 1.5 s the
/// settled stresses are off by 1.4e-3 of the largest at most and 7e-5 in the root mean square (0.8 m cells; 1.8e-2 and
/// 5e-4 on 0.4 m cells, 1.2e-2 and 5e-4 with a tenth of the stiffness), the whole stage's by 1.6e-3 and 7e-5 (2.0e-2
/// and 6e-4, 1.2e-2 and 9e-4). Slides of 1.7 to 7.6 m ran as far as from the whole stage to 1.3e-4 of their length, what
/// creeps by 0.07 to 2 m to 1 %; stages of 6 s for 1.5 s change the latter by half as much.
const SETTLING_SHARE: f64 = 1.0 / 3.0;

impl Prepared {
    /// The in-situ state of points with these properties. That of the mean unit weights is kept: without random unit
    /// weight it is every realisation's, else the gravity stages of all realisations start from it.
    pub(super) fn in_situ(
        &self,
        properties: &PointProperties,
        progress: &Progress,
    ) -> Result<Arc<InSitu>, Interruption> {
        if !self.unit_weight_is_random() {
            return self.kept_in_situ(properties, progress);
        }
        let mean = self.properties(Source::Deterministic);
        if properties.unit_weight_n_m3 == mean.unit_weight_n_m3 {
            return self.kept_in_situ(&mean, progress);
        }
        let analysis = &self.spec.model.analysis;
        Ok(Arc::new(match analysis.initial_stress {
            InitialStress::Gravity => {
                let start = self.kept_in_situ(&mean, progress)?;
                let duration_s = SETTLING_SHARE * analysis.gravity_stage_s;
                self.gravity_stage(self.settling_points(properties, &start), duration_s, progress)?
            }
            InitialStress::K0(ratio) => self.at_rest_pressure(properties, ratio),
        }))
    }

    /// The in-situ state of the mean unit weights, which `properties` have: computed, or kept from an earlier realisation.
    fn kept_in_situ(
        &self,
        properties: &PointProperties,
        progress: &Progress,
    ) -> Result<Arc<InSitu>, Interruption> {
        if let Some(state) = self.in_situ.get() {
            return Ok(state.clone());
        }
        let analysis = &self.spec.model.analysis;
        let state = Arc::new(match analysis.initial_stress {
            InitialStress::Gravity => {
                self.gravity_stage(self.gravity_points(properties), analysis.gravity_stage_s, progress)?
            }
            InitialStress::K0(ratio) => self.at_rest_pressure(properties, ratio),
        });
        // Another thread may have been first; its state has the same bits.
        Ok(self.in_situ.get_or_init(|| state).clone())
    }

    pub(super) fn gravity_stage(
        &self,
        points: InitialPoints,
        duration_s: f64,
        progress: &Progress,
    ) -> Result<InSitu, Interruption> {
        let limits = Limits { duration_s, maximum_steps: u64::MAX, rest: None };
        let steps_before = progress.steps();
        let mut body = Body::new(self.gravity_setup(points), self.kernel)?;
        body.set_threads(self.threads.clone());
        let end = gimp::run(&mut body, &limits, &mut |body| {
            progress.advance(steps_before + body.steps(), 0.0);
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

    /// The gravity stage's points with their own weights, where and stressed as the mean weights left them in `start`.
    fn settling_points(&self, properties: &PointProperties, start: &InSitu) -> InitialPoints {
        let mut points = self.gravity_points(properties);
        for i in 0..points.len() {
            let more = start.pressure[i] - self.free_water_pressure(i);
            let [xx, yy, zz, xy] = start.stress[i];
            points.stress[i] = [xx - more, yy - more, zz - more, xy];
            points.density[i] *= points.volume[i] / start.volume[i];
        }
        InitialPoints { x: start.x.clone(), y: start.y.clone(), volume: start.volume.clone(), ..points }
    }

    /// Elastic and unstressed; below free water less the weight of the water that they displace.
    pub(super) fn gravity_points(&self, properties: &PointProperties) -> InitialPoints {
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
