//! The material points of a slope: where they start.

use crate::campaign::{Mesh, Slope};
use crate::slope;

/// Where the material points start. The order is that of this list everywhere outside the solver: cell by cell,
/// rows of cells upwards, and row by row within a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// Position of each point, m.
    pub x: Vec<f64>,
    /// Position of each point, m.
    pub y: Vec<f64>,
    /// Distance between neighbouring points, m; a point's volume is its square.
    pub spacing_m: f64,
}

impl Points {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }
}

/// About how many points a slope needs: the area of its extent over that of a point. An upper bound.
pub fn upper_bound(slope: &Slope, mesh: &Mesh) -> f64 {
    let width = -slope::rear_x(slope) + slope.runout_plain_m;
    let area = width * (slope::highest_ground_y(slope) + slope.foundation_depth_m);
    area / (mesh.point_spacing_m() * mesh.point_spacing_m())
}

/// Fills every cell with equally spaced points and keeps those whose centre is in the soil.
pub fn fill(slope: &Slope, mesh: &Mesh) -> Points {
    let cells = slope::extent(slope, mesh);
    let spacing = mesh.point_spacing_m();
    let side = mesh.points_per_cell_side as i64;
    let mut points = Points { x: Vec::new(), y: Vec::new(), spacing_m: spacing };
    for row in -(cells.below as i64)..cells.above as i64 {
        for column in -(cells.behind as i64)..cells.ahead as i64 {
            for j in 0..side {
                for i in 0..side {
                    let x = ((column * side + i) as f64 + 0.5) * spacing;
                    let y = ((row * side + j) as f64 + 0.5) * spacing;
                    if slope::is_inside(slope, mesh, x, y) {
                        points.x.push(x);
                        points.y.push(y);
                    }
                }
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slope::tests::{PAPER, surveyed, uniform};

    const MESH: Mesh = Mesh { cell_size_m: 0.4, points_per_cell_side: 2 };

    /// Crest block 19.4 m, face at 45 degrees, height 15 m, 0.2 m points: 75 rows, row k of 172 - k points.
    #[test]
    fn a_fifteen_metre_slope_at_point_two_metres_has_10125_points() {
        assert_eq!(fill(&PAPER, &MESH).len(), 10_125);
        assert!(upper_bound(&PAPER, &MESH) >= 10_125.0);
        let deep = Slope { foundation_depth_m: 5.2, ..PAPER };
        assert_eq!(fill(&deep, &MESH).len(), 10_125 + 26 * (172 + 100));
    }

    /// As a uniform slope and as its own section, ends cut, a steep face and a vertical one.
    #[test]
    fn a_profile_of_a_uniform_slope_has_its_points() {
        for angle_deg in [45.0f64, 26.565, 71.0, 90.0] {
            let slope = uniform(15.0, angle_deg.to_radians(), 19.4, 20.0);
            let slope = Slope { foundation_depth_m: 2.0, ..slope };
            let edge = slope::crest_edge_x(&slope);
            let section = [[edge - 19.4, 15.0], [edge, 15.0], [0.0, 0.0], [12.0, 0.0]];
            let profile = surveyed(&section, edge, 2.0, 20.0);
            assert_eq!(slope::grid(&profile, &MESH), slope::grid(&slope, &MESH), "{angle_deg} degrees");
            assert_eq!(fill(&profile, &MESH), fill(&slope, &MESH), "{angle_deg} degrees");
            assert!((upper_bound(&profile, &MESH) / upper_bound(&slope, &MESH) - 1.0).abs() < 1e-12);
        }
    }
}
