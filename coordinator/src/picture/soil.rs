//! The soil as filled squares coloured by a quantity: one panel a quantity, equal scales on both axes.

use super::axes::{Axis, Frame, round_ticks};
use super::setting::Setting;
use super::{Anchor, Canvas, Draw, GREY, INK, PictureError, TEXT_PX};
use colorous::Gradient;
use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;
use std::borrow::Cow;

const WIDTH_PX: i32 = 2000;
const LEFT_PX: i32 = 190;
const RIGHT_PX: i32 = 290;
const TITLE_PX: i32 = 130;
const HEADING_PX: i32 = 36;
const AXIS_PX: i32 = 125;
const BAR_PX: i32 = 34;
/// A tall narrow slope is drawn smaller, so that the picture stays on a screen.
const TALLEST_PANEL_PX: f64 = 1100.0;
/// Side of a drawn square over its point's.
const OVERLAP: f64 = 1.1;
/// The same for the squares drawn first, which fill what sheared soil would show of the page between its points.
const UNDERLAY: f64 = 1.8;
/// Longest scale bar, as a share of the picture's width.
const SCALE_SHARE: f64 = 0.16;
/// Room around the material, m per m of its height.
const MARGIN_SHARE: f64 = 0.07;

/// A picture of the soil.
#[derive(Debug, Clone)]
pub struct SoilPicture<'a> {
    /// First line.
    pub title: String,
    /// Second line, smaller.
    pub subtitle: String,
    /// Ground before, layers, water, obstacles, base.
    pub setting: Setting,
    /// Whether the soil may have moved: sheared soil has gaps between its points.
    pub moved: bool,
    /// Side of the square drawn for a point, m.
    pub point_size_m: f64,
    /// Quantities, from top to bottom.
    pub panels: Vec<Panel<'a>>,
    /// What is shown, m; absent: everything drawn. The same for all pictures of an animation.
    pub view: Option<View>,
}

/// A rectangle of the section, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Left and right end.
    pub x: (f64, f64),
    /// Lower and upper end.
    pub y: (f64, f64),
}

impl View {
    /// The smallest view that holds both.
    pub fn and(self, other: View) -> View {
        let both = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
        View { x: both(self.x, other.x), y: both(self.y, other.y) }
    }
}

/// A quantity on the points.
#[derive(Debug, Clone)]
pub struct Panel<'a> {
    /// Its name and unit.
    pub label: String,
    /// Points' horizontal positions, m.
    pub x: Cow<'a, [f64]>,
    /// Points' elevations, m.
    pub y: Cow<'a, [f64]>,
    /// The quantity at the points.
    pub values: Vec<f64>,
    /// Values at the ends of the colour bar.
    pub range: (f64, f64),
    /// Colours, from the low to the high end.
    pub gradient: Gradient,
    /// Whether the gradient is turned round.
    pub reversed: bool,
}

/// Range of `values` for a colour bar: from 0 if `from_zero`, to the largest finite value.
pub fn range(values: &[f64], from_zero: bool) -> (f64, f64) {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (f64::min(l, v), f64::max(h, v)));
    let low = if from_zero || !low.is_finite() { 0.0 } else { low };
    if high > low { (low, high) } else { (low, low + 1.0) }
}

impl SoilPicture<'_> {
    /// What is shown.
    pub fn view(&self) -> View {
        self.view.unwrap_or_else(|| self.everything())
    }

    /// Horizontal and vertical range of everything drawn, m.
    fn everything(&self) -> View {
        let xs =
            self.panels.iter().flat_map(|p| p.x.iter().copied()).chain(self.setting.corners().map(|c| c.0));
        let ys =
            self.panels.iter().flat_map(|p| p.y.iter().copied()).chain(self.setting.corners().map(|c| c.1));
        let span = |values: &mut dyn Iterator<Item = f64>| {
            values
                .filter(|v| v.is_finite())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (f64::min(l, v), f64::max(h, v)))
        };
        let (x, y) = (span(&mut { xs }), span(&mut { ys }));
        if !(x.0.is_finite() && y.0.is_finite()) {
            return View { x: (0.0, 1.0), y: (0.0, 1.0) };
        }
        let margin = MARGIN_SHARE * (y.1 - y.0).max(self.point_size_m);
        let half = self.point_size_m / 2.0;
        View {
            x: (x.0 - half, x.1 + half + margin),
            y: (y.0.min(self.setting.base_m) - margin / 2.0, y.1 + half + margin),
        }
    }

    /// Colours besides the panels' gradients, for formats that have few.
    pub(super) fn setting_colours(&self) -> Vec<[u8; 3]> {
        self.setting.colours().map(|c| [c.0, c.1, c.2]).to_vec()
    }

    /// Pixels per metre.
    fn scale(&self) -> f64 {
        let View { x: (x0, x1), y: (y0, y1) } = self.view();
        let by_width = f64::from(WIDTH_PX - LEFT_PX - RIGHT_PX) / (x1 - x0);
        by_width.min(TALLEST_PANEL_PX / (y1 - y0))
    }

    fn panel_height(&self) -> i32 {
        let View { y: (y0, y1), .. } = self.view();
        (self.scale() * (y1 - y0)).round() as i32
    }

    fn draw_panel<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        panel: &Panel<'_>,
        top: i32,
    ) -> Result<(), PictureError> {
        let View { x: (x0, x1), y: (y0, y1) } = self.view();
        let frame = Frame {
            left: LEFT_PX,
            top,
            right: LEFT_PX + (self.scale() * (x1 - x0)).round() as i32,
            bottom: top + self.panel_height(),
            x: Axis::linear("horizontal distance from the initial toe (m)", x0, x1),
            y: Axis::linear("elevation (m)", y0, y1),
        };
        self.setting.draw_free_water(canvas, &frame)?;
        if !self.moved {
            // Where a panel has no points: layers without random fields.
            self.setting.draw_ground(canvas, &frame)?;
        }
        let sizes: &[f64] = if self.moved { &[UNDERLAY, OVERLAP] } else { &[OVERLAP] };
        for size in sizes {
            self.draw_points(canvas, panel, &frame, size * self.point_size_m / 2.0)?;
        }
        self.setting.draw_over(canvas, &frame)?;
        frame.draw_edges(canvas)?;
        frame.draw(canvas, false)?;
        draw_scale(canvas, &frame)?;
        draw_bar(canvas, panel, &frame)
    }

    /// The points as squares of twice `half` m, coloured by their values.
    fn draw_points<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        panel: &Panel<'_>,
        frame: &Frame,
        half: f64,
    ) -> Result<(), PictureError> {
        for ((&x, &y), &value) in panel.x.iter().zip(panel.y.iter()).zip(&panel.values) {
            if !(x.is_finite() && y.is_finite()) {
                continue;
            }
            let from = (frame.x_px(x - half).round() as i32, frame.y_px(y + half).round() as i32);
            // Squares are a little larger than their points' share: the wall is where they end.
            let from = (from.0.max(frame.left), from.1);
            let to = (frame.x_px(x + half).round() as i32, frame.y_px(y - half).round() as i32);
            let to = (to.0.max(from.0 + 1), to.1.max(from.1 + 1));
            canvas.rectangle(from, to, colour(panel, value), 1.0)?;
        }
        Ok(())
    }
}

