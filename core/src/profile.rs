//! What a slide does to the ground in front of the toe: how deep the soil comes to lie and how fast it passes, column by
//! column.
//!
//! The columns run from the toe to the end of the plain, each one cell of the grid wide, or as many cells as it takes to
//! need no more than [`MOST_COLUMNS`] of them. Depth is the volume of the soil above the original ground of a column, slid
//! or heaved, over the column's width; a point counts where its centre is, so that depths are known to about one spacing
//! of the points. Speed is that of the column's soil above the original ground as a whole (momentum over mass, at one
//! density): a column that holds less than one spacing of it has none, so that sprayed points count for little here as
//! they do for the toe's advance.

use crate::campaign::{Mesh, Slope};
use crate::gimp::PointMotion;
use crate::slope;
use serde::{Deserialize, Serialize};

/// Time between two looks at the slide, s: one of 10 m/s goes half a metre in it, about a cell.
pub const LOOK_EVERY_S: f64 = 0.05;

/// Most columns: they bound an outcome's length (some 600 characters at most) and are finer than a map of hazard is read.
pub const MOST_COLUMNS: usize = 64;

/// Largest depth that is told apart, mm: no slope is 10 km high.
pub const MOST_DEPTH_MM: u32 = 10_000_000;

/// Largest speed that is told apart, mm/s: no slide goes 10 km/s.
pub const MOST_SPEED_MM_S: u32 = 10_000_000;

const MM_PER_M: f64 = 1e3;

/// What one realisation did along the ground, a number a column from the toe on; columns after the last that is not 0 are
/// left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Width of a column, m.
    pub column_m: f64,
    /// Depth of the soil above the original ground at the end, mm.
    pub depth_mm: Vec<u32>,
    /// Highest speed of that soil at any moment looked at, mm/s.
    pub speed_mm_s: Vec<u32>,
}

impl Profile {
    /// Depth in a column, m; 0 where nothing lies.
    pub fn depth_m(&self, column: usize) -> f64 {
        value(&self.depth_mm, column)
    }

    /// Highest speed in a column, m/s; 0 where nothing passed.
    pub fn speed_m_s(&self, column: usize) -> f64 {
        value(&self.speed_mm_s, column)
    }
}

fn value(values_mm: &[u32], column: usize) -> f64 {
    values_mm.get(column).map_or(0.0, |value| f64::from(*value) / MM_PER_M)
}

/// The columns in front of the toe.
#[derive(Debug, Clone, PartialEq)]
pub struct Stations {
    /// Width of a column, m.
    pub width_m: f64,
    /// Number of columns; the last one may reach beyond the plain's end.
    pub count: usize,
    slope: Slope,
    /// Depth from which a column's soil has a speed, m.
    least_depth_m: f64,
}

impl Stations {
    /// The columns in front of the toe of `slope`.
    pub fn of(slope: &Slope, mesh: &Mesh) -> Stations {
        let cells = slope::extent(slope, mesh).ahead;
        let in_one = cells.div_ceil(MOST_COLUMNS);
        Stations {
            width_m: in_one as f64 * mesh.cell_size_m,
            count: cells.div_ceil(in_one),
            slope: slope.clone(),
            least_depth_m: mesh.point_spacing_m(),
        }
    }

    /// Middle of a column, m from the toe.
    pub fn x_m(&self, column: usize) -> f64 {
        (column as f64 + 0.5) * self.width_m
    }

    /// The column that holds a point above the original ground; none for others.
    fn column(&self, x: f64, y: f64) -> Option<usize> {
        if !(x >= 0.0 && y > slope::reference_y(&self.slope, x)) {
            return None;
        }
        Some((x / self.width_m) as usize).filter(|column| *column < self.count)
    }
}

/// Makes a profile of one analysis' moments. Looking allocates nothing.
#[derive(Debug)]
pub struct Recorder {
    stations: Stations,
    /// Volume (m2) and its products with both velocities (m3/s) of the present moment, a column each.
    sums: Vec<[f64; 3]>,
    /// At the last moment looked at, m.
    depth_m: Vec<f64>,
    /// The highest so far, m/s.
    speed_m_s: Vec<f64>,
}

impl Recorder {
    /// Nothing seen yet.
    pub fn new(stations: Stations) -> Recorder {
        let nothing = vec![0.0; stations.count];
        Recorder {
            sums: vec![[0.0; 3]; stations.count],
            depth_m: nothing.clone(),
            speed_m_s: nothing,
            stations,
        }
    }

