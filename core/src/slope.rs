//! The slope's geometry: crest, face, toe, foundation and runout plain.
//!
//! The toe is the origin, x points in the direction of runout, y up. Lengths that the grid must divide (soil behind
//! the toe, foundation depth, runout plain) are rounded to whole cells; height and angle stay as given.

use crate::campaign::{Mesh, Slope, Water, WaterTable};
use crate::gimp::Grid;

/// Cells of air above the crest: room for material that is thrown up.
const HEADROOM_CELLS: usize = 10;

/// Share of a cell by which a point may lie above the ground surface and still count as inside, so that round-off
/// does not decide over points whose centre is on the surface.
const SURFACE_TOLERANCE_CELLS: f64 = 1e-9;

/// Whole cells of the slope's box: behind the toe, in front of it, below it, above it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Box {
    /// Cells from the left wall to the toe.
    pub behind: usize,
    /// Cells from the toe to the right wall.
    pub ahead: usize,
    /// Cells from the rigid base to toe level.
    pub below: usize,
    /// Cells from toe level to the top of the grid.
    pub above: usize,
}

/// The box of a slope.
pub fn enclosing_box(slope: &Slope, mesh: &Mesh) -> Box {
    let cells = |length: f64| (length / mesh.cell_size_m).round() as usize;
    Box {
        behind: cells(-crest_edge_x(slope) + slope.crest_width_m).max(1),
        ahead: cells(slope.runout_plain_m).max(1),
        below: cells(slope.foundation_depth_m),
        above: (slope.height_m / mesh.cell_size_m).ceil() as usize + HEADROOM_CELLS,
    }
}

/// The grid of a slope: a node at the toe, walls at the box.
pub fn grid(slope: &Slope, mesh: &Mesh) -> Grid {
    let Box { behind, ahead, below, above } = enclosing_box(slope, mesh);
    let h = mesh.cell_size_m;
    Grid::enclosing(-(behind as f64) * h, -(below as f64) * h, [behind + ahead, below + above], h)
}

/// Position of the crest's edge, m (not positive).
pub fn crest_edge_x(slope: &Slope) -> f64 {
    if slope.angle_rad >= std::f64::consts::FRAC_PI_2 {
        return 0.0;
    }
    -slope.height_m / libm::tan(slope.angle_rad)
}

/// Elevation of the original ground surface at `x`, m above the toe.
pub fn ground_surface_y(slope: &Slope, x: f64) -> f64 {
    let edge = crest_edge_x(slope);
    if x <= edge {
        slope.height_m
    } else if x < 0.0 {
        slope.height_m * x / edge
    } else {
        0.0
    }
}

/// Whether a point lies in the original slope.
pub fn is_inside(slope: &Slope, mesh: &Mesh, x: f64, y: f64) -> bool {
    y <= ground_surface_y(slope, x) + SURFACE_TOLERANCE_CELLS * mesh.cell_size_m
}

/// Hydrostatic pore pressure below a water table at (x, y), Pa; zero above it.
pub fn hydrostatic_pressure(
    slope: &Slope,
    water: &Water,
    table: WaterTable,
    gravity_m_s2: f64,
    x: f64,
    y: f64,
) -> f64 {
    let surface = ground_surface_y(slope, x);
    let level = match table {
        WaterTable::GroundSurface => surface,
        WaterTable::ElevationM(elevation) => elevation.min(surface),
    };
    water.density_kg_m3 * gravity_m_s2 * (level - y).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOPE: Slope = Slope {
        height_m: 15.0,
        angle_rad: std::f64::consts::FRAC_PI_4,
        crest_width_m: 19.4,
        foundation_depth_m: 0.0,
        runout_plain_m: 20.0,
    };

    #[test]
    fn the_surface_runs_from_crest_to_toe_to_plain() {
        assert_eq!(ground_surface_y(&SLOPE, -30.0), 15.0);
        assert!((ground_surface_y(&SLOPE, -7.5) - 7.5).abs() < 1e-12);
        assert_eq!(ground_surface_y(&SLOPE, 3.0), 0.0);
        let upright = Slope { angle_rad: std::f64::consts::FRAC_PI_2, ..SLOPE };
        assert_eq!(ground_surface_y(&upright, -0.1), 15.0);
        assert_eq!(ground_surface_y(&upright, 0.1), 0.0);
    }

    #[test]
    fn the_toe_is_a_node_and_the_walls_are_one_layer_inside_the_grid() {
        let mesh = Mesh { cell_size_m: 0.4, points_per_cell_side: 2 };
        let grid = grid(&SLOPE, &mesh);
        assert_eq!(grid.nodes, [86 + 50 + 3, 38 + 10 + 3]);
        assert!((grid.origin_m[0] + 87.0 * 0.4).abs() < 1e-12);
        assert!((grid.origin_m[1] + 0.4).abs() < 1e-12);
    }
}
