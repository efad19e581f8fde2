//! What stands around the soil in a picture: ground before failure, layers' boundaries, water, obstacles, rigid base.

use super::axes::Frame;
use super::{Canvas, INK, PictureError};
use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;
use runout_core::campaign::Model;
use runout_core::slope;

/// Water: the table and free water.
pub(super) const WATER: RGBColor = RGBColor(0x2f, 0x7f, 0xd1);
/// Rigid obstacles and the base's edge.
pub(super) const RIGID: RGBColor = RGBColor(0x57, 0x53, 0x4e);
const BELOW_BASE: RGBColor = RGBColor(0xe6, 0xe3, 0xdd);
const GROUND_BEFORE: RGBColor = RGBColor(0x8a, 0x8f, 0x98);
const SOIL: RGBColor = RGBColor(0xb0, 0x8d, 0x57);
/// Layers' boundaries, on soil of any colour.
const BOUNDARY: RGBColor = RGBColor(0xf4, 0xf4, 0xf4);

/// Opacity of free water, and of the ground before failure.
const FLOOD: f64 = 0.18;
const GROUND: f64 = 0.35;

/// Places along the section at which lines are compared: a few to each pixel column's width.
const PLACES: usize = 800;

/// What stands around the soil; m from the toe.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Setting {
    /// Ground surface before failure.
    pub ground: Vec<(f64, f64)>,
    /// Boundaries between layers where both are there, from the top; a piece each.
    pub boundaries: Vec<Vec<(f64, f64)>>,
    /// Water table where it is below the ground.
    pub water_table: Vec<Vec<(f64, f64)>>,
    /// Level of the free water.
    pub free_water_m: Option<f64>,
    /// Ground surface where it is below that.
    pub flooded: Vec<Vec<(f64, f64)>>,
    /// Corners of the obstacles, lower left and upper right, on the grid lines that they are moved to.
    pub obstacles: Vec<[(f64, f64); 2]>,
    /// Elevation of the rigid base.
    pub base_m: f64,
}

impl Setting {
    /// The setting of `model` from its rear wall to `right`, m.
    pub fn of(model: &Model, right: f64) -> Setting {
        let left = slope::rear_x(&model.slope);
        let cell = model.mesh.cell_size_m;
        let on_grid = |v: f64| (v / cell).round() * cell;
        let places = || (0..=PLACES).map(|i| left + (right - left) * i as f64 / PLACES as f64);
        let ground = |x: f64| slope::ground_surface_y(&model.slope, x);
        let table = |x: f64| {
            let level = slope::water::pressure_level_m(&model.slope, &model.water, x)?;
            (level < ground(x) - 1e-9).then_some(level)
        };
        let base_m = -model.slope.foundation_depth_m;
        let boundaries = (0..model.layers.len().saturating_sub(1)).flat_map(|i| {
            let bottom = |layer: usize, x: f64| model.layers[layer].bottom.as_ref().map(|line| line.y_at(x));
            pieces(places(), |x| {
                let y = bottom(i, x)?;
                // Below the bottoms of all layers above, or this layer is not there.
                let lowest = (0..i).filter_map(|above| bottom(above, x)).fold(ground(x), f64::min);
                (y > base_m && y < lowest - 1e-9).then_some(y)
            })
        });
        Setting {
            ground: slope::surface_between(&model.slope, left, right)
                .into_iter()
                .map(|[x, y]| (x, y))
                .collect(),
            boundaries: boundaries.collect(),
            water_table: pieces(places(), table),
            free_water_m: model.water.free_water_level_m,
            flooded: pieces(places(), |x| {
                let level = model.water.free_water_level_m?;
                Some(ground(x)).filter(|y| *y <= level)
            }),
            obstacles: model
                .obstacles
                .iter()
                .map(|o| [(on_grid(o.x_m[0]), on_grid(o.y_m[0])), (on_grid(o.x_m[1]), on_grid(o.y_m[1]))])
                .collect(),
            base_m,
        }
    }

    /// The colours it is drawn with, as they look on white.
    pub(super) fn colours(&self) -> [RGBColor; 8] {
        let pale = |c: RGBColor, share: f64| {
            let mix = |v: u8| (255.0 + (f64::from(v) - 255.0) * share).round() as u8;
            RGBColor(mix(c.0), mix(c.1), mix(c.2))
        };
        let flood = pale(WATER, FLOOD);
        [INK, RIGID, BELOW_BASE, GROUND_BEFORE, BOUNDARY, WATER, flood, pale(SOIL, GROUND)]
    }

    /// What its lines mean.
    pub fn legend(&self) -> String {
        let mut legend = "dashed: ground before".to_owned();
        if !self.boundaries.is_empty() {
            legend.push_str(", dotted: layers");
        }
        if !self.water_table.is_empty() {
            legend.push_str(", blue: water table");
        }
        legend
    }

