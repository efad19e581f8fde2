//! What a slide does to the ground in front of the toe: how deep the soil comes to lie and how fast it passes, column by
//! column.
//!
//! The columns are those of the grid's cells, from the toe to the end of the plain. Depth is the volume of the soil above
//! the original ground of a column, slid or heaved, over the column's width; a point counts where its centre is, so that
//! depths are known to about one spacing of the points. Speed is that of the column's soil above the original ground as a
//! whole (momentum over mass, at one density): a column that holds less than one spacing of it has none, so that sprayed
//! points count for little here as they do for the toe's advance.

use runout_core::campaign::{Model, Slope};
use runout_core::realisation::Snapshot;
use runout_core::slope;
use serde::{Deserialize, Serialize};

/// The columns in front of the toe.
#[derive(Debug, Clone, PartialEq)]
pub struct Stations {
    /// Width of a column, m.
    pub width_m: f64,
    /// Number of columns.
    pub count: usize,
    slope: Slope,
    /// Depth from which a column's soil has a speed, m.
    least_depth_m: f64,
}

impl Stations {
    /// The columns of `model`.
    pub fn of(model: &Model) -> Stations {
        Stations {
            width_m: model.mesh.cell_size_m,
            count: slope::extent(&model.slope, &model.mesh).ahead,
            slope: model.slope.clone(),
            least_depth_m: model.mesh.point_spacing_m(),
        }
    }

    /// Middle of a column, m from the toe.
    pub fn x_m(&self, column: usize) -> f64 {
        (column as f64 + 0.5) * self.width_m
    }

    /// The column that holds a point above the original ground; none for others.
    fn column(&self, x: f64, y: f64) -> Option<usize> {
        if !(x >= 0.0 && y > slope::ground_surface_y(&self.slope, x)) {
            return None;
        }
        Some((x / self.width_m) as usize).filter(|column| *column < self.count)
    }
}

/// What one realisation did, a number a column.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Depth of the soil above the original ground at the end, m.
    pub depth_m: Vec<f64>,
    /// Highest speed of that soil at any moment looked at, m/s.
    pub speed_m_s: Vec<f64>,
}

/// Makes a profile of one analysis' moments.
#[derive(Debug)]
pub struct Recorder {
    stations: Stations,
    profile: Profile,
}

impl Recorder {
    /// Nothing seen yet.
    pub fn new(stations: Stations) -> Recorder {
        let nothing = vec![0.0; stations.count];
        Recorder { stations, profile: Profile { depth_m: nothing.clone(), speed_m_s: nothing } }
    }

    /// Takes a moment in; the last one gives the depths.
    pub fn observe(&mut self, snapshot: &Snapshot<'_>) {
        let state = snapshot.state;
        self.take([&state.x, &state.y], [&state.vx, &state.vy], &state.volume);
    }

    fn take(&mut self, [x, y]: [&[f64]; 2], [vx, vy]: [&[f64]; 2], volume: &[f64]) {
        let mut sums = vec![[0.0; 3]; self.stations.count];
        for (i, (x, y)) in x.iter().zip(y).enumerate() {
            let Some(column) = self.stations.column(*x, *y) else { continue };
            let part = [volume[i], volume[i] * vx[i], volume[i] * vy[i]];
            sums[column].iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        let Profile { depth_m, speed_m_s } = &mut self.profile;
        for (column, [volume, along, up]) in sums.into_iter().enumerate() {
            depth_m[column] = volume / self.stations.width_m;
            if depth_m[column] >= self.stations.least_depth_m {
                speed_m_s[column] = speed_m_s[column].max(along.hypot(up) / volume);
            }
        }
    }

    /// The profile of the moments seen.
    pub fn finish(self) -> Profile {
        self.profile
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use runout_core::campaign::{Contact, Surface};

    /// Flat ground in front of a toe, two columns of 2 m, points 1 m apart.
    fn stations() -> Stations {
        let surface = Surface::Uniform { height_m: 4.0, angle_rad: 0.8, crest_width_m: 4.0 };
        let slope = Slope { surface, foundation_depth_m: 2.0, runout_plain_m: 4.0, base: Contact::Fixed };
        Stations { width_m: 2.0, count: 2, slope, least_depth_m: 1.0 }
    }

    /// By hand: two points of 1 m2 at 3 and 5 m/s over the first column of 2 m are 1 m deep and go at 4 m/s; the lone
    /// point in the second column is half a metre deep and has no speed; soil below the ground counts nowhere.
    #[test]
    fn depth_and_speed_are_those_counted_by_hand() {
        let mut recorder = Recorder::new(stations());
        let one = [1.0; 4];
        recorder.take(
            [&[0.5, 1.5, 3.0, 1.0], &[0.5, 0.5, 0.5, -0.5]],
            [&[3.0, 5.0, 9.0, 7.0], &[0.0; 4]],
            &one,
        );
        let profile = recorder.finish();
        assert_eq!(profile.depth_m, [1.0, 0.5]);
        assert_eq!(profile.speed_m_s, [4.0, 0.0]);
    }

    #[test]
    fn the_highest_speed_and_the_last_depth_are_kept() {
        let mut recorder = Recorder::new(stations());
        for (x, speed) in [(0.5, 2.0), (1.0, 6.0), (2.5, 1.0)] {
            recorder.take([&[x, x], &[0.5, 1.5]], [&[speed, speed], &[0.0; 2]], &[1.0; 2]);
        }
        let profile = recorder.finish();
        assert_eq!(profile.depth_m, [0.0, 1.0]);
        assert_eq!(profile.speed_m_s, [6.0, 1.0]);
    }
}
