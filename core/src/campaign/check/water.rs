//! `[water]`: pore water and free water.

use super::{Checked, PA_PER_KPA, PA_PER_MPA, needed, non_negative, positive, refuse, within, word};
use crate::campaign::file::{WaterSection, WaterTableText};
use crate::campaign::{
    Analysis, Formulation, GroundSurface, InitialPorePressure, Slope, Water, WaterAboveTable, WaterTable,
};
use crate::slope;

/// `origin`: the toe in the file's coordinates.
pub(super) fn check_water(
    raw: &WaterSection,
    slope: &Slope,
    origin: [f64; 2],
    analysis: &Analysis,
) -> Checked<Water> {
    let free_water_level_m = free_water_level(raw, slope, origin)?;
    let initial = match raw.initial_pore_pressure.as_str() {
        "hydrostatic" => InitialPorePressure::Hydrostatic(water_table(raw, slope, origin)?),
        "submerged" => {
            no_table(raw)?;
            let why = "\"submerged\" needs the level of the free water, m";
            let level = needed("water.free_water_level_m", free_water_level_m, why)?;
            InitialPorePressure::Hydrostatic(WaterTable::ElevationM(level))
        }
        other => {
            let words = [("none", ()), ("hydrostatic", ()), ("submerged", ())];
            word("water.initial_pore_pressure", other, &words)?;
            no_table(raw)?;
            if let Some(level) = raw.free_water_level_m {
                let allowed = "free water needs initial_pore_pressure \"hydrostatic\" or \"submerged\"";
                return Err(refuse("water.free_water_level_m", level, allowed));
            }
            InitialPorePressure::None
        }
    };
    if analysis.formulation == Formulation::OnePhase && initial != InitialPorePressure::None {
        let allowed = "analysis.formulation = \"one-phase\" knows no water: it must be \"none\"";
        let value = format!("\"{}\"", raw.initial_pore_pressure);
        return Err(refuse("water.initial_pore_pressure", value, allowed));
    }
    Ok(Water {
        density_kg_m3: positive("water.density_kg_m3", raw.density_kg_m3)?,
        bulk_modulus_pa: positive("water.bulk_modulus_mpa", raw.bulk_modulus_mpa)? * PA_PER_MPA,
        initial_pore_pressure: initial,
        above_table: word(
            "water.water_above_table",
            &raw.water_above_table,
            &[("held", WaterAboveTable::Held), ("sinks", WaterAboveTable::Sinks)],
        )?,
        free_water_level_m,
        ground_surface: word(
            "water.ground_surface",
            &raw.ground_surface,
            &[("drained", GroundSurface::Drained), ("closed", GroundSurface::Closed)],
        )?,
        cavitation_suction_pa: non_negative("water.cavitation_suction_kpa", raw.cavitation_suction_kpa)?
            * PA_PER_KPA,
    })
}

fn no_table(raw: &WaterSection) -> Checked<()> {
    match raw.water_table {
        None => Ok(()),
        Some(_) => Err(refuse("water.water_table", "a value", "it belongs to \"hydrostatic\"")),
    }
}

fn water_table(raw: &WaterSection, slope: &Slope, origin: [f64; 2]) -> Checked<WaterTable> {
    const KEY: &str = "water.water_table";
    let why = "\"hydrostatic\" needs \"ground-surface\", an elevation in m, or a line [[x, y], ...]";
    match needed(KEY, raw.water_table.as_ref(), why)? {
        WaterTableText::Word(text) => {
            word(KEY, text, &[("ground-surface", ())]).map(|()| WaterTable::GroundSurface)
        }
        WaterTableText::Elevation(value) => {
            let (base, top) =
                (origin[1] - slope.foundation_depth_m, origin[1] + slope::highest_ground_y(slope));
            let ok = (base..=top).contains(value);
            let allowed = format!("it must be from {base} (the base) to {top} (the highest ground)");
            Ok(WaterTable::ElevationM(within(KEY, *value, ok, &allowed)? - origin[1]))
        }
        WaterTableText::Line(points) => {
            Ok(WaterTable::Polyline(super::ground::line(KEY, points)?.seen_from(origin)))
        }
    }
}

fn free_water_level(raw: &WaterSection, slope: &Slope, origin: [f64; 2]) -> Checked<Option<f64>> {
    let Some(level) = raw.free_water_level_m else { return Ok(None) };
    let lowest = origin[1] + slope::lowest_ground_y(slope);
    let allowed = format!("it must be above the lowest ground, {lowest} m");
    let level = within("water.free_water_level_m", level, level > lowest, &allowed)?;
    Ok(Some(level - origin[1]))
}