    /// The ground before failure down to the rigid base.
    pub(super) fn draw_ground<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        let ends = self.ground.first().zip(self.ground.last());
        let base = ends.into_iter().flat_map(|(first, last)| [(last.0, self.base_m), (first.0, self.base_m)]);
        let outline = self.ground.iter().copied().chain(base).map(|(x, y)| frame.point(x, y));
        canvas.polygon(outline.collect(), SOIL, GROUND)
    }

    /// Everything that must fit into a picture.
    pub(super) fn corners(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let water = self.free_water_m.into_iter().flat_map(|y| self.ground.last().map(|end| (end.0, y)));
        self.ground.iter().copied().chain(self.obstacles.iter().flatten().copied()).chain(water)
    }

    /// The free water on the ground before failure.
    pub(super) fn draw_flood<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        let Some(level) = self.free_water_m else { return Ok(()) };
        for ground in &self.flooded {
            let (Some(first), Some(last)) = (ground.first(), ground.last()) else { continue };
            let surface = [frame.point(first.0, level), frame.point(last.0, level)];
            let bottom = ground.iter().rev().map(|&(x, y)| frame.point(x, y));
            canvas.polygon(surface.into_iter().chain(bottom).collect(), WATER, FLOOD)?;
            canvas.path(surface.to_vec(), WATER, 3)?;
        }
        Ok(())
    }

    /// The free water up to its level everywhere, to be drawn before the soil that covers it.
    pub(super) fn draw_free_water<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        let Some(level) = self.free_water_m else { return Ok(()) };
        let (top, bottom) = (frame.point(frame.x.low, level), frame.point(frame.x.high, self.base_m));
        canvas.rectangle(top, bottom, WATER, FLOOD)?;
        canvas.path(vec![top, (bottom.0, top.1)], WATER, 3)
    }

    /// Base, obstacles, boundaries, water table, and the ground before failure as a dashed line.
    pub(super) fn draw_over<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        let base = frame.y_px(self.base_m).round() as i32;
        canvas.rectangle((frame.left, base), (frame.right, frame.bottom), BELOW_BASE, 1.0)?;
        canvas.path(vec![(frame.left, base), (frame.right, base)], RIGID, 4)?;
        self.draw_obstacles(canvas, frame)?;
        let line = |points: &[(f64, f64)]| -> Vec<(i32, i32)> {
            points.iter().map(|&(x, y)| frame.point(x, y)).collect()
        };
        for piece in &self.boundaries {
            canvas.dashed(&line(piece), BOUNDARY, 3, (4.0, 6.0))?;
        }
        for piece in &self.water_table {
            canvas.dashed(&line(piece), WATER, 3, (18.0, 6.0))?;
        }
        canvas.dashed(&line(&self.ground), GROUND_BEFORE, 3, (16.0, 10.0))
    }

    pub(super) fn draw_obstacles<B: DrawingBackend>(
        &self,
        canvas: &Canvas<'_, B>,
        frame: &Frame,
    ) -> Result<(), PictureError> {
        for [low, high] in &self.obstacles {
            let (from, to) = (frame.point(low.0, high.1), frame.point(high.0, low.1));
            canvas.rectangle(from, to, RIGID, 1.0)?;
            let outline = vec![from, (to.0, from.1), to, (from.0, to.1), from];
            canvas.path(outline, INK, 2)?;
        }
        Ok(())
    }
}

/// The pieces of a curve where it is there, each with as few points as its straight parts need.
fn pieces(places: impl Iterator<Item = f64>, y: impl Fn(f64) -> Option<f64>) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for x in places {
        match (y(x), pieces.last_mut()) {
            (Some(y), Some(piece)) => {
                if let [.., a, b] = piece[..]
                    && is_straight(a, b, (x, y))
                {
                    piece.pop();
                }
                piece.push((x, y));
            }
            (None, Some(piece)) if !piece.is_empty() => pieces.push(Vec::new()),
            _ => {}
        }
    }
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

/// Whether `b` lies on the line from `a` to `c`, but for round-off.
fn is_straight(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> bool {
    ((b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)).abs() < 1e-9 * (c.0 - a.0).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_cut_where_it_is_not_there_and_straight_parts_are_two_points() {
        let places = || (0..=100).map(f64::from);
        let roof = |x: f64| (x != 20.0).then_some(if x < 60.0 { x } else { 120.0 - x });
        let found = pieces(places(), roof);
        assert_eq!(found, [vec![(0.0, 0.0), (19.0, 19.0)], vec![(21.0, 21.0), (60.0, 60.0), (100.0, 20.0)]]);
        assert!(pieces(places(), |_| None).is_empty());
    }
}
