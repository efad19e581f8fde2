//! Dry granular columns that collapse on a rough plane.

mod lube;
mod rods;

pub(super) use lube::COLUMNS;
pub(super) use rods::RODS;

use super::set_up::{GRAVITY_M_S2, elastic_body, filled};
use crate::campaign::VolumetricStrain;
use crate::gimp::{Body, Grid, InitialPoints, Kernel, Setup, State, Support};

/// A rectangle of dry cohesionless soil between a smooth wall at x = 0 and a gate that vanishes at time 0, on a rough
/// rigid plane. Stresses at the start: weight of what lies above, times K0 = nu / (1 - nu) sideways (the confined elastic
/// column's own state, so that no gravity stage is needed).
#[derive(Debug, Clone, Copy)]
pub(in crate::validation) struct Column {
    pub(in crate::validation) width_m: f64,
    pub(in crate::validation) height_m: f64,
    pub(in crate::validation) friction_angle_deg: f64,
    pub(in crate::validation) density_kg_m3: f64,
    pub(in crate::validation) youngs_modulus_pa: f64,
    pub(in crate::validation) poissons_ratio: f64,
    pub(in crate::validation) cell_m: f64,
    pub(in crate::validation) pic_rate_per_s: f64,
    /// Room for the deposit, in widths.
    pub(in crate::validation) room_widths: f64,
}

/// Where the deposit lies.
#[derive(Debug, Clone)]
pub(in crate::validation) struct Deposit {
    /// Front of the contiguous deposit, m from the wall.
    pub(in crate::validation) front_m: f64,
    /// 99 % quantile of x over the points, m.
    pub(in crate::validation) front_q99_m: f64,
    /// Height at the wall, m.
    pub(in crate::validation) height_m: f64,
    /// Ground surface: middle and top of each column of cells, m.
    pub(in crate::validation) surface: Vec<[f64; 2]>,
}

impl Column {
    /// Time scale of the fall, s.
    pub(in crate::validation) fn time_s(&self) -> f64 {
        libm::sqrt(self.height_m / GRAVITY_M_S2)
    }

    /// Lets it collapse for `duration_s` and measures the deposit; absent if the analysis blows up or runs out of room.
    pub(in crate::validation) fn collapse(&self, duration_s: f64) -> Option<Deposit> {
        let mut body = Body::new(self.setup(), Kernel::best()).ok()?;
        while body.time_s() < duration_s {
            let dt = body.stable_step_s().min(duration_s - body.time_s());
            let report = body.step(dt);
            if report.left_grid || !report.kinetic_energy_j.is_finite() {
                return None;
            }
        }
        Some(self.deposit(&body.state()))
    }

    /// The front ends where the first column of cells is empty; a point counts as a square of its initial spacing.
    fn deposit(&self, state: &State) -> Deposit {
        let half = 0.25 * self.cell_m;
        let columns = (self.room_widths * self.width_m / self.cell_m).ceil() as usize;
        let mut edge = vec![f64::NEG_INFINITY; columns + 1];
        let mut top = edge.clone();
        let mut thickness = vec![0.0; columns + 1];
        for ((&x, &y), &v) in state.x.iter().zip(&state.y).zip(&state.volume) {
            let column = ((x / self.cell_m).max(0.0) as usize).min(columns);
            edge[column] = edge[column].max(x + half);
            top[column] = top[column].max(y + half);
            thickness[column] += v / self.cell_m;
        }
        let occupied = thickness.iter().take_while(|t| **t >= 0.5 * self.cell_m).count();
        let mut xs = state.x.clone();
        xs.sort_by(f64::total_cmp);
        Deposit {
            front_m: edge[..occupied].last().copied().unwrap_or(0.0),
            front_q99_m: xs[(0.99 * (xs.len() - 1) as f64) as usize],
            height_m: top[0],
            surface: (0..occupied).map(|k| [(k as f64 + 0.5) * self.cell_m, top[k]]).collect(),
        }
    }

    /// The column before the gate vanishes.
    pub(in crate::validation) fn setup(&self) -> Setup {
        let h = self.cell_m;
        let cells = |length: f64| (length / h).round() as usize;
        let positions = filled([0.0, 0.0], [cells(self.width_m), cells(self.height_m)], h);
        let mut points = InitialPoints::at_rest(&positions, 0.25 * h * h, self.density_kg_m3);
        let sideways = self.poissons_ratio / (1.0 - self.poissons_ratio);
        for i in 0..points.len() {
            let vertical = -self.density_kg_m3 * GRAVITY_M_S2 * (self.height_m - points.y[i]);
            points.stress[i] = [sideways * vertical, vertical, sideways * vertical, 0.0];
            points.cohesion[i] = 0.0;
            points.friction_angle[i] = self.friction_angle_deg.to_radians();
        }
        let room = [cells(self.room_widths * self.width_m), cells(self.height_m) + 4];
        let grid = Grid::enclosing(0.0, 0.0, room, h);
        let mut setup = elastic_body(grid, self.youngs_modulus_pa, self.poissons_ratio, points);
        setup.conditions.bottom = Support::Fixed;
        setup.conditions.gravity_m_s2 = [0.0, -GRAVITY_M_S2];
        setup.controls.volumetric_strain = VolumetricStrain::CellAverage;
        setup.controls.pic_rate_per_s = self.pic_rate_per_s;
        setup.controls.courant_number = 0.5;
        setup
    }
}
