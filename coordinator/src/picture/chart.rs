//! Charts for the report: bars, bands, lines, marks and a legend in one frame; alone or stacked over one abscissa.

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

/// A chart of half a page's width.
const HALF_PX: (i32, i32) = (1120, 740);
/// A chart as wide as the page, or a panel of a stack.
const WIDE_PX: (i32, i32) = (2000, 640);
const LEFT_PX: i32 = 185;
const RIGHT_PX: i32 = 40;
const TOP_PX: i32 = 36;
const BOTTOM_PX: i32 = 120;
/// Under a panel whose abscissa is that of the panel below.
const SHARED_BOTTOM_PX: i32 = 70;
const LEGEND_LINE_PX: i32 = 46;
/// Entries side by side in a legend above the frame, by the chart's width.
const LEGEND_COLUMNS: (usize, usize) = (3, 5);
/// Room for a legend's sample of a series, and for a letter of its name.
const KEY_PX: i32 = 90;
const LETTER_PX: i32 = 17;
const DOT_RADIUS_PX: i32 = 5;

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
    /// Small discs, for many values.
    Dots(Vec<(f64, f64)>),
    /// A dashed line at this abscissa, from bottom to top.
    Vertical(f64),
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
    /// In rows above the frame, for charts that are full everywhere.
    Above,
}

/// A chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, from back to front; series without a name are not in the legend.
    pub series: Vec<Series>,
    /// Where the legend stands.
    pub legend: Legend,
}

/// How wide a chart is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Width {
    /// Half the page: two stand side by side.
    Half,
    /// The whole page.
    Page,
}

/// Charts of the page's width, one below the other, over the same abscissa; or a single one of that width.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack(pub Vec<Chart>);

impl Draw for Chart {
    fn size(&self) -> (u32, u32) {
        (HALF_PX.0 as u32, (HALF_PX.1 + self.legend_px(Width::Half)) as u32)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        self.draw_at(canvas, Width::Half, 0, BOTTOM_PX)
    }
}

impl Draw for Stack {
    fn size(&self) -> (u32, u32) {
        let height: i32 = self.0.iter().map(Chart::stacked_px).sum();
        (WIDE_PX.0 as u32, (height + BOTTOM_PX - SHARED_BOTTOM_PX) as u32)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        let mut top = 0;
        for (i, chart) in self.0.iter().enumerate() {
            let bottom = if i + 1 == self.0.len() { BOTTOM_PX } else { SHARED_BOTTOM_PX };
            chart.draw_at(canvas, Width::Page, top, bottom)?;
            top += chart.stacked_px();
        }
        Ok(())
    }
}

impl Chart {
    /// Height in a stack, over the panel below.
    fn stacked_px(&self) -> i32 {
        WIDE_PX.1 + self.legend_px(Width::Page) - BOTTOM_PX + SHARED_BOTTOM_PX
    }

