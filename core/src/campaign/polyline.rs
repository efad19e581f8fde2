//! A line through points whose x never falls: ground surface, water table, boundary of a layer.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Most points of a line: it is part of every realisation's spec.
pub const MOST_POINTS: usize = 10_000;

/// A line through points (x, y), m, from left to right; level beyond its ends, so that one point is a level line.
/// Two points of the same x make a vertical step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct Polyline {
    points: Vec<[f64; 2]>,
}

/// Points that make no line. They count from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum LineFault {
    /// There is no point.
    #[error("a line has at least one point [x, y]")]
    Empty,
    /// There are more than [`MOST_POINTS`].
    #[error("a line has at most {MOST_POINTS} points")]
    TooMany,
    /// A coordinate of this point is no finite number.
    #[error("point {0}: coordinates must be finite")]
    NotFinite(usize),
    /// This point lies left of the one before.
    #[error("point {0}: x must grow from left to right, or stay the same once (a vertical step)")]
    Backwards(usize),
    /// This point is the third of the same x.
    #[error("point {0}: no more than two points may have the same x (a vertical step)")]
    ThirdOfStep(usize),
}

impl TryFrom<Vec<[f64; 2]>> for Polyline {
    type Error = LineFault;

    fn try_from(points: Vec<[f64; 2]>) -> Result<Polyline, LineFault> {
        Polyline::new(points)
    }
}

impl From<Polyline> for Vec<[f64; 2]> {
    fn from(line: Polyline) -> Vec<[f64; 2]> {
        line.points
    }
}

impl Polyline {
    /// A line through these points.
    ///
    /// # Errors
    /// No point or too many, a coordinate that is not finite, an x that falls, or three points of one x.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Polyline, LineFault> {
        if points.is_empty() {
            return Err(LineFault::Empty);
        }
        if points.len() > MOST_POINTS {
            return Err(LineFault::TooMany);
        }
        for (i, point) in points.iter().enumerate() {
            if !(point[0].is_finite() && point[1].is_finite()) {
                return Err(LineFault::NotFinite(i + 1));
            }
            if i > 0 && point[0] < points[i - 1][0] {
                return Err(LineFault::Backwards(i + 1));
            }
            if i > 1 && point[0] == points[i - 2][0] {
                return Err(LineFault::ThirdOfStep(i + 1));
            }
        }
        Ok(Polyline { points })
    }

    /// A level line.
    pub fn level(y: f64) -> Polyline {
        Polyline { points: vec![[0.0, y]] }
    }

    /// Its points.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The line in coordinates whose origin is at `origin`.
    pub fn seen_from(&self, origin: [f64; 2]) -> Polyline {
        Polyline { points: self.points.iter().map(|p| [p[0] - origin[0], p[1] - origin[1]]).collect() }
    }

    /// Its y at `x`; at a step that of the step's left side.
    pub fn y_at(&self, x: f64) -> f64 {
        let next = self.points.partition_point(|p| p[0] < x);
        match (next.checked_sub(1), self.points.get(next)) {
            (_, Some(point)) if point[0] == x => point[1],
            (Some(before), Some(point)) => between(self.points[before], *point, x),
            (None, _) => self.points[0][1],
            (Some(before), None) => self.points[before][1],
        }
    }

    /// Its y at `x`; at a step that of the step's right side.
    pub fn y_after(&self, x: f64) -> f64 {
        let next = self.points.partition_point(|p| p[0] <= x);
        match next.checked_sub(1) {
            Some(before) if self.points[before][0] == x => self.points[before][1],
            _ => self.y_at(x),
        }
    }

    /// The part between two different x, from left to right, ends included.
    pub fn between(&self, left: f64, right: f64) -> Vec<[f64; 2]> {
        let inside = self.points.iter().copied().filter(|p| p[0] > left && p[0] < right);
        std::iter::once([left, self.y_after(left)])
            .chain(inside)
            .chain(std::iter::once([right, self.y_at(right)]))
            .collect()
    }
}

/// y at `x` on the line from `a` to `b`, a[0] < x < b[0].
fn between(a: [f64; 2], b: [f64; 2], x: f64) -> f64 {
    a[1] + (b[1] - a[1]) * ((x - a[0]) / (b[0] - a[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_linear_between_its_points_and_level_beyond() {
        let line = Polyline::new(vec![[-2.0, 4.0], [0.0, 2.0], [0.0, 0.0], [4.0, 1.0]]).unwrap();
        for (x, y) in [(-9.0, 4.0), (-2.0, 4.0), (-1.0, 3.0), (0.0, 2.0), (2.0, 0.5), (4.0, 1.0), (9.0, 1.0)]
        {
            assert_eq!(line.y_at(x), y, "at {x}");
        }
        assert_eq!(line.y_after(0.0), 0.0);
        assert_eq!(line.y_after(-2.0), 4.0);
        assert_eq!(line.y_after(2.0), 0.5);
        assert_eq!(Polyline::level(3.0).y_at(-7.0), 3.0);
        assert_eq!(Polyline::level(3.0).y_after(7.0), 3.0);
    }

    #[test]
    fn a_piece_of_a_line_has_the_side_of_a_step_that_lies_inside() {
        let line = Polyline::new(vec![[-2.0, 4.0], [0.0, 2.0], [0.0, 0.0], [4.0, 1.0]]).unwrap();
        assert_eq!(line.between(-3.0, 0.0), [[-3.0, 4.0], [-2.0, 4.0], [0.0, 2.0]]);
        assert_eq!(line.between(0.0, 2.0), [[0.0, 0.0], [2.0, 0.5]]);
        assert_eq!(line.seen_from([1.0, -1.0]).points()[3], [3.0, 2.0]);
    }

    #[test]
    fn points_that_make_no_line_are_refused() {
        assert_eq!(Polyline::new(Vec::new()), Err(LineFault::Empty));
        assert_eq!(Polyline::new(vec![[0.0, f64::NAN]]), Err(LineFault::NotFinite(1)));
        assert_eq!(Polyline::new(vec![[0.0, 1.0], [-1.0, 1.0]]), Err(LineFault::Backwards(2)));
        assert_eq!(Polyline::new(vec![[0.0, 1.0]; 3]), Err(LineFault::ThirdOfStep(3)));
        let many = (0..=MOST_POINTS).map(|i| [i as f64, 0.0]).collect();
        assert_eq!(Polyline::new(many), Err(LineFault::TooMany));
        // Nor does a spec smuggle them in.
        let line: Polyline = serde_json::from_str("[[0.0,1.5],[2.0,1.0]]").unwrap();
        assert_eq!(serde_json::to_string(&line).unwrap(), "[[0.0,1.5],[2.0,1.0]]");
        assert!(
            serde_json::from_str::<Polyline>("[]").unwrap_err().to_string().contains("at least one point")
        );
    }
}
