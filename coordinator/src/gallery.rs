//! What one analysis leaves for the eye: a ParaView series of its moments, and pictures of its section, its fields, its
//! final displacements and its plastic strains.

use crate::picture::section::Section;
use crate::picture::setting::Setting;
use crate::picture::soil::{Panel, SoilPicture, range};
use crate::picture::{self, PictureError};
use crate::vtu::{PointArray, pvd, vtu};
use runout_core::campaign::Model;
use runout_core::outcome::{Outcome, OutcomeKind, Reason};
use runout_core::realisation::{PointProperties, Snapshot};
use runout_core::site::Property;
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

/// The pictures and series of one analysis under way, in a directory of their own.
#[derive(Debug)]
pub struct Gallery {
    dir: PathBuf,
    moments: Vec<(f64, String)>,
    last: Option<Moment>,
    fault: Option<GalleryError>,
}

/// The last moment seen: what the pictures show.
#[derive(Debug, Clone)]
struct Moment {
    x0: Vec<f64>,
    y0: Vec<f64>,
    x: Vec<f64>,
    y: Vec<f64>,
    displacement_m: Vec<f64>,
    plastic_strain: Vec<f64>,
    properties: PointProperties,
    time_s: f64,
}

impl Gallery {
    /// Makes the directory.
    ///
    /// # Errors
    /// The system refuses.
    pub fn new(dir: &Path) -> Result<Gallery, GalleryError> {
        let series = dir.join(SERIES_FOLDER);
        std::fs::create_dir_all(&series).map_err(|error| GalleryError::File { path: series, error })?;
        Ok(Gallery { dir: dir.to_owned(), moments: Vec::new(), last: None, fault: None })
    }

    /// Writes a moment to the series. A fault is kept for [`Gallery::finish`]: the analysis goes on.
    pub fn observe(&mut self, snapshot: &Snapshot<'_>) {
        let displacement_m: Vec<f64> =
            snapshot.ux.iter().zip(snapshot.uy).map(|(x, y)| x.hypot(*y)).collect();
        if self.moments.last().is_none_or(|(time_s, _)| *time_s < snapshot.time_s) {
            let name = format!("{SERIES_FOLDER}/{:04}.vtu", self.moments.len());
            let file = vtu(&snapshot.state.x, &snapshot.state.y, &arrays(snapshot));
            if let Err(fault) = write(&self.dir.join(&name), &file) {
                self.fault.get_or_insert(fault);
            }
            self.moments.push((snapshot.time_s, name));
        }
        self.last = Some(Moment {
            x0: snapshot.x0.to_vec(),
            y0: snapshot.y0.to_vec(),
            x: snapshot.state.x.clone(),
            y: snapshot.state.y.clone(),
            displacement_m,
            plastic_strain: snapshot.state.plastic_strain.clone(),
            properties: snapshot.properties.clone(),
            time_s: snapshot.time_s,
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
        let Some(last) = self.last else { return Ok(Vec::new()) };
        let mut written = Vec::new();
        let mut put = |name: &str, bytes: &[u8]| {
            let path = self.dir.join(name);
            write(&path, bytes).map(|()| written.push(path))
        };
        put("series.pvd", pvd(&self.moments).as_bytes())?;
        put("section.png", &picture::png(&Section::of(model))?)?;
        let fields = fields(model, random, what, &last.x0, &last.y0, &last.properties);
        put("fields.png", &picture::png(&fields)?)?;
        let title = format!("{what}: {}", result_in_words(model, outcome));
        let moment = moment_in_words(outcome, last.time_s);
        let setting = setting(model, &last.x);
        let legend = setting.legend();
        let after = |label: &str, values: &[f64], gradient, subtitle: String| SoilPicture {
            title: title.clone(),
            subtitle,
            setting: setting.clone(),
            moved: true,
            point_size_m: model.mesh.point_spacing_m(),
            panels: vec![Panel {
                label: label.to_owned(),
                x: (&last.x).into(),
                y: (&last.y).into(),
                values: values.to_vec(),
                range: range(values, true),
                gradient,
                reversed: false,
            }],
        };
        let subtitle = format!("displacement of every material point {moment}; {legend}");
        let slide = after("displacement (m)", &last.displacement_m, colorous::VIRIDIS, subtitle);
        put("displacement.png", &picture::png(&slide)?)?;
        let subtitle = format!("equivalent plastic strain {moment}; {legend}");
        let mut strain = after("plastic strain", &last.plastic_strain, colorous::INFERNO, subtitle);
        strain.panels[0].range = (0.0, strain_top(&last.plastic_strain));
        // What has not sheared is light, shear bands are dark.
        strain.panels[0].reversed = true;
        put("plastic-strain.png", &picture::png(&strain)?)?;
        Ok(written)
    }
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
                label: label(property).to_owned(),
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

fn label(property: Property) -> &'static str {
    match property {
        Property::Cohesion => "cohesion (kPa)",
        Property::FrictionAngle => "friction angle (\u{b0})",
        Property::UnitWeight => "unit weight (kN/m\u{b3})",
    }
}

/// The 99.5 % quantile: shear bands are thin, and a few torn points would darken all others.
fn strain_top(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let place = (0.995 * sorted.len().saturating_sub(1) as f64) as usize;
    sorted.get(place).copied().filter(|top| *top > 0.0).unwrap_or(1.0)
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
