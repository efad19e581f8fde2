//! The slope's geometry: crest, face, toe, foundation and runout plain.
//!
//! The toe is the origin, x points in the direction of runout, y up. Lengths that the grid must divide (soil behind
//! the toe, foundation depth, runout plain) are rounded to whole cells; the ground surface stays as given.

pub mod layers;
pub mod water;

use crate::campaign::{Mesh, Polyline, Slope, Surface};
use crate::gimp::Grid;

/// Cells of air above the highest ground: room for material that is thrown up.
const HEADROOM_CELLS: usize = 10;

/// Share of a cell by which a point may lie above the ground surface and still count as inside, so that round-off
/// does not decide over points whose centre is on the surface.
const SURFACE_TOLERANCE_CELLS: f64 = 1e-9;

/// Whole cells of the slope: behind the toe, in front of it, below it, above it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Cells from the left wall to the toe.
    pub behind: usize,
    /// Cells from the toe to the right wall.
    pub ahead: usize,
    /// Cells from the rigid base to toe level.
    pub below: usize,
    /// Cells from toe level to the top of the grid.
    pub above: usize,
}

/// The cells that a slope needs.
pub fn extent(slope: &Slope, mesh: &Mesh) -> Extent {
    let cells = |length: f64| (length / mesh.cell_size_m).round() as usize;
    Extent {
        behind: cells(-rear_x(slope)).max(1),
        ahead: cells(slope.runout_plain_m).max(1),
        below: cells(slope.foundation_depth_m),
        above: (highest_ground_y(slope) / mesh.cell_size_m).ceil() as usize + HEADROOM_CELLS,
    }
}

/// The grid of a slope: a node at the toe, walls around its extent.
pub fn grid(slope: &Slope, mesh: &Mesh) -> Grid {
    let Extent { behind, ahead, below, above } = extent(slope, mesh);
    let h = mesh.cell_size_m;
    Grid::enclosing(-(behind as f64) * h, -(below as f64) * h, [behind + ahead, below + above], h)
}

/// Height from toe to crest, m.
pub fn height_m(slope: &Slope) -> f64 {
    match &slope.surface {
        Surface::Uniform { height_m, .. } => *height_m,
        Surface::Profile { line, crest_x_m } => line.y_at(*crest_x_m),
    }
}

/// Angle of the face above the horizontal, rad; of a profile, that of the straight line from toe to crest.
pub fn mean_angle_rad(slope: &Slope) -> f64 {
    match &slope.surface {
        Surface::Uniform { angle_rad, .. } => *angle_rad,
        Surface::Profile { .. } => libm::atan2(height_m(slope), -crest_edge_x(slope)),
    }
}

/// Position of the crest's edge, m (not positive).
pub fn crest_edge_x(slope: &Slope) -> f64 {
    match &slope.surface {
        Surface::Uniform { angle_rad, .. } if *angle_rad >= std::f64::consts::FRAC_PI_2 => 0.0,
        Surface::Uniform { height_m, angle_rad, .. } => -height_m / libm::tan(*angle_rad),
        Surface::Profile { crest_x_m, .. } => *crest_x_m,
    }
}

/// Where the ground begins behind the crest, m (before the grid rounds it).
pub fn rear_x(slope: &Slope) -> f64 {
    match &slope.surface {
        Surface::Uniform { crest_width_m, .. } => -(-crest_edge_x(slope) + crest_width_m),
        Surface::Profile { line, .. } => line.points()[0][0],
    }
}

/// Elevation of the original ground surface at `x`, m above the toe; at a vertical step that of its left side.
pub fn ground_surface_y(slope: &Slope, x: f64) -> f64 {
    let height_m = match &slope.surface {
        Surface::Uniform { height_m, .. } => *height_m,
        Surface::Profile { line, .. } => return line.y_at(x),
    };
    let edge = crest_edge_x(slope);
    if x <= edge {
        height_m
    } else if x < 0.0 {
        height_m * x / edge
    } else {
        0.0
    }
}

/// Level that slid material is measured from at `x`: toe level behind the toe, the original ground in front of it.
pub fn reference_y(slope: &Slope, x: f64) -> f64 {
    match &slope.surface {
        Surface::Profile { line, .. } if x > 0.0 => line.y_at(x),
        _ => 0.0,
    }
}

/// The ground surface between two x, from left to right, ends included.
pub fn surface_between(slope: &Slope, left: f64, right: f64) -> Vec<[f64; 2]> {
    match &slope.surface {
        Surface::Profile { line, .. } => line.between(left, right),
        Surface::Uniform { height_m, .. } => {
            let line = Polyline::new(vec![[crest_edge_x(slope), *height_m], [0.0, 0.0]]);
            line.expect("the edge does not lie in front of the toe").between(left, right)
        }
    }
}

