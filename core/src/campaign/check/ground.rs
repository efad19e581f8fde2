//! `[slope]`, `[[obstacles]]`, `[mesh]`: the geometry.

use super::{Checked, RAD_PER_DEG, between, needed, non_negative, positive, refuse, within, word};
use crate::campaign::file::{ContactText, LineText, MeshSection, ObstacleSection, SlopeSection};
use crate::campaign::{Contact, LineFault, Mesh, Obstacle, Polyline, Slope, Surface};
use crate::slope;

/// Largest friction coefficient of a wall: that of 84 degrees.
const LARGEST_FRICTION: f64 = 10.0;

/// Share of a cell by which an obstacle may reach into the ground, so that round-off does not decide.
const OVERLAP_TOLERANCE_CELLS: f64 = 1e-9;

/// Most obstacles: nobody draws more by hand.
const MOST_OBSTACLES: usize = 1000;

/// The slope, and its toe in the file's coordinates.
pub(super) fn check_slope(raw: &SlopeSection, profile: Option<&Polyline>) -> Checked<(Slope, [f64; 2])> {
    let foundation_depth_m = non_negative("slope.foundation_depth_m", raw.foundation_depth_m)?;
    let runout_plain_m = positive("slope.runout_plain_m", raw.runout_plain_m)?;
    let (surface, origin) = match &raw.profile {
        Some(name) => surveyed(raw, name, profile)?,
        None => (uniform(raw)?, [0.0; 2]),
    };
    let base = contact("slope.base", &raw.base)?;
    let slope = Slope { surface, foundation_depth_m, runout_plain_m, base };
    let lowest = slope::lowest_ground_y(&slope);
    if lowest < -foundation_depth_m {
        let allowed = format!("the profile falls {} m below toe level: it must be at least that", -lowest);
        return Err(refuse("slope.foundation_depth_m", foundation_depth_m, &allowed));
    }
    Ok((slope, origin))
}

fn uniform(raw: &SlopeSection) -> Checked<Surface> {
    for (key, value) in [("slope.toe_x_m", raw.toe_x_m), ("slope.crest_x_m", raw.crest_x_m)] {
        if let Some(value) = value {
            return Err(refuse(key, value, "it belongs to slope.profile"));
        }
    }
    let why = "without slope.profile it is needed";
    let angle = needed("slope.angle_deg", raw.angle_deg, why)?;
    Ok(Surface::Uniform {
        height_m: positive("slope.height_m", needed("slope.height_m", raw.height_m, why)?)?,
        angle_rad: between("slope.angle_deg", angle, 1.0, 90.0)? * RAD_PER_DEG,
        crest_width_m: positive(
            "slope.crest_width_m",
            needed("slope.crest_width_m", raw.crest_width_m, why)?,
        )?,
    })
}

fn surveyed(raw: &SlopeSection, name: &str, profile: Option<&Polyline>) -> Checked<(Surface, [f64; 2])> {
    for (key, value) in [
        ("slope.height_m", raw.height_m),
        ("slope.angle_deg", raw.angle_deg),
        ("slope.crest_width_m", raw.crest_width_m),
    ] {
        if let Some(value) = value {
            return Err(refuse(key, value, "slope.profile gives it: leave it out here"));
        }
    }
    let line = profile.ok_or_else(|| {
        refuse("slope.profile", format!("\"{name}\""), "its text must come with that of the campaign")
    })?;
    let points = line.points();
    let (first, last) = (points[0][0], points[points.len() - 1][0]);
    let why = "slope.profile needs it";
    let toe_x = needed("slope.toe_x_m", raw.toe_x_m, why)?;
    let allowed = format!("it must be greater than {first} and at most {last}: the profile's ends");
    within("slope.toe_x_m", toe_x, toe_x > first && toe_x <= last, &allowed)?;
    let crest_x = needed("slope.crest_x_m", raw.crest_x_m, why)?;
    let allowed =
        format!("it must be greater than {first} (the profile's start) and at most the toe's {toe_x}");
    within("slope.crest_x_m", crest_x, crest_x > first && crest_x <= toe_x, &allowed)?;
    let (crest_y, toe_y) = (line.y_at(crest_x), line.y_after(toe_x));
    let allowed = format!("the crest's elevation there, {crest_y} m, must be above the toe's, {toe_y} m");
    within("slope.crest_x_m", crest_x, crest_y > toe_y, &allowed)?;
    let origin = [toe_x, toe_y];
    Ok((Surface::Profile { line: line.seen_from(origin), crest_x_m: crest_x - toe_x }, origin))
}

