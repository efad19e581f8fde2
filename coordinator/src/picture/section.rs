//! The section as given: ground, layers with their names, water, obstacles, base.

use super::axes::{Axis, Frame};
use super::setting::{Setting, WATER};
use super::{Anchor, Canvas, Draw, GREY, INK, PictureError, TEXT_PX};
use plotters::backend::DrawingBackend;
use runout_core::campaign::Model;
use runout_core::slope;

const WIDTH_PX: i32 = 2000;
const LEFT_PX: i32 = 190;
const RIGHT_PX: i32 = 60;
const TOP_PX: i32 = 40;
const AXIS_PX: i32 = 125;
/// A tall narrow slope is drawn smaller, so that the picture stays on a screen.
const TALLEST_PX: f64 = 900.0;
/// Room around the section, m per m of its height.
const MARGIN_SHARE: f64 = 0.07;

/// A picture of the section.
#[derive(Debug, Clone)]
pub struct Section {
    setting: Setting,
    /// Names of the layers and where they are written.
    names: Vec<(String, (f64, f64))>,
}

impl Section {
    /// The section of `model`, between its walls.
    pub fn of(model: &Model) -> Section {
        let (left, right) = (slope::rear_x(&model.slope), model.slope.runout_plain_m);
        Section { setting: Setting::of(model, right), names: names(model, left) }
    }

    fn extent(&self) -> ((f64, f64), (f64, f64)) {
        let span = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (f64::min(l, v), f64::max(h, v)))
        };
        let x = span(&mut self.setting.corners().map(|c| c.0));
        let y = span(&mut self.setting.corners().map(|c| c.1).chain([self.setting.base_m]));
        let margin = MARGIN_SHARE * (y.1 - y.0);
        (x, (y.0 - margin, y.1 + margin))
    }

    fn frame(&self) -> Frame {
        let ((x0, x1), (y0, y1)) = self.extent();
        let by_width = f64::from(WIDTH_PX - LEFT_PX - RIGHT_PX) / (x1 - x0);
        let scale = by_width.min(TALLEST_PX / (y1 - y0));
        Frame {
            left: LEFT_PX,
            top: TOP_PX,
            right: LEFT_PX + (scale * (x1 - x0)).round() as i32,
            bottom: TOP_PX + (scale * (y1 - y0)).round() as i32,
            x: Axis::linear("horizontal distance from the toe (m)", x0, x1),
            y: Axis::linear("elevation above the toe (m)", y0, y1),
        }
    }
}

/// Each layer's name where the layer is thickest, away from the walls, which would cut the name.
fn names(model: &Model, left: f64) -> Vec<(String, (f64, f64))> {
    const PLACES: usize = 200;
    const AWAY: usize = PLACES / 7;
    let right = model.slope.runout_plain_m;
    let base = -model.slope.foundation_depth_m;
    let mut thickest = vec![(0.0, (0.0, 0.0)); model.layers.len()];
    for i in AWAY..PLACES - AWAY {
        let x = left + (right - left) * i as f64 / PLACES as f64;
        let mut top = slope::ground_surface_y(&model.slope, x);
        for (layer, best) in model.layers.iter().zip(&mut thickest) {
            let bottom = layer.bottom.as_ref().map_or(base, |line| line.y_at(x).max(base)).min(top);
            if top - bottom > best.0 {
                *best = (top - bottom, (x, 0.5 * (top + bottom)));
            }
            top = bottom;
        }
    }
    let there = model.layers.iter().zip(thickest).filter(|(_, best)| best.0 > 0.0);
    there.map(|(layer, best)| (layer.name.clone(), best.1)).collect()
}

impl Draw for Section {
    fn size(&self) -> (u32, u32) {
        (WIDTH_PX as u32, (self.frame().bottom + AXIS_PX) as u32)
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError> {
        let frame = self.frame();
        self.setting.draw_flood(canvas, &frame)?;
        let line = |points: &[(f64, f64)]| -> Vec<(i32, i32)> {
            points.iter().map(|&(x, y)| frame.point(x, y)).collect()
        };
        self.setting.draw_ground(canvas, &frame)?;
        let ends = self.setting.ground.first().zip(self.setting.ground.last());
        let (first, last) = ends.map(|(a, b)| (a.0, b.0)).unwrap_or_default();
        canvas.path(line(&self.setting.ground), INK, 4)?;
        canvas.path(line(&[(first, self.setting.base_m), (last, self.setting.base_m)]), INK, 4)?;
        for piece in &self.setting.boundaries {
            canvas.path(line(piece), GREY, 3)?;
        }
        for piece in &self.setting.water_table {
            canvas.dashed(&line(piece), WATER, 4, (22.0, 8.0))?;
        }
        self.setting.draw_obstacles(canvas, &frame)?;
        for (name, at) in &self.names {
            canvas.text(name, frame.point(at.0, at.1), TEXT_PX, INK, Anchor::Centre)?;
        }
        frame.draw_edges(canvas)?;
        frame.draw(canvas, false)
    }
}
