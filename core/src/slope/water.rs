//! Pore water and free water before failure.

use super::ground_surface_y;
use crate::campaign::{InitialPorePressure, Slope, Water, WaterTable};

/// Elevation from which the pore pressure counts at `x`, m above the toe: the water table, which reaches no higher than
/// the ground, or the free water where the ground is below it. None without pore pressure.
pub fn pressure_level_m(slope: &Slope, water: &Water, x: f64) -> Option<f64> {
    let InitialPorePressure::Hydrostatic(table) = &water.initial_pore_pressure else { return None };
    let surface = ground_surface_y(slope, x);
    let level = match table {
        WaterTable::GroundSurface => surface,
        WaterTable::ElevationM(elevation) => elevation.min(surface),
        WaterTable::Polyline(line) => line.y_at(x).min(surface),
    };
    Some(match water.free_water_level_m {
        Some(free) if surface < free => level.max(free),
        _ => level,
    })
}

/// Pore pressure at the start of a point `size` m high at (x, y), Pa: that of water at rest below the level at x, zero
/// above it.
pub fn initial_pressure(slope: &Slope, water: &Water, gravity_m_s2: f64, x: f64, y: f64, size: f64) -> f64 {
    let Some(level) = pressure_level_m(slope, water, x) else { return 0.0 };
    let at_rest = water.density_kg_m3 * gravity_m_s2 * (level - y).max(0.0);
    match water.free_water_level_m {
        // As the free water presses, so that none flows at the water line.
        Some(free) if ground_surface_y(slope, x) < free => {
            at_rest.max(free_water_pressure(water, gravity_m_s2, y, size))
        }
        _ => at_rest,
    }
}

/// Share of a point `size` m high at elevation `y` that lies below the free water's level.
pub fn submerged_share(water: &Water, y: f64, size: f64) -> f64 {
    water.free_water_level_m.map_or(0.0, |level| ((level - y) / size + 0.5).clamp(0.0, 1.0))
}

/// Pressure of the free water on a point `size` m high at elevation `y`, Pa, also inside the ground: the mean over the
/// point; zero above the level or without free water.
pub fn free_water_pressure(water: &Water, gravity_m_s2: f64, y: f64, size: f64) -> f64 {
    let Some(level) = water.free_water_level_m else { return 0.0 };
    let share = submerged_share(water, y, size);
    let mean_depth = if share < 1.0 { 0.5 * share * share * size } else { level - y };
    water.density_kg_m3 * gravity_m_s2 * mean_depth
}

#[cfg(test)]
mod tests {
    use super::super::tests::PAPER;
    use super::*;
    use crate::campaign::{GroundSurface, Polyline, WaterAboveTable};

    fn water(table: WaterTable, free_water_level_m: Option<f64>) -> Water {
        Water {
            density_kg_m3: 1000.0,
            bulk_modulus_pa: 4e8,
            initial_pore_pressure: InitialPorePressure::Hydrostatic(table),
            free_water_level_m,
            above_table: WaterAboveTable::Held,
            ground_surface: GroundSurface::Drained,
            cavitation_suction_pa: 1e5,
        }
    }

    /// Whole millimetres of water at (x, y).
    fn head(water: &Water, x: f64, y: f64) -> i64 {
        (initial_pressure(&PAPER, water, 9.81, x, y, 0.2) / 9.81).round() as i64
    }

    #[test]
    fn the_table_is_cut_off_at_the_ground() {
        let level = water(WaterTable::ElevationM(6.0), None);
        assert_eq!(
            [head(&level, -20.0, 1.0), head(&level, -20.0, 7.0), head(&level, -4.0, 1.0)],
            [5000, 0, 3000]
        );
        let line = Polyline::new(vec![[-20.0, 10.0], [0.0, 0.0]]).unwrap();
        let line = water(WaterTable::Polyline(line), None);
        assert_eq!(
            [head(&line, -30.0, 1.0), head(&line, -20.0, 1.0), head(&line, -4.0, 1.0)],
            [9000, 9000, 1000]
        );
    }

    #[test]
    fn under_free_water_its_depth_counts() {
        let submerged = water(WaterTable::ElevationM(6.0), Some(6.0));
        assert_eq!([head(&submerged, -4.0, 1.0), head(&submerged, 10.0, -1.0)], [5000, 7000]);
        // Drawn down from 6 m to 2 m: the pores behind the face keep what the ground holds.
        let drawdown = water(WaterTable::ElevationM(6.0), Some(2.0));
        assert_eq!(
            [head(&drawdown, -4.0, 1.0), head(&drawdown, -1.0, 0.5), head(&drawdown, 10.0, -1.0)],
            [3000, 1500, 3000]
        );
        assert_eq!(free_water_pressure(&drawdown, 9.81, -1.0, 0.2), 3.0 * 9810.0);
        assert_eq!(free_water_pressure(&drawdown, 9.81, 2.5, 0.2), 0.0);
        // Half submerged: half of it at a mean depth of a quarter of its size.
        assert_eq!(submerged_share(&drawdown, 2.0, 0.2), 0.5);
        assert!((free_water_pressure(&drawdown, 9.81, 2.0, 0.2) / (9810.0 * 0.5 * 0.05) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn without_pore_pressure_there_is_none() {
        let mut dry = water(WaterTable::GroundSurface, None);
        dry.initial_pore_pressure = InitialPorePressure::None;
        assert_eq!(pressure_level_m(&PAPER, &dry, -5.0), None);
        assert_eq!(head(&dry, -20.0, 1.0), 0);
    }
}
