//! A line through points whose x never falls: ground surface, water table, boundary of a layer.

use serde::{Deserialize, Serialize};

/// A line through points (x, y), m, from left to right; level beyond its ends, so that one point is a level line.
/// Two points of the same x make a vertical step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Polyline {
    points: Vec<[f64; 2]>,
}

/// Points that make no line. They count from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFault {
    /// There is no point.
    Empty,
    /// A coordinate of this point is no finite number.
    NotFinite(usize),
    /// This point lies left of the one before.
    Backwards(usize),
    /// This point is the third of the same x.
    ThirdOfStep(usize),
}

impl Polyline {
    /// A line through these points.
    ///
    /// # Errors
    /// No point, a coordinate that is not finite, an x that falls, or three points of one x.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Polyline, LineFault> {
        if points.is_empty() {
            return Err(LineFault::Empty);
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
    }
}