    /// Takes a moment in; the last one gives the depths.
    pub fn look(&mut self, points: impl Iterator<Item = PointMotion>) {
        self.sums.fill([0.0; 3]);
        for point in points {
            let Some(column) = self.stations.column(point.x, point.y) else { continue };
            let sums = &mut self.sums[column];
            sums[0] += point.volume;
            sums[1] += point.volume * point.vx;
            sums[2] += point.volume * point.vy;
        }
        for (column, [volume, along, up]) in self.sums.iter().enumerate() {
            let depth_m = volume / self.stations.width_m;
            self.depth_m[column] = depth_m;
            if depth_m >= self.stations.least_depth_m {
                let speed = (along * along + up * up).sqrt() / volume;
                self.speed_m_s[column] = self.speed_m_s[column].max(speed);
            }
        }
    }

    /// The profile of the moments seen.
    pub fn finish(self) -> Profile {
        Profile {
            column_m: self.stations.width_m,
            depth_mm: compact(&self.depth_m, MOST_DEPTH_MM),
            speed_mm_s: compact(&self.speed_m_s, MOST_SPEED_MM_S),
        }
    }
}

/// Whole millimetres up to the last value that is not 0.
fn compact(values_m: &[f64], most: u32) -> Vec<u32> {
    let mut whole: Vec<u32> =
        values_m.iter().map(|value| ((MM_PER_M * value).round() as u32).min(most)).collect();
    whole.truncate(whole.iter().rposition(|value| *value > 0).map_or(0, |last| last + 1));
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slope::tests::{surveyed, uniform};

    /// Flat ground in front of a toe, three columns of 2 m, points 1 m apart.
    fn stations() -> Stations {
        Stations { width_m: 2.0, count: 3, slope: uniform(4.0, 0.8, 4.0, 6.0), least_depth_m: 1.0 }
    }

    fn points<const N: usize>(places: [[f64; 2]; N], vx: [f64; N]) -> impl Iterator<Item = PointMotion> {
        places.into_iter().zip(vx).map(|([x, y], vx)| PointMotion { x, y, vx, vy: 0.0, volume: 1.0 })
    }

    /// By hand: two points of 1 m2 at 3 and 5 m/s over the first column of 2 m are 1 m deep and go at 4 m/s; the lone
    /// point in the second column is half a metre deep and has no speed; soil below the ground, behind the toe or beyond
    /// the plain counts nowhere; nothing lies in the third column, which is left out.
    #[test]
    fn depth_and_speed_are_those_counted_by_hand() {
        let mut recorder = Recorder::new(stations());
        let places = [[0.5, 0.5], [1.5, 0.5], [3.0, 0.5], [1.0, -0.5], [-0.5, 0.5], [6.5, 0.5]];
        recorder.look(points(places, [3.0, 5.0, 9.0, 7.0, 7.0, 7.0]));
        let profile = recorder.finish();
        assert_eq!((profile.column_m, &profile.depth_mm[..]), (2.0, &[1000, 500][..]));
        assert_eq!(profile.speed_mm_s, [4000]);
        assert_eq!([profile.depth_m(1), profile.depth_m(2), profile.speed_m_s(0)], [0.5, 0.0, 4.0]);
    }

    #[test]
    fn the_highest_speed_and_the_last_depth_are_kept() {
        let mut recorder = Recorder::new(stations());
        for (x, speed) in [(0.5, 2.0), (1.0, 6.0), (2.5, 1.0)] {
            recorder.look(points([[x, 0.5], [x, 1.5]], [speed, speed]));
        }
        let profile = recorder.finish();
        assert_eq!(profile.depth_mm, [0, 1000]);
        assert_eq!(profile.speed_mm_s, [6000, 1000]);
    }

    /// The ground falls by 1 in 4 in front of the toe: the first point lies below it, the second above.
    #[test]
    fn soil_counts_above_the_ground_that_was_surveyed() {
        let slope = surveyed(&[[-8.0, 4.0], [-4.0, 4.0], [0.0, 0.0], [8.0, -2.0]], -4.0, 3.0, 8.0);
        let mut recorder = Recorder::new(Stations { slope, ..stations() });
        recorder.look(points([[1.0, -0.5], [3.0, -0.5]], [1.0, 1.0]));
        assert_eq!(recorder.finish().depth_mm, [0, 500]);
    }

    /// 100 cells are two to a column, 64 are one each.
    #[test]
    fn columns_are_few_and_cover_the_plain() {
        let of = |plain_m| {
            let stations = Stations::of(
                &uniform(4.0, 0.8, 4.0, plain_m),
                &Mesh { cell_size_m: 0.5, points_per_cell_side: 2 },
            );
            (stations.count, stations.width_m)
        };
        assert_eq!([of(32.0), of(50.0), of(50.5)], [(64, 0.5), (50, 1.0), (51, 1.0)]);
    }

    #[test]
    fn what_has_no_bound_is_bounded() {
        assert_eq!(compact(&[0.0, 1e300, f64::INFINITY, 4e-4, 0.0], 7), [0, 7, 7]);
        assert_eq!(compact(&[0.0, 0.0], 7), [0_u32; 0]);
    }
}
