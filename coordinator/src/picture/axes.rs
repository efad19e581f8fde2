//! Axes: data to pixels, round ticks, grid and labels.

use super::{Anchor, Canvas, GRID, INK, PictureError, TEXT_PX};
use plotters::backend::DrawingBackend;

const TICK_PX: i32 = 10;
const MINOR_TICK_PX: i32 = 6;

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What it shows, with the unit.
    pub label: String,
    /// Value at the left or lower end.
    pub low: f64,
    /// Value at the right or upper end.
    pub high: f64,
    /// Whether it is logarithmic; then `low` is positive.
    pub logarithmic: bool,
    /// Whether ticks are shown as percentages.
    pub percent: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str, low: f64, high: f64) -> Axis {
        // A range of zero width would divide by zero.
        let high = if high > low { high } else { low + 1.0 };
        Axis { label: label.to_owned(), low, high, logarithmic: false, percent: false }
    }

    /// A logarithmic axis; `low` is positive.
    pub fn logarithmic(label: &str, low: f64, high: f64) -> Axis {
        Axis { logarithmic: true, ..Axis::linear(label, low, high) }
    }

    /// The same axis with ticks as percentages.
    pub fn percent(self) -> Axis {
        Axis { percent: true, ..self }
    }

    /// Position of `value` along the axis, 0 at the low end and 1 at the high end.
    pub fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value.max(self.low * 1e-3) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Round values on the axis.
    pub fn ticks(&self, most: usize) -> Vec<f64> {
        if self.logarithmic {
            let first = self.low.log10().ceil() as i32;
            let last = (self.high.log10() + 1e-9).floor() as i32;
            return (first..=last).map(|e| 10f64.powi(e)).collect();
        }
        round_ticks(self.low, self.high, most)
    }

    /// Values between the ticks of a logarithmic axis: 2 to 9 times each power of ten; none on a linear axis.
    pub fn minor_ticks(&self) -> Vec<f64> {
        if !self.logarithmic {
            return Vec::new();
        }
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let within = |v: &f64| (self.low..=self.high).contains(v);
        decades.flat_map(|e| (2..10).map(move |k| f64::from(k) * 10f64.powi(e))).filter(within).collect()
    }

    /// A tick's label.
    pub fn tick_text(&self, value: f64, step: f64) -> String {
        let (value, step) = if self.percent { (100.0 * value, 100.0 * step) } else { (value, step) };
        let of = if self.logarithmic { value } else { step };
        let decimals = (-(of.abs().log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize;
        // A minus before zero is noise.
        let text = format!("{:.decimals$}", if value.abs() < step.abs() * 1e-9 { 0.0 } else { value });
        let text = text.replace('-', "\u{2212}");
        if self.percent { format!("{text} %") } else { text }
    }
}

/// At most about `most` multiples of 1, 2 or 5 times a power of ten between `low` and `high`.
pub fn round_ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let rough = (high - low) / most.max(1) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// The rectangle in which data are drawn, px.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Left edge.
    pub left: i32,
    /// Upper edge.
    pub top: i32,
    /// Right edge.
    pub right: i32,
    /// Lower edge.
    pub bottom: i32,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
}

impl Frame {
    /// Pixel of a value on the horizontal axis, unrounded.
    pub fn x_px(&self, value: f64) -> f64 {
        f64::from(self.left) + self.x.share(value) * f64::from(self.right - self.left)
    }

    /// Pixel of a value on the vertical axis, unrounded.
    pub fn y_px(&self, value: f64) -> f64 {
        f64::from(self.bottom) - self.y.share(value) * f64::from(self.bottom - self.top)
    }

    /// Pixel of a point, kept inside the frame.
    pub fn point(&self, x: f64, y: f64) -> (i32, i32) {
        let px = self.x_px(x).round().clamp(f64::from(self.left), f64::from(self.right));
        let py = self.y_px(y).round().clamp(f64::from(self.top), f64::from(self.bottom));
        (px as i32, py as i32)
    }

    /// Grid lines (if `grid`), ticks, tick labels and axis labels.
    ///
    /// # Errors
    /// The backend's.
    pub fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>, grid: bool) -> Result<(), PictureError> {
        let most_x = ((self.right - self.left) / 130).clamp(2, 12) as usize;
        let most_y = ((self.bottom - self.top) / 90).clamp(2, 8) as usize;
        let xs = self.x.ticks(most_x);
        let ys = self.y.ticks(most_y);
        let step = |ticks: &[f64]| ticks.get(1).map_or(1.0, |t| t - ticks[0]);
        for &x in &xs {
            let px = self.x_px(x).round() as i32;
            if grid {
                canvas.path(vec![(px, self.top), (px, self.bottom)], GRID, 2)?;
            }
            canvas.path(vec![(px, self.bottom), (px, self.bottom + TICK_PX)], INK, 2)?;
            let text = self.x.tick_text(x, step(&xs));
            let at = (px, self.bottom + TICK_PX + TEXT_PX as i32 * 3 / 4);
            canvas.text(&text, at, TEXT_PX, INK, Anchor::Centre)?;
        }
        for &y in &ys {
            let py = self.y_px(y).round() as i32;
            if grid {
                canvas.path(vec![(self.left, py), (self.right, py)], GRID, 2)?;
            }
            canvas.path(vec![(self.left - TICK_PX, py), (self.left, py)], INK, 2)?;
            let text = self.y.tick_text(y, step(&ys));
            canvas.text(&text, (self.left - TICK_PX - 8, py), TEXT_PX, INK, Anchor::Right)?;
        }
        for y in self.y.minor_ticks() {
            let py = self.y_px(y).round() as i32;
            canvas.path(vec![(self.left - MINOR_TICK_PX, py), (self.left, py)], INK, 2)?;
        }
        let middle = ((self.left + self.right) / 2, self.bottom + TICK_PX + TEXT_PX as i32 * 2);
        canvas.text(&self.x.label, middle, TEXT_PX, INK, Anchor::Centre)?;
        let middle = (self.left - 140, (self.top + self.bottom) / 2);
        canvas.upward_text(&self.y.label, middle, TEXT_PX, INK)
    }

    /// Left and lower edge as lines.
    ///
    /// # Errors
    /// The backend's.
    pub fn draw_edges<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        let corner = [(self.left, self.top), (self.left, self.bottom), (self.right, self.bottom)];
        canvas.path(corner.to_vec(), INK, 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(round_ticks(-34.4, 12.0, 8), [-30.0, -20.0, -10.0, 0.0, 10.0]);
        assert_eq!(round_ticks(0.0, 0.5, 5), [0.0, 0.1, 0.2, 0.30000000000000004, 0.4, 0.5]);
        let axis = Axis::logarithmic("p", 1e-3, 1.0).percent();
        let texts: Vec<String> = axis.ticks(8).iter().map(|t| axis.tick_text(*t, 1.0)).collect();
        assert_eq!(texts, ["0.1 %", "1 %", "10 %", "100 %"]);
        assert_eq!(axis.minor_ticks().len(), 3 * 8);
        assert!(Axis::linear("x", 0.0, 1.0).minor_ticks().is_empty());
    }
}
