//! A case's figure: references as lines, what was found as circles or dots, the legend above the frame.

use crate::picture::axes::{Axis, Frame};
use crate::picture::chart::SERIES;
use crate::picture::{Anchor, Canvas, Draw, INK, PictureError, TEXT_PX};
use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;
use runout_core::validation::{Figure, Marks, Series};

const WIDTH_PX: i32 = 1300;
const LEFT_PX: i32 = 215;
const RIGHT_PX: i32 = 60;
const PLOT_PX: i32 = 620;
const BOTTOM_PX: i32 = 130;
/// Room above the frame without a legend, and for a title.
const TOP_PX: i32 = 30;
const TITLE_PX: i32 = 56;
const LEGEND_ROW_PX: i32 = 48;
const SAMPLE_PX: i32 = 60;
/// Mean advance of a character of the font over its size.
const CHARACTER_SHARE: f64 = 0.47;
/// Room between the data and the frame, share of their range.
const MARGIN_SHARE: f64 = 0.04;
/// Lowest and tallest frame of a figure with equal axes, px.
const EQUAL_PX: (f64, f64) = (160.0, 1000.0);
const LETTERS_ABOVE_PX: i32 = 6;
const CIRCLE_PX: f64 = 9.0;
const DOT_PX: f64 = 4.0;
const LINE_PX: u32 = 4;

/// A figure on its way to paper.
pub(super) struct Picture<'a> {
    pub(super) figure: &'a Figure,
    /// Whether it bears its title: on a page the caption does.
    pub(super) titled: bool,
}

impl Picture<'_> {
    /// Range of the data on an axis, with a margin.
    fn range(&self, axis: usize) -> (f64, f64) {
        let values = self.figure.series.iter().flat_map(|s| s.points.iter().map(move |p| p[axis]));
        let (low, high) = values
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (f64::min(l, v), f64::max(h, v)));
        if low > high {
            return (0.0, 1.0);
        }
        let margin = MARGIN_SHARE * if high > low { high - low } else { high.abs().max(1e-12) };
        (low - margin, high + margin)
    }

    fn plot_px(&self) -> i32 {
        if !self.figure.equal_axes {
            return PLOT_PX;
        }
        let ((x0, x1), (y0, y1)) = (self.range(0), self.range(1));
        let height = f64::from(WIDTH_PX - LEFT_PX - RIGHT_PX) * (y1 - y0) / (x1 - x0);
        height.clamp(EQUAL_PX.0, EQUAL_PX.1).round() as i32
    }

    /// Colour of series `k`: references and what is compared with them are paired in order; a lone line is ink.
    fn colour(&self, k: usize) -> RGBColor {
        let series = &self.figure.series;
        let is_line = |s: &Series| s.marks == Marks::Line;
        let before = series[..k].iter().filter(|s| is_line(s) == is_line(&series[k])).count();
        let lines = series.iter().filter(|s| is_line(s)).count();
        if is_line(&series[k]) && lines == 1 { INK } else { SERIES[before % SERIES.len()] }
    }

    /// The named series and where in the legend each stands: offset from the frame's left, row.
    fn legend(&self) -> Vec<(usize, i32, i32)> {
        let width = WIDTH_PX - LEFT_PX - RIGHT_PX;
        let (mut x, mut row) = (0, 0);
        let mut places = Vec::new();
        for (k, series) in self.figure.series.iter().enumerate().filter(|(_, s)| !s.label.is_empty()) {
            let text = (series.label.chars().count() as f64 * CHARACTER_SHARE * f64::from(TEXT_PX)) as i32;
            let entry = SAMPLE_PX + 16 + text + 40;
            if x > 0 && x + entry > width {
                (x, row) = (0, row + 1);
            }
            places.push((k, x, row));
            x += entry;
        }
        places
    }

    /// Upper edge of the legend.
    fn legend_px(&self) -> i32 {
        if self.titled { TITLE_PX } else { 0 }
    }

    fn top_px(&self) -> i32 {
        self.legend_px() + TOP_PX + self.legend().last().map_or(0, |(_, _, row)| (row + 1) * LEGEND_ROW_PX)
    }
}

