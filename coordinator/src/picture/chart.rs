//! Charts for the report: bars, bands, lines, marks and a legend in one frame.

use super::axes::{Axis, Frame};
use super::{Anchor, Canvas, Draw, GREY, INK, PictureError, TEXT_PX};
use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

/// Okabe and Ito's colours, told apart by the colour-blind: blue, vermillion, green, purple, orange, sky.
pub const SERIES: [RGBColor; 6] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xb4, 0x5f, 0x93),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];

const SIZE_PX: (u32, u32) = (1120, 740);
const LEFT_PX: i32 = 185;
const RIGHT_PX: i32 = 40;
const TOP_PX: i32 = 50;
const BOTTOM_PX: i32 = 120;
const LEGEND_LINE_PX: i32 = 46;

/// Something drawn in a chart; later layers cover earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub enum Layer {
    /// Histogram bars between neighbouring edges, from zero to each height.
    Bars {
        /// One more than there are heights, rising.
        edges: Vec<f64>,
        /// Heights.
        heights: Vec<f64>,
    },
    /// The area between two curves over the same abscissae: (x, low, high).
    Band(Vec<(f64, f64, f64)>),
    /// A curve.
    Line(Vec<(f64, f64)>),
    /// A dashed curve.
    Dashed(Vec<(f64, f64)>),
    /// Crosses.
    Marks(Vec<(f64, f64)>),
}

/// A layer with its colour and its name in the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What is drawn.
    pub layer: Layer,
    /// Colour.
    pub colour: RGBColor,
    /// Name in the legend.
    pub name: String,
}

impl Series {
    /// A named series.
    pub fn new(layer: Layer, colour: RGBColor, name: impl Into<String>) -> Series {
        Series { layer, colour, name: name.into() }
    }
}

/// A place for the legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Legend {
    /// The upper right corner.
    UpperRight,
    /// In a row above the frame, for charts that are full everywhere.
    Above,
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, from back to front.
    pub series: Vec<Series>,
    /// Where the legend stands.
    pub legend: Legend,
}

impl Draw for Chart {
    fn size(&self) -> (u32, u32) {
        SIZE_PX
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        let frame = Frame {
            left: LEFT_PX,
            top: TOP_PX,
            right: SIZE_PX.0 as i32 - RIGHT_PX,
            bottom: SIZE_PX.1 as i32 - BOTTOM_PX,
            x: self.x.clone(),
            y: self.y.clone(),
        };
        frame.draw(canvas, true)?;
        for series in &self.series {
            draw_layer(canvas, &frame, series)?;
        }
        frame.draw_edges(canvas)?;
        self.draw_legend(canvas, &frame)
    }
}

impl Chart {
    fn draw_legend<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        let count = self.series.len().max(1) as i32;
        for (i, series) in self.series.iter().enumerate() {
            let below_top = 30 + i as i32 * LEGEND_LINE_PX;
            let column = (frame.right - frame.left) / count;
            let (from, y, text_at, anchor) = match self.legend {
                Legend::UpperRight => {
                    (frame.right - 80, frame.top + below_top, frame.right - 96, Anchor::Right)
                }
                Legend::Above => {
                    let left = frame.left + i as i32 * column;
                    (left, frame.top - 26, left + 76, Anchor::Left)
                }
            };
            let line = [(from, y), (from + 60, y)];
            match series.layer {
                Layer::Bars { .. } | Layer::Band(_) => {
                    canvas.rectangle((from, y - 12), (from + 60, y + 12), series.colour, 0.3)?;
                }
                Layer::Line(_) => canvas.path(line.to_vec(), series.colour, 5)?,
                Layer::Dashed(_) => canvas.dashed(&line, series.colour, 4, DASH)?,
                Layer::Marks(_) => cross(canvas, (from + 30, y), series.colour)?,
            }
            canvas.text(&series.name, (text_at, y), TEXT_PX, INK, anchor)?;
        }
        Ok(())
    }
}

const DASH: (f64, f64) = (18.0, 12.0);

fn draw_layer<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    frame: &Frame,
    series: &Series,
) -> Result<(), PictureError> {
    let colour = series.colour;
    match &series.layer {
        Layer::Bars { edges, heights } => {
            for (pair, &height) in edges.windows(2).zip(heights) {
                let (left, top) = frame.point(pair[0], height);
                let (right, bottom) = frame.point(pair[1], frame.y.low);
                canvas.rectangle((left, top), (right, bottom), colour, 0.3)?;
                canvas.path(vec![(left, bottom), (left, top), (right, top), (right, bottom)], GREY, 2)?;
            }
            Ok(())
        }
        Layer::Band(points) if points.len() > 1 => {
            let lower = points.iter().map(|p| frame.point(p.0, p.1));
            let upper = points.iter().rev().map(|p| frame.point(p.0, p.2));
            canvas.polygon(lower.chain(upper).collect(), colour, 0.22)
        }
        Layer::Band(_) => Ok(()),
        Layer::Line(points) => canvas.path(visible(frame, points), colour, 5),
        Layer::Dashed(points) => canvas.dashed(&visible(frame, points), colour, 4, DASH),
        Layer::Marks(points) => points.iter().try_for_each(|p| cross(canvas, frame.point(p.0, p.1), colour)),
    }
}

/// The curve's points in pixels, without those below a logarithmic axis' low end or beyond the frame's right end.
fn visible(frame: &Frame, points: &[(f64, f64)]) -> Vec<(i32, i32)> {
    points
        .iter()
        .filter(|p| p.0.is_finite() && p.1.is_finite())
        .filter(|p| !frame.y.logarithmic || p.1 >= frame.y.low)
        .filter(|p| (frame.x.low..=frame.x.high).contains(&p.0))
        .map(|p| frame.point(p.0, p.1))
        .collect()
}

fn cross<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    (x, y): (i32, i32),
    colour: RGBColor,
) -> Result<(), PictureError> {
    canvas.path(vec![(x - 8, y - 8), (x + 8, y + 8)], colour, 3)?;
    canvas.path(vec![(x - 8, y + 8), (x + 8, y - 8)], colour, 3)
}
