//! What one analysis leaves for the eye: a ParaView series of its moments, pictures of its section, its fields and its
//! final state, and an animation.

mod colour;
mod film;

pub use colour::Colour;

use crate::picture::section::Section;
use crate::picture::setting::Setting;
use crate::picture::soil::{Panel, SoilPicture, range};
use crate::picture::{self, PictureError};
use crate::replays::Scene;
use crate::vtu::{self, PointArray, pvd, vtu};
use film::Film;
use runout_core::campaign::Model;
use runout_core::outcome::{Outcome, OutcomeKind, Reason};
use runout_core::realisation::{PointProperties, Snapshot};
use runout_core::site::Property;
use runout_core::slope;
use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

const SERIES_FOLDER: &str = "series";

/// A gallery that cannot be written.
#[derive(Debug, Error)]
pub enum GalleryError {
    /// The system refused.
    #[error("{}: {error}", path.display())]
    File {
        /// File or directory.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
    /// A picture cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// What is wanted besides the pictures that are always made.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Further quantities to colour the final state by; the first of them colours the animation.
    pub colours: Vec<Colour>,
    /// Whether the final states are written as SVG too.
    pub svg: bool,
    /// Whether there is an animation.
    pub animation: bool,
}

/// The pictures and series of one analysis under way, in a directory of their own.
#[derive(Debug)]
pub struct Gallery {
    dir: PathBuf,
    options: Options,
    moments: Vec<(f64, String)>,
    film: Option<Film>,
    last: Option<Last>,
    fault: Option<GalleryError>,
}

/// The last moment seen: what the pictures show.
#[derive(Debug, Clone)]
struct Last {
    scene: Scene,
    properties: PointProperties,
    /// By each of the colours asked for.
    values: Vec<Vec<f64>>,
}

impl Gallery {
    /// Makes the directory.
    ///
    /// # Errors
    /// The system refuses.
    pub fn new(dir: &Path, options: Options) -> Result<Gallery, GalleryError> {
        let series = dir.join(SERIES_FOLDER);
        std::fs::create_dir_all(&series).map_err(|error| GalleryError::File { path: series, error })?;
        let moving = options.colours.first().copied().unwrap_or(Colour::Displacement);
        let film = options.animation.then(|| Film::new(moving));
        Ok(Gallery { dir: dir.to_owned(), options, moments: Vec::new(), film, last: None, fault: None })
    }

    /// Writes a moment to the series. A fault is kept for [`Gallery::finish`]: the analysis goes on.
    pub fn observe(&mut self, snapshot: &Snapshot<'_>) {
        if self.moments.last().is_none_or(|(time_s, _)| *time_s < snapshot.time_s) {
            let name = format!("{SERIES_FOLDER}/{:04}.vtu", self.moments.len());
            let file = vtu(&snapshot.state.x, &snapshot.state.y, &arrays(snapshot));
            if let Err(fault) = write(&self.dir.join(&name), &file) {
                self.fault.get_or_insert(fault);
            }
            self.moments.push((snapshot.time_s, name));
        }
        if let Some(film) = &mut self.film {
            film.observe(snapshot);
        }
        self.last = Some(Last {
            scene: Scene::of(snapshot),
            properties: snapshot.properties.clone(),
            values: self.options.colours.iter().map(|colour| colour.values(snapshot)).collect(),
        });
    }

    /// Writes the series' list and the pictures; returns what was written. `what` names the analysis, for example
    /// `Elkhorn River, realisation 17`. An analysis that failed before its failure stage leaves nothing to show.
    ///
    /// # Errors
    /// The system refuses, here or at an earlier moment.
    pub fn finish(
        self,
        model: &Model,
        random: &[Property],
        what: &str,
        outcome: &Outcome,
    ) -> Result<Vec<PathBuf>, GalleryError> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        let Some(Last { scene, properties, values }) = self.last else { return Ok(Vec::new()) };
        let mut written = Vec::new();
        let mut put = |name: &str, bytes: &[u8]| {
            let path = self.dir.join(name);
            write(&path, bytes).map(|()| written.push(path))
        };
        put("series.pvd", pvd(&self.moments).as_bytes())?;
        put("grid.vtu", &vtu::grid(&slope::grid(&model.slope, &model.mesh)))?;
        put("section.png", &picture::png(&Section::of(model))?)?;
        let [x0, y0] = [wide(&scene.x0), wide(&scene.y0)];
        put("fields.png", &picture::png(&fields(model, random, what, &x0, &y0, &properties))?)?;
        let mut pictures = vec![
            (Colour::Displacement, displacement(model, what, outcome, &scene)),
            (Colour::PlasticStrain, plastic_strain(model, what, outcome, &scene)),
        ];
        for (colour, values) in self.options.colours.iter().zip(values) {
            if pictures.iter().all(|(made, _)| made != colour) {
                pictures.push((*colour, final_state(model, what, outcome, &scene, *colour, values)));
            }
        }
        for (colour, picture) in &pictures {
            put(&format!("{}.png", colour.name()), &picture::png(picture)?)?;
            if self.options.svg {
                put(&format!("{}.svg", colour.name()), picture::svg(picture)?.as_bytes())?;
            }
        }
        if let Some(film) = &self.film {
            let look =
                Look::new(model, format!("{what}: {}", result_in_words(model, outcome)), &wide(&scene.x));
            put("slide.gif", &film.gif(&look)?)?;
        }
        Ok(written)
    }
}

