//! Estimates with their intervals, a labelled row each, over one axis.

use super::axes::{Axis, Frame};
use super::{Anchor, Canvas, Draw, GREY, GRID, INK, PictureError, TEXT_PX};
use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

const WIDTH_PX: i32 = 2000;
const LEFT_PX: i32 = 760;
const RIGHT_PX: i32 = 60;
const TOP_PX: i32 = 20;
const BOTTOM_PX: i32 = 120;
const LEGEND_PX: i32 = 56;
const ROW_PX: i32 = 58;
/// Distance between the estimates of one row.
const APART_PX: i32 = 20;
const DOT_RADIUS_PX: i32 = 9;

/// An estimate with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whisker {
    /// Estimate.
    pub value: f64,
    /// Interval.
    pub interval: [f64; 2],
}

/// A labelled row: one estimate a series, absent where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Label.
    pub label: String,
    /// One a series.
    pub whiskers: Vec<Option<Whisker>>,
}

/// The picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Forest {
    /// The axis of the values.
    pub axis: Axis,
    /// Names and colours of the series.
    pub series: Vec<(String, RGBColor)>,
    /// Rows from top to bottom.
    pub rows: Vec<Row>,
}

impl Draw for Forest {
    fn size(&self) -> (u32, u32) {
        let height = LEGEND_PX + TOP_PX + ROW_PX * self.rows.len() as i32 + BOTTOM_PX;
        (WIDTH_PX as u32, height as u32)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        let top = LEGEND_PX + TOP_PX;
        let frame = Frame {
            left: LEFT_PX,
            top,
            right: WIDTH_PX - RIGHT_PX,
            bottom: top + ROW_PX * self.rows.len() as i32,
            x: self.axis.clone(),
            y: Axis::linear("", 0.0, 1.0),
        };
        self.draw_scale(canvas, &frame)?;
        for (i, row) in self.rows.iter().enumerate() {
            let y = top + ROW_PX * i as i32 + ROW_PX / 2;
            canvas.path(vec![(frame.left, y), (frame.right, y)], GRID, 1)?;
            canvas.text(&row.label, (frame.left - 24, y), TEXT_PX, INK, Anchor::Right)?;
            let first = y - APART_PX * (self.series.len() as i32 - 1) / 2;
            for (k, (whisker, (_, colour))) in row.whiskers.iter().zip(&self.series).enumerate() {
                let Some(whisker) = whisker else { continue };
                draw_whisker(canvas, &frame, whisker, first + APART_PX * k as i32, *colour)?;
            }
        }
        let mut left = frame.left;
        for (name, colour) in &self.series {
            canvas.path(vec![(left, 30), (left + 60, 30)], *colour, 4)?;
            canvas.dot((left + 30, 30), DOT_RADIUS_PX, *colour)?;
            canvas.text(name, (left + 76, 30), TEXT_PX, INK, Anchor::Left)?;
            left += (frame.right - frame.left) / self.series.len() as i32;
        }
        Ok(())
    }
}

impl Forest {
    fn draw_scale<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        let ticks = frame.x.ticks(8);
        let step = ticks.get(1).map_or(1.0, |t| t - ticks[0]);
        for &tick in &ticks {
            let x = frame.x_px(tick).round() as i32;
            let is_zero = tick.abs() < 1e-9 * step;
            let (colour, width) = if is_zero { (GREY, 3) } else { (GRID, 2) };
            canvas.path(vec![(x, frame.top), (x, frame.bottom)], colour, width)?;
            let at = (x, frame.bottom + TEXT_PX as i32);
            canvas.text(&frame.x.tick_text(tick, step), at, TEXT_PX, INK, Anchor::Centre)?;
        }
        canvas.path(vec![(frame.left, frame.bottom), (frame.right, frame.bottom)], INK, 2)?;
        let middle = ((frame.left + frame.right) / 2, frame.bottom + TEXT_PX as i32 * 5 / 2);
        canvas.text(&frame.x.label, middle, TEXT_PX, INK, Anchor::Centre)
    }
}

fn draw_whisker<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    frame: &Frame,
    whisker: &Whisker,
    y: i32,
    colour: RGBColor,
) -> Result<(), PictureError> {
    let at = |value: f64| frame.x_px(value.clamp(frame.x.low, frame.x.high)).round() as i32;
    canvas.path(vec![(at(whisker.interval[0]), y), (at(whisker.interval[1]), y)], colour, 4)?;
    canvas.dot((at(whisker.value), y), DOT_RADIUS_PX, colour)
}
