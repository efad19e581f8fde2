//! `[water]`

use serde::{Deserialize, Serialize};

/// `[water]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaterSection {
    /// Density, kg/m3.
    pub density_kg_m3: f64,
    /// Bulk modulus used in the analysis, MPa.
    pub bulk_modulus_mpa: f64,
    /// `"none"`: zero everywhere. `"hydrostatic"`: the water's unit weight times the vertical depth below `water_table`,
    /// or below the free water where the ground is below that; zero above. `"submerged"`: water table and free water
    /// both at `free_water_level_m`.
    ///
    /// Rapid drawdown is `"hydrostatic"` with the table at or above the level before (it is cut off at the ground
    /// surface) and a lower `free_water_level_m`, or none: the pores still carry what the water outside no longer
    /// balances. Total stresses are those under the lower level; that unloading also lowers the pore pressure of a
    /// compressible skeleton is left out, which is on the safe side.
    pub initial_pore_pressure: String,
    /// For `"hydrostatic"`: `"ground-surface"`, an elevation, m, or a line `[[x, y], ...]`, level beyond its ends; at the
    /// ground surface where that is lower.
    pub water_table: Option<WaterTableText>,
    /// `"held"`: above the water table (everywhere without one) the skeleton holds the pore water, which is then in
    /// equilibrium without pore pressure. `"sinks"`: it sinks under its weight, so that pressure builds up from below.
    pub water_above_table: String,
    /// Elevation of standing water outside the soil, m; absent, there is none. For `"submerged"` and `"hydrostatic"` in
    /// two phases. Its weight rests on the ground, and what slides into it is buoyant; its own motion is left out.
    pub free_water_level_m: Option<f64>,
    /// `"drained"` (pore pressure of the free water there, zero without any) or `"closed"` (no flow through it).
    pub ground_surface: String,
    /// Largest suction the water can carry, kPa (0 allows none).
    pub cavitation_suction_kpa: f64,
}

/// `water_table = "ground-surface" | elevation | [[x, y], ...]`
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged, expecting = "it must be \"ground-surface\", an elevation or a line [[x, y], ...]")]
pub enum WaterTableText {
    /// Elevation, m.
    Elevation(f64),
    /// Points from left to right, m.
    Line(Vec<[f64; 2]>),
    /// `"ground-surface"`.
    Word(String),
}