pub(super) fn check_mesh(raw: &MeshSection, slope: &Slope) -> Checked<Mesh> {
    let side = positive("mesh.cell_size_m", raw.cell_size_m)?;
    let height = slope::height_m(slope);
    if side > height / 4.0 {
        let what = match slope.surface {
            Surface::Uniform { .. } => "slope.height_m",
            Surface::Profile { .. } => "the height from toe to crest",
        };
        let allowed = format!("it must be at most a quarter of {what} ({} m)", height / 4.0);
        return Err(refuse("mesh.cell_size_m", side, &allowed));
    }
    match raw.points_per_cell_side {
        2..=4 => Ok(Mesh { cell_size_m: side, points_per_cell_side: raw.points_per_cell_side }),
        n => Err(refuse("mesh.points_per_cell_side", n, "it must be 2, 3 or 4")),
    }
}

pub(super) fn check_obstacles(
    raw: &[ObstacleSection],
    slope: &Slope,
    origin: [f64; 2],
    mesh: &Mesh,
) -> Checked<Vec<Obstacle>> {
    if raw.len() > MOST_OBSTACLES {
        return Err(refuse("obstacles", raw.len(), &format!("at most {MOST_OBSTACLES} are supported")));
    }
    let place = |i: usize| format!("obstacles[{}]", i + 1);
    raw.iter().enumerate().map(|(i, o)| check_obstacle(&place(i), o, slope, origin, mesh)).collect()
}

/// An obstacle under the name of `key`. Its sides move to the nearest grid lines, so that it is judged as moved.
fn check_obstacle(
    key: &str,
    raw: &ObstacleSection,
    slope: &Slope,
    origin: [f64; 2],
    mesh: &Mesh,
) -> Checked<Obstacle> {
    let h = mesh.cell_size_m;
    let range = |axis: usize, name: &str, pair: [f64; 2]| -> Checked<[f64; 2]> {
        let (key, shown) = (format!("{key}.{name}"), format!("[{}, {}]", pair[0], pair[1]));
        let seen = pair.map(|v| v - origin[axis]);
        let cells = seen.map(|v| (v / h).round());
        if !(pair[0].is_finite() && pair[1].is_finite() && cells[0] < cells[1]) {
            let allowed = format!("it must be [smallest, largest], at least a cell ({h} m) apart");
            return Err(refuse(&key, shown, &allowed));
        }
        Ok(seen)
    };
    let (x_m, y_m) = (range(0, "x_m", raw.x_m)?, range(1, "y_m", raw.y_m)?);
    let (rear, end) = (slope::rear_x(slope), slope.runout_plain_m);
    if x_m[0] < rear || x_m[1] > end {
        let (rear, end) = (rear + origin[0], end + origin[0]);
        let allowed = format!("it must lie between the walls at {rear} and {end} m");
        let shown = format!("[{}, {}]", raw.x_m[0], raw.x_m[1]);
        return Err(refuse(&format!("{key}.x_m"), shown, &allowed));
    }
    let moved = |pair: [f64; 2]| pair.map(|v| (v / h).round() * h);
    let (columns, bottom) = (moved(x_m), moved(y_m)[0]);
    let ground = slope::highest_between(slope, columns[0], columns[1]);
    if ground > bottom + OVERLAP_TOLERANCE_CELLS * h {
        let allowed = format!(
            "with its sides on the grid it starts at {} m, inside the ground, which reaches {} m there: it must stand on \
             the ground or above it",
            bottom + origin[1],
            ground + origin[1]
        );
        let shown = format!("[{}, {}]", raw.y_m[0], raw.y_m[1]);
        return Err(refuse(&format!("{key}.y_m"), shown, &allowed));
    }
    Ok(Obstacle { x_m, y_m, contact: contact(&format!("{key}.contact"), &raw.contact)? })
}

fn contact(key: &str, raw: &ContactText) -> Checked<Contact> {
    match raw {
        ContactText::Word(text) => word(key, text, &[("fixed", Contact::Fixed)]),
        ContactText::Friction(value) => {
            between(&format!("{key}.friction"), value.friction, 0.0, LARGEST_FRICTION).map(Contact::Friction)
        }
    }
}

/// A line in the file's coordinates.
pub(super) fn line(key: &str, points: &[[f64; 2]]) -> Checked<Polyline> {
    Polyline::new(points.to_vec()).map_err(|fault| {
        let value = match fault {
            LineFault::Empty => "[]".to_owned(),
            LineFault::TooMany => format!("({} points)", points.len()),
            LineFault::NotFinite(n) | LineFault::Backwards(n) | LineFault::ThirdOfStep(n) => {
                format!("[{}, {}]", points[n - 1][0], points[n - 1][1])
            }
        };
        refuse(key, value, &fault.to_string())
    })
}

/// A boundary in the toe's coordinates.
pub(super) fn boundary(key: &str, raw: &LineText, origin: [f64; 2]) -> Checked<Polyline> {
    match raw {
        LineText::Level(y) => {
            within(key, *y, true, "it must be finite").map(|y| Polyline::level(y - origin[1]))
        }
        LineText::Line(points) => line(key, points).map(|l| l.seen_from(origin)),
    }
}