impl Draw for SoilPicture<'_> {
    fn size(&self) -> (u32, u32) {
        let panel = HEADING_PX + self.panel_height() + AXIS_PX;
        (WIDTH_PX as u32, (TITLE_PX + panel * self.panels.len() as i32) as u32)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        let (width, height) = self.size();
        canvas.rectangle((0, 0), (width as i32, height as i32), RGBColor(255, 255, 255), 1.0)?;
        canvas.text(&self.title, (LEFT_PX, 50), 50, INK, Anchor::Left)?;
        canvas.text(&self.subtitle, (LEFT_PX, 108), TEXT_PX, GREY, Anchor::Left)?;
        for (i, panel) in self.panels.iter().enumerate() {
            let top = TITLE_PX + HEADING_PX + i as i32 * (HEADING_PX + self.panel_height() + AXIS_PX);
            self.draw_panel(canvas, panel, top)?;
        }
        Ok(())
    }
}

/// A bar of round length in the frame's upper right corner, where the air in front of the slope is.
fn draw_scale<B: DrawingBackend>(canvas: &Canvas<'_, B>, frame: &Frame) -> Result<(), PictureError> {
    let width_m = frame.x.high - frame.x.low;
    let length_m = round_ticks(0.0, SCALE_SHARE * width_m, 3).last().copied().unwrap_or(1.0);
    let length_px = (length_m / width_m * f64::from(frame.right - frame.left)).round() as i32;
    let (right, y) = (frame.right - 24, frame.top + 20);
    canvas.path(vec![(right - length_px, y), (right, y)], INK, 5)?;
    for end in [right - length_px, right] {
        canvas.path(vec![(end, y - 9), (end, y + 9)], INK, 3)?;
    }
    let at = (right - length_px / 2, y + 30);
    canvas.text(&format!("{length_m} m"), at, TEXT_PX, INK, Anchor::Centre)
}

/// The colour bar at the frame's right, with the quantity's name.
fn draw_bar<B: DrawingBackend>(
    canvas: &Canvas<'_, B>,
    panel: &Panel<'_>,
    frame: &Frame,
) -> Result<(), PictureError> {
    let left = frame.right + 36;
    let (low, high) = panel.range;
    let height = frame.bottom - frame.top;
    for row in 0..height {
        let share = (f64::from(row) + 0.5) / f64::from(height);
        let py = frame.bottom - row - 1;
        canvas.rectangle(
            // Rows overlap, or a scaled drawing shows seams between them.
            (left, (py - 1).max(frame.top)),
            (left + BAR_PX, py + 1),
            colour(panel, low + share * (high - low)),
            1.0,
        )?;
    }
    let ticks = round_ticks(low, high, (height / 70).clamp(2, 8) as usize);
    let step = ticks.get(1).map_or(1.0, |t| t - ticks[0]);
    let axis = Axis::linear("", low, high);
    for tick in ticks {
        let py = frame.bottom - (axis.share(tick) * f64::from(height)).round() as i32;
        canvas.path(vec![(left + BAR_PX, py), (left + BAR_PX + 8, py)], INK, 2)?;
        canvas.text(&axis.tick_text(tick, step), (left + BAR_PX + 16, py), TEXT_PX, INK, Anchor::Left)?;
    }
    canvas.upward_text(&panel.label, (left + BAR_PX + 150, (frame.top + frame.bottom) / 2), TEXT_PX, INK)
}

fn colour(panel: &Panel<'_>, value: f64) -> RGBColor {
    let share = (value - panel.range.0) / (panel.range.1 - panel.range.0);
    if !share.is_finite() {
        return RGBColor(0xff, 0x00, 0xff);
    }
    let share = share.clamp(0.0, 1.0);
    let c = panel.gradient.eval_continuous(if panel.reversed { 1.0 - share } else { share });
    RGBColor(c.r, c.g, c.b)
}