/// What the pictures of one analysis have in common.
struct Look<'a> {
    model: &'a Model,
    title: String,
    setting: Setting,
}

impl<'a> Look<'a> {
    fn new(model: &'a Model, title: String, x: &[f64]) -> Look<'a> {
        Look { model, title, setting: setting(model, x) }
    }

    fn legend(&self) -> String {
        self.setting.legend()
    }
}

/// Soil that has moved, coloured by one quantity.
fn slide<'a>(
    look: &Look<'_>,
    subtitle: String,
    (x, y): (Cow<'a, [f64]>, Cow<'a, [f64]>),
    values: Vec<f64>,
    colour: Colour,
    range: (f64, f64),
) -> SoilPicture<'a> {
    let (gradient, reversed) = colour.gradient();
    SoilPicture {
        title: look.title.clone(),
        subtitle,
        setting: look.setting.clone(),
        moved: true,
        point_size_m: look.model.mesh.point_spacing_m(),
        panels: vec![Panel { label: colour.label().to_owned(), x, y, values, range, gradient, reversed }],
        view: None,
    }
}

/// The final state, coloured by one quantity.
fn final_state(
    model: &Model,
    what: &str,
    outcome: &Outcome,
    scene: &Scene,
    colour: Colour,
    values: Vec<f64>,
) -> SoilPicture<'static> {
    let (x, y) = (wide(&scene.x), wide(&scene.y));
    let look = Look::new(model, format!("{what}: {}", result_in_words(model, outcome)), &x);
    let moment = moment_in_words(outcome, scene.time_s);
    let subtitle = format!("{} {moment}; {}", colour.in_words(), look.legend());
    let range = colour.range(&values);
    slide(&look, subtitle, (x.into(), y.into()), values, colour, range)
}

/// The final state, coloured by displacement.
pub fn displacement(model: &Model, what: &str, outcome: &Outcome, scene: &Scene) -> SoilPicture<'static> {
    let part = |now: &[f32], before: &[f32]| -> Vec<f64> {
        now.iter().zip(before).map(|(a, b)| f64::from(*a) - f64::from(*b)).collect()
    };
    let (ux, uy) = (part(&scene.x, &scene.x0), part(&scene.y, &scene.y0));
    let values = ux.iter().zip(uy).map(|(x, y)| x.hypot(y)).collect();
    final_state(model, what, outcome, scene, Colour::Displacement, values)
}

/// The final state, coloured by plastic strain.
pub fn plastic_strain(model: &Model, what: &str, outcome: &Outcome, scene: &Scene) -> SoilPicture<'static> {
    final_state(model, what, outcome, scene, Colour::PlasticStrain, wide(&scene.plastic_strain))
}

fn wide(values: &[f32]) -> Vec<f64> {
    values.iter().map(|v| f64::from(*v)).collect()
}

/// The picture of a realisation's fields: one panel a random property, with the points where it is random.
pub fn fields(
    model: &Model,
    random: &[Property],
    what: &str,
    x: &[f64],
    y: &[f64],
    properties: &PointProperties,
) -> SoilPicture<'static> {
    let materials = model.materials();
    let is_random = |property: Property, i: usize| {
        materials[usize::from(properties.material[i])].constant(property).is_none()
    };
    let panels = random
        .iter()
        .map(|&property| {
            let shown: Vec<usize> = (0..x.len()).filter(|&i| is_random(property, i)).collect();
            let of_shown = |all: &[f64]| -> Vec<f64> { shown.iter().map(|&i| all[i]).collect() };
            let values = of_shown(&edge_units(property, properties));
            Panel {
                label: property_label(property).to_owned(),
                x: of_shown(x).into(),
                y: of_shown(y).into(),
                range: range(&values, false),
                values,
                gradient: colorous::VIRIDIS,
                reversed: false,
            }
        })
        .collect();
    SoilPicture {
        title: format!("{what}: random fields"),
        subtitle: format!(
            "scale of fluctuation {} m along the bedding, {} m across it",
            model.field.scale_horizontal_m, model.field.scale_vertical_m
        ),
        setting: setting(model, x),
        moved: false,
        point_size_m: model.mesh.point_spacing_m(),
        panels,
        view: None,
    }
}