impl Draw for Picture<'_> {
    fn size(&self) -> (u32, u32) {
        (WIDTH_PX as u32, (self.top_px() + self.plot_px() + BOTTOM_PX) as u32)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        let (_, height) = self.size();
        let (x, y) = (self.range(0), self.range(1));
        let right = if self.figure.equal_axes {
            let scale = f64::from(self.plot_px()) / (y.1 - y.0);
            LEFT_PX + ((x.1 - x.0) * scale).round().min(f64::from(WIDTH_PX - LEFT_PX - RIGHT_PX)) as i32
        } else {
            WIDTH_PX - RIGHT_PX
        };
        let frame = Frame {
            left: LEFT_PX,
            top: self.top_px(),
            right,
            bottom: height as i32 - BOTTOM_PX,
            x: Axis::linear(&self.figure.x, x.0, x.1),
            y: Axis::linear(&self.figure.y, y.0, y.1),
        };
        if self.titled {
            canvas.text(&self.figure.title, (LEFT_PX, TITLE_PX / 2 + 6), TEXT_PX, INK, Anchor::Left)?;
        }
        frame.draw(canvas, true)?;
        let order = |lines: bool| {
            (0..self.figure.series.len())
                .filter(move |&k| (self.figure.series[k].marks == Marks::Line) == lines)
        };
        for k in order(true).chain(order(false)) {
            draw_series(canvas, &frame, &self.figure.series[k], self.colour(k))?;
        }
        frame.draw_edges(canvas)?;
        self.draw_legend(canvas, &frame)
    }
}

impl Picture<'_> {
    fn draw_legend<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        for (k, x, row) in self.legend() {
            let series = &self.figure.series[k];
            let y = self.legend_px() + TOP_PX / 2 + LEGEND_ROW_PX / 2 + row * LEGEND_ROW_PX;
            // The font's letters stand a little above the middle of their line.
            let (left, y) = (frame.left + x, y - LETTERS_ABOVE_PX);
            let (colour, middle) = (self.colour(k), (left + SAMPLE_PX / 2, y));
            match series.marks {
                Marks::Line => canvas.path(vec![(left, y), (left + SAMPLE_PX, y)], colour, LINE_PX)?,
                Marks::Circles => circle(canvas, middle, colour)?,
                Marks::Dots => dot(canvas, middle, colour)?,
            }
            canvas.text(
                &series.label,
                (left + SAMPLE_PX + 16, y + LETTERS_ABOVE_PX),
                TEXT_PX,
                INK,
                Anchor::Left,
            )?;
        }
        Ok(())
    }
}

fn draw_series<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    frame: &Frame,
    series: &Series,
    colour: RGBColor,
) -> Result<(), PictureError> {
    let finite = series.points.iter().filter(|p| p[0].is_finite() && p[1].is_finite());
    let mut pixels = finite.map(|p| frame.point(p[0], p[1]));
    match series.marks {
        Marks::Line => canvas.path(pixels.collect(), colour, LINE_PX),
        Marks::Circles => pixels.try_for_each(|at| circle(canvas, at, colour)),
        Marks::Dots => pixels.try_for_each(|at| dot(canvas, at, colour)),
    }
}

/// Corners of a regular polygon that stands for a circle.
fn round(at: (i32, i32), radius: f64, corners: u32) -> Vec<(i32, i32)> {
    (0..=corners)
        .map(|k| {
            let (sin, cos) = (2.0 * std::f64::consts::PI * f64::from(k) / f64::from(corners)).sin_cos();
            (at.0 + (radius * cos).round() as i32, at.1 + (radius * sin).round() as i32)
        })
        .collect()
}

fn circle<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    at: (i32, i32),
    colour: RGBColor,
) -> Result<(), PictureError> {
    canvas.path(round(at, CIRCLE_PX, 16), colour, 3)
}

fn dot<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    at: (i32, i32),
    colour: RGBColor,
) -> Result<(), PictureError> {
    canvas.polygon(round(at, DOT_PX, 8), colour, 1.0)
}
