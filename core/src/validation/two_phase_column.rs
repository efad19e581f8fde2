//! Finite differences for the v-w equations of a saturated column in one dimension: the reference for its waves.
//!
//! Independent of the material point method: a staggered mesh that moves with the skeleton, velocities at its
//! nodes, stress and pressure in its cells, leapfrog in time with point-implicit drag; small strains, top
//! drained, base rigid and impervious.

/// Constants of the column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    /// Height, m.
    pub(super) height: f64,
    /// Porosity.
    pub(super) porosity: f64,
    /// Density of the grains, kg/m3.
    pub(super) grains: f64,
    /// Density of the water, kg/m3.
    pub(super) water: f64,
    /// Bulk modulus of the water, Pa.
    pub(super) water_bulk: f64,
    /// Constrained modulus of the skeleton, Pa.
    pub(super) constrained: f64,
    /// Hydraulic conductivity, m/s.
    pub(super) permeability: f64,
    /// Gravity in the definition of the hydraulic conductivity, m/s2.
    pub(super) gravity: f64,
}

impl Column {
    /// Total density, kg/m3.
    pub(super) fn density(&self) -> f64 {
        (1.0 - self.porosity) * self.grains + self.porosity * self.water
    }

    /// Speed of the undrained wave, m/s.
    pub(super) fn undrained_wave(&self) -> f64 {
        ((self.constrained + self.water_bulk / self.porosity) / self.density()).sqrt()
    }

    /// Speed of the fast wave without drag: the largest eigenvalue of M^-1 K (Zienkiewicz et al. 1999), m/s.
    pub(super) fn fast_wave(&self) -> f64 {
        let (n, storage) = (self.porosity, self.water_bulk / self.porosity);
        let (skeleton, water) = ((1.0 - n) * self.grains, n * self.water);
        let a = (self.constrained + (1.0 - n) * (1.0 - n) * storage) / skeleton;
        let b = n * n * storage / water;
        let product = (n * (1.0 - n) * storage) * (n * (1.0 - n) * storage) / (skeleton * water);
        (0.5 * (a + b) + (0.25 * (a - b) * (a - b) + product).sqrt()).sqrt()
    }
}

/// Pore pressures at `depths` and `times` under `load` (Pa, by time) on the top: one row a time.
pub(super) fn pressures(
    column: &Column,
    cells: usize,
    load: &dyn Fn(f64) -> f64,
    times: &[f64],
    depths: &[f64],
) -> Vec<Vec<f64>> {
    let n = column.porosity;
    let dx = column.height / cells as f64;
    let longest = 0.8 * dx / column.fast_wave();
    let mass = [(1.0 - n) * column.grains * dx, n * column.water * dx];
    let (mut v, mut w) = (vec![0.0; cells + 1], vec![0.0; cells + 1]);
    let (mut stress, mut pressure) = (vec![0.0; cells], vec![0.0; cells]);
    let mut time = 0.0;
    let mut rows = Vec::with_capacity(times.len());
    for &end in times {
        let steps = ((end - time) / longest).ceil();
        let dt = (end - time) / steps;
        let drag = dt * n * n * column.water * column.gravity / column.permeability * dx;
        for _ in 0..steps as u64 {
            // The base's node stays where it is; depth and velocity point downwards.
            for j in 0..cells {
                let share = if j == 0 { 0.5 } else { 1.0 };
                let above = if j == 0 {
                    (-load(time), 0.0)
                } else {
                    (stress[j - 1] - pressure[j - 1], pressure[j - 1])
                };
                let on_mixture = stress[j] - pressure[j] - above.0;
                let on_water = -n * (pressure[j] - above.1);
                let [skeleton, water] = mass.map(|m| m * share);
                let coupling = drag * share;
                let r_v = skeleton * v[j] + dt * (on_mixture - on_water);
                let r_w = water * w[j] + dt * on_water;
                let determinant = (skeleton + coupling) * (water + coupling) - coupling * coupling;
                v[j] = ((water + coupling) * r_v + coupling * r_w) / determinant;
                w[j] = (coupling * r_v + (skeleton + coupling) * r_w) / determinant;
            }
            for j in 0..cells {
                let (of_v, of_w) = (dt * (v[j + 1] - v[j]) / dx, dt * (w[j + 1] - w[j]) / dx);
                stress[j] += column.constrained * of_v;
                pressure[j] -= column.water_bulk / n * ((1.0 - n) * of_v + n * of_w);
            }
            time += dt;
        }
        time = end;
        rows.push(depths.iter().map(|depth| between(&pressure, dx, *depth)).collect());
    }
    rows
}

/// Linear interpolation between the middles of cells of size `dx`.
pub(super) fn between(values: &[f64], dx: f64, place: f64) -> f64 {
    let coordinate = (place / dx - 0.5).clamp(0.0, (values.len() - 1) as f64);
    let k = (coordinate as usize).min(values.len() - 2);
    values[k] + (coordinate - k as f64) * (values[k + 1] - values[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// Against a table computed elsewhere with 2000 cells: wherever the pressure is smooth (k = 1e-3 m/s) to 0.01
    /// of the load, of which the front between cells of 2.5 mm takes most.
    #[test]
    fn the_table_of_a_finer_mesh_is_met() {
        let tables: Value = serde_json::from_str(include_str!("../../tests/data/physics.json")).unwrap();
        let table = &tables["two_phase_wave_step_load"]["k=0.001"];
        let column = super::super::undrained_wave::column(1e-3);
        let ramp = table["ramp"].as_f64().unwrap();
        let depths: Vec<f64> =
            table["probe_depth"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        let samples = table["samples"].as_array().unwrap();
        let times: Vec<f64> = samples.iter().map(|s| s["t"].as_f64().unwrap()).collect();
        let found = pressures(&column, 800, &|t| 1e4 * (t / ramp).min(1.0), &times, &depths);
        for (row, sample) in found.iter().zip(samples) {
            for (p, value) in row.iter().zip(sample["p"].as_array().unwrap()) {
                let value = value.as_f64().unwrap();
                assert!((p - value).abs() < 0.01 * 1e4, "{p} {value} at {} s", sample["t"]);
            }
        }
    }
}