/// Highest ground between two x, m above the toe.
pub fn highest_between(slope: &Slope, left: f64, right: f64) -> f64 {
    surface_between(slope, left, right).iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max)
}

/// Highest ground between the walls, m above the toe.
pub fn highest_ground_y(slope: &Slope) -> f64 {
    highest_between(slope, rear_x(slope), slope.runout_plain_m)
}

/// Lowest ground between the walls, m above the toe.
pub fn lowest_ground_y(slope: &Slope) -> f64 {
    let surface = surface_between(slope, rear_x(slope), slope.runout_plain_m);
    surface.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min)
}

/// Whether a point lies in the original slope.
pub fn is_inside(slope: &Slope, mesh: &Mesh, x: f64, y: f64) -> bool {
    y <= ground_surface_y(slope, x) + SURFACE_TOLERANCE_CELLS * mesh.cell_size_m
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::campaign::Contact;

    /// The paper's slope: 15 m, 45 degrees, crest 19.4 m, plain 20 m.
    pub(crate) const PAPER: Slope = uniform(15.0, std::f64::consts::FRAC_PI_4, 19.4, 20.0);

    pub(crate) const fn uniform(
        height_m: f64,
        angle_rad: f64,
        crest_width_m: f64,
        runout_plain_m: f64,
    ) -> Slope {
        Slope {
            surface: Surface::Uniform { height_m, angle_rad, crest_width_m },
            foundation_depth_m: 0.0,
            runout_plain_m,
            base: Contact::Fixed,
        }
    }

    /// A slope of a surveyed section.
    pub(crate) fn surveyed(points: &[[f64; 2]], crest_x_m: f64, depth: f64, plain: f64) -> Slope {
        let line = Polyline::new(points.to_vec()).unwrap();
        Slope {
            surface: Surface::Profile { line, crest_x_m },
            foundation_depth_m: depth,
            runout_plain_m: plain,
            base: Contact::Fixed,
        }
    }

    #[test]
    fn the_surface_runs_from_crest_to_toe_to_plain() {
        assert_eq!(ground_surface_y(&PAPER, -30.0), 15.0);
        assert!((ground_surface_y(&PAPER, -7.5) - 7.5).abs() < 1e-12);
        assert_eq!(ground_surface_y(&PAPER, 3.0), 0.0);
        let upright = uniform(15.0, std::f64::consts::FRAC_PI_2, 19.4, 20.0);
        assert_eq!(ground_surface_y(&upright, -0.1), 15.0);
        assert_eq!(ground_surface_y(&upright, 0.1), 0.0);
        assert_eq!(highest_between(&upright, 0.0, 5.0), 0.0);
        assert_eq!(highest_between(&upright, -1.0, 5.0), 15.0);
    }

    #[test]
    fn a_profile_has_the_height_of_its_crest_and_the_level_of_its_ground() {
        // A hill of 12 m behind a crest of 10 m, a terrace below the toe, a river bank.
        let slope = surveyed(
            &[[-30.0, 12.0], [-10.0, 10.0], [0.0, 0.0], [5.0, -1.0], [5.0, -3.0], [20.0, 4.0], [40.0, 20.0]],
            -10.0,
            4.0,
            20.0,
        );
        assert_eq!(height_m(&slope), 10.0);
        assert_eq!(crest_edge_x(&slope), -10.0);
        assert_eq!(rear_x(&slope), -30.0);
        assert!((mean_angle_rad(&slope) - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
        assert_eq!([highest_ground_y(&slope), lowest_ground_y(&slope)], [12.0, -3.0]);
        assert_eq!([reference_y(&slope, -4.0), ground_surface_y(&slope, -4.0)], [0.0, 4.0]);
        assert_eq!([reference_y(&slope, 5.0), reference_y(&slope, 12.5)], [-1.0, 0.5]);
        let cells = extent(&slope, &Mesh { cell_size_m: 1.0, points_per_cell_side: 2 });
        assert_eq!(cells, Extent { behind: 30, ahead: 20, below: 4, above: 12 + HEADROOM_CELLS });
    }

    #[test]
    fn the_toe_is_a_node_and_the_walls_are_one_layer_inside_the_grid() {
        let mesh = Mesh { cell_size_m: 0.4, points_per_cell_side: 2 };
        let grid = grid(&PAPER, &mesh);
        assert_eq!(grid.nodes, [86 + 50 + 3, 38 + 10 + 3]);
        assert!((grid.origin_m[0] + 87.0 * 0.4).abs() < 1e-12);
        assert!((grid.origin_m[1] + 0.4).abs() < 1e-12);
    }
}