    /// Draws the chart below `top`, with `bottom` px under its frame.
    fn draw_at<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        size: Width,
        top: i32,
        bottom: i32,
    ) -> Result<(), PictureError> {
        let (width, height) = if size == Width::Page { WIDE_PX } else { HALF_PX };
        let top = top + self.legend_px(size);
        let mut x = self.x.clone();
        if bottom == SHARED_BOTTOM_PX {
            x.label.clear();
        }
        let frame = Frame {
            left: LEFT_PX,
            top: top + TOP_PX,
            right: width - RIGHT_PX,
            bottom: top + height - BOTTOM_PX,
            x,
            y: self.y.clone(),
        };
        frame.draw(canvas, true)?;
        for series in &self.series {
            draw_layer(canvas, &frame, series)?;
        }
        frame.draw_edges(canvas)?;
        self.draw_legend(canvas, &frame, size)
    }

    fn named(&self) -> impl Iterator<Item = &Series> {
        self.series.iter().filter(|series| !series.name.is_empty())
    }

    fn legend_columns(&self, size: Width) -> usize {
        let (most, width) = match size {
            Width::Half => (LEGEND_COLUMNS.0, HALF_PX.0),
            Width::Page => (LEGEND_COLUMNS.1, WIDE_PX.0),
        };
        let longest = self.named().map(|series| series.name.chars().count()).max().unwrap_or(0) as i32;
        let fitting = (width - LEFT_PX - RIGHT_PX) / (KEY_PX + LETTER_PX * longest);
        let most = most.min(fitting.max(1) as usize);
        // Rows of equal length.
        let count = self.named().count().max(1);
        count.div_ceil(count.div_ceil(most))
    }

    /// Height of a legend above the frame.
    fn legend_px(&self, size: Width) -> i32 {
        match self.legend {
            Legend::UpperRight => 0,
            Legend::Above => LEGEND_LINE_PX * self.named().count().div_ceil(self.legend_columns(size)) as i32,
        }
    }

    fn draw_legend<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
        size: Width,
    ) -> Result<(), PictureError> {
        let columns = self.legend_columns(size);
        let width = (frame.right - frame.left) / columns as i32;
        for (i, series) in self.named().enumerate() {
            let (from, y, text_at, anchor) = match self.legend {
                Legend::UpperRight => {
                    let y = frame.top + 30 + i as i32 * LEGEND_LINE_PX;
                    (frame.right - 80, y, frame.right - 96, Anchor::Right)
                }
                Legend::Above => {
                    let (row, column) = ((i / columns) as i32, (i % columns) as i32);
                    let left = frame.left + column * width;
                    let y = frame.top - 20 - self.legend_px(size) + (row + 1) * LEGEND_LINE_PX - 10;
                    (left, y, left + 76, Anchor::Left)
                }
            };
            draw_key(canvas, series, (from, y))?;
            canvas.text(&series.name, (text_at, y), TEXT_PX, INK, anchor)?;
        }
        Ok(())
    }
}

/// The legend's sample of a series, 60 px wide.
fn draw_key<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    series: &Series,
    (from, y): (i32, i32),
) -> Result<(), PictureError> {
    let line = [(from, y), (from + 60, y)];
    match series.layer {
        Layer::Bars { .. } => canvas.rectangle((from, y - 12), (from + 60, y + 12), series.colour, BARS),
        Layer::Band(_) => canvas.rectangle((from, y - 12), (from + 60, y + 12), series.colour, BAND),
        Layer::Line(_) => canvas.path(line.to_vec(), series.colour, 5),
        Layer::Dashed(_) | Layer::Vertical(_) => canvas.dashed(&line, series.colour, 4, DASH),
        Layer::Marks(_) => cross(canvas, (from + 30, y), series.colour),
        Layer::Dots(_) => canvas.dot((from + 30, y), DOT_RADIUS_PX, series.colour),
    }
}

const DASH: (f64, f64) = (18.0, 12.0);
/// Opacity of bars and of bands.
const BARS: f64 = 0.4;
const BAND: f64 = 0.25;

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
                canvas.rectangle((left, top), (right, bottom), colour, BARS)?;
                canvas.path(vec![(left, bottom), (left, top), (right, top), (right, bottom)], GREY, 2)?;
            }
            Ok(())
        }
        Layer::Band(points) if points.len() > 1 => {
            let lower = points.iter().map(|p| frame.point(p.0, p.1));
            let upper = points.iter().rev().map(|p| frame.point(p.0, p.2));
            canvas.polygon(lower.chain(upper).collect(), colour, BAND)
        }
        Layer::Band(_) => Ok(()),
        Layer::Line(points) => canvas.path(visible(frame, points), colour, 5),
        Layer::Dashed(points) => canvas.dashed(&visible(frame, points), colour, 4, DASH),
        Layer::Marks(points) => inside(frame, points).try_for_each(|p| cross(canvas, p, colour)),
        Layer::Dots(points) => inside(frame, points).try_for_each(|p| canvas.dot(p, DOT_RADIUS_PX, colour)),
        Layer::Vertical(x) if (frame.x.low..=frame.x.high).contains(x) => {
            let x = frame.x_px(*x).round() as i32;
            canvas.dashed(&[(x, frame.bottom), (x, frame.top)], colour, 4, DASH)
        }
        Layer::Vertical(_) => Ok(()),
    }
}

/// Pixels of the points that the frame holds.
fn inside<'a>(frame: &'a Frame, points: &'a [(f64, f64)]) -> impl Iterator<Item = (i32, i32)> + 'a {
    let holds = |p: &&(f64, f64)| {
        (frame.x.low..=frame.x.high).contains(&p.0) && (frame.y.low..=frame.y.high).contains(&p.1)
    };
    points.iter().filter(holds).map(|p| frame.point(p.0, p.1))
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
