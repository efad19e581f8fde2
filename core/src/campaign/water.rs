//! Pore water and free water.

use super::Polyline;
use serde::{Deserialize, Serialize};

/// Where the water table stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaterTable {
    /// At the ground surface everywhere.
    GroundSurface,
    /// At this elevation above the toe, m (at the ground surface where that is lower).
    ElevationM(f64),
    /// On this line (at the ground surface where that is lower).
    Polyline(Polyline),
}

/// Pore pressure at the start of the failure stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialPorePressure {
    /// Zero everywhere: only excess pore pressure develops.
    None,
    /// Water unit weight times the vertical depth below the water table, or below the free water where the ground is
    /// below that; zero above.
    Hydrostatic(WaterTable),
}

/// What the water above the water table does; without a table, all of the water.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaterAboveTable {
    /// The skeleton holds it, as capillary water: without pore pressure it is in equilibrium.
    Held,
    /// It sinks through the skeleton under its weight, so that pore pressure builds up from below.
    Sinks,
}

/// Hydraulic condition of the ground surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GroundSurface {
    /// Pore pressure that of the free water there, zero without any (natural condition).
    Drained,
    /// No flow through it: water moves with the soil there.
    Closed,
}

/// Pore water and free water.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Water {
    /// Density, kg/m3.
    pub density_kg_m3: f64,
    /// Bulk modulus used in the analysis, Pa.
    pub bulk_modulus_pa: f64,
    /// Pore pressure at the start.
    pub initial_pore_pressure: InitialPorePressure,
    /// What the water above the water table does.
    pub above_table: WaterAboveTable,
    /// Elevation above the toe of standing water outside the soil, m; absent: there is none. Two phases only.
    pub free_water_level_m: Option<f64>,
    /// Hydraulic condition of the ground surface.
    pub ground_surface: GroundSurface,
    /// Largest suction the water can carry, Pa.
    pub cavitation_suction_pa: f64,
}