/// A property at the points, in the unit of its name.
pub fn edge_units(property: Property, properties: &PointProperties) -> Vec<f64> {
    const PER_KILO: f64 = 1e-3;
    let (values, unit) = match property {
        Property::Cohesion => (&properties.cohesion_pa, PER_KILO),
        Property::FrictionAngle => (&properties.friction_angle_rad, 1f64.to_degrees()),
        Property::UnitWeight => (&properties.unit_weight_n_m3, PER_KILO),
    };
    values.iter().map(|v| v * unit).collect()
}

/// A property's name with its unit, for people.
pub fn property_label(property: Property) -> &'static str {
    match property {
        Property::Cohesion => "cohesion (kPa)",
        Property::FrictionAngle => "friction angle (\u{b0})",
        Property::UnitWeight => "unit weight (kN/m\u{b3})",
    }
}

/// What stands around the soil, to where the material or an obstacle reaches.
fn setting(model: &Model, x: &[f64]) -> Setting {
    let ends = x.iter().copied().chain(model.obstacles.iter().map(|o| o.x_m[1]));
    Setting::of(model, ends.filter(|x| x.is_finite()).fold(0.0, f64::max))
}

fn result_in_words(model: &Model, outcome: &Outcome) -> String {
    match (&outcome.measures, outcome.outcome) {
        (Some(measures), OutcomeKind::Stable) => {
            format!("stable ({:.3} m)", model.sample.measure.of(measures))
        }
        (Some(measures), _) => {
            let at_least = if outcome.reason == Reason::StillMoving { "at least " } else { "" };
            format!("runout {at_least}{:.2} m", model.sample.measure.of(measures))
        }
        (None, _) => format!("failed analysis ({})", outcome.reason.name()),
    }
}

fn moment_in_words(outcome: &Outcome, time_s: f64) -> String {
    match outcome.reason {
        Reason::AtRest => format!("at rest, {time_s:.1} s after failure"),
        Reason::StillMoving => format!("{time_s:.1} s after failure, still moving"),
        _ => format!("{time_s:.1} s after failure"),
    }
}

fn arrays(snapshot: &Snapshot<'_>) -> Vec<PointArray<'static>> {
    const PER_KILO: f64 = 1e-3;
    let state = snapshot.state;
    let vector = |x: &[f64], y: &[f64]| x.iter().zip(y).flat_map(|(x, y)| [*x, *y, 0.0]).collect();
    let kilo = |values: &[f64]| values.iter().map(|v| v * PER_KILO).collect();
    let array = |name, components, values| PointArray { name, components, values };
    // ParaView's order of a symmetric tensor: xx, yy, zz, xy, yz, xz.
    let stress = (0..state.x.len())
        .flat_map(|i| {
            [state.stress_xx[i], state.stress_yy[i], state.stress_zz[i], state.stress_xy[i], 0.0, 0.0]
        })
        .map(|v| v * PER_KILO)
        .collect();
    let mut arrays = vec![
        array("displacement_m", 3, vector(snapshot.ux, snapshot.uy)),
        array("velocity_m_s", 3, vector(&state.vx, &state.vy)),
        array("effective_stress_kpa", 6, stress),
        array("pore_pressure_kpa", 1, kilo(&state.pressure)),
        array("plastic_strain", 1, state.plastic_strain.clone()),
        array("porosity", 1, state.porosity.clone()),
        array("volume_m2", 1, state.volume.clone()),
    ];
    arrays.push(array("layer", 1, snapshot.properties.material.iter().map(|m| f64::from(*m)).collect()));
    for property in Property::ALL {
        arrays.push(array(property.name(), 1, edge_units(property, snapshot.properties)));
    }
    arrays
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), GalleryError> {
    std::fs::write(path, bytes).map_err(|error| GalleryError::File { path: path.to_owned(), error })
}
