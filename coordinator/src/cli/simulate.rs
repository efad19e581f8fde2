//! `runout simulate`: one analysis, with pictures and a ParaView series if asked for.

use super::analysis::{Watched, prepare, watch};
use super::pictures::PictureArguments;
use super::{Failure, index, print, print_json};
use crate::gallery::GalleryError;
use crate::load;
use crate::outcomes::unsigned_zero;
use crate::overrides::Override;
use crate::table::{list, significant};
use clap::Args;
use runout_core::gimp::{Energy, Threads};
use runout_core::outcome::{Measures, Outcome};
use runout_core::profile::Profile;
use runout_core::realisation::Source;
use serde::Serialize;
use std::path::PathBuf;

/// `runout simulate CAMPAIGN (--index I | --deterministic) [--set KEY=VALUE] [--threads N] [--out DIR] [--every S] [--json]`
#[derive(Debug, Args)]
pub struct SimulateArguments {
    /// Campaign file
    campaign: PathBuf,
    #[command(flatten)]
    source: SourceArguments,
    /// Write a ParaView series (.pvd, .vtu), pictures (.png) and an animation (.gif) into this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pictures: PictureArguments,
    /// Time between two moments of the series, s
    #[arg(long, value_name = "S", default_value = "0.25", requires = "out", value_parser = positive)]
    every: f64,
    /// Change a key of the campaign file, in TOML's syntax (repeatable): --set mesh.cell_size_m=0.8
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// Threads that share the analysis; they move no bits, and pay from some 50,000 points on
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: u16,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct SourceArguments {
    /// The realisation with this index
    #[arg(long, value_name = "I", value_parser = index, allow_negative_numbers = true)]
    index: Option<u64>,
    /// Every random property at its distribution's mean
    #[arg(long)]
    deterministic: bool,
}

impl SourceArguments {
    fn source(&self) -> Source {
        self.index.map_or(Source::Deterministic, Source::Index)
    }
}

/// The names of this document are a contract.
#[derive(Serialize)]
struct Document<'a> {
    index: Option<u64>,
    outcome: &'static str,
    reason: &'static str,
    runout_m: Option<f64>,
    max_displacement_m: Option<f64>,
    displacement_q999_m: Option<f64>,
    toe_advance_m: Option<f64>,
    crest_retreat_m: Option<f64>,
    moved_area_m2: Option<f64>,
    deposit_height_at_toe_m: Option<f64>,
    time_to_rest_s: Option<f64>,
    energy: Option<Energy>,
    energy_drift: Option<f64>,
    marked: &'static str,
    simulated_s: f64,
    steps: u64,
    points: u64,
    wall_s: f64,
    point_updates_per_s: f64,
    digest: &'a str,
    /// What was recorded along the ground, where the campaign asks for it.
    profile: Option<&'a Profile>,
    files: Vec<PathBuf>,
}

pub(super) fn simulate(arguments: &SimulateArguments) -> Result<(), Failure> {
    let loaded = load::load_with(&arguments.campaign, &arguments.set)?;
    let threads = Threads::new(usize::from(arguments.threads))
        .map_err(|e| Failure::Work(format!("cannot start {} threads: {e}", arguments.threads)))?;
    let prepared = prepare(&loaded.spec)?.with_threads(threads);
    let source = arguments.source.source();
    let what = match source {
        Source::Index(index) => format!("{}, realisation {index}", loaded.campaign.name),
        Source::Deterministic => format!("{}, mean properties", loaded.campaign.name),
    };
    let failed = |e: GalleryError| Failure::Work(e.to_string());
    let mut gallery = arguments.pictures.gallery(arguments.out.as_deref())?;
    let every_s = if gallery.is_some() { arguments.every } else { f64::INFINITY };
    let watched = watch(&prepared, source, every_s, &mut |snapshot| {
        if let Some(gallery) = &mut gallery {
            gallery.observe(snapshot);
        }
    })?;
    let model = &loaded.spec.model;
    let files = gallery
        .map(|g| g.finish(model, &loaded.campaign.random, &what, &watched.outcome))
        .transpose()
        .map_err(failed)?
        .unwrap_or_default();
    let runout_m = watched.outcome.measures.as_ref().map(|m| model.sample.measure.of(m));
    if arguments.json {
        print_json(&document(source, &watched, runout_m, files))?;
    } else {
        let mut text = format!("{what}\n\n{}", list(&rows(&watched, runout_m)));
        files.iter().for_each(|file| text.push_str(&format!("wrote {}\n", file.display())));
        print(&text)?;
    }
    Ok(())
}

fn document(source: Source, watched: &Watched, runout_m: Option<f64>, files: Vec<PathBuf>) -> Document<'_> {
    let Watched { outcome, wall_s, .. } = watched;
    let measure = |of: fn(&Measures) -> f64| outcome.measures.as_ref().map(|m| unsigned_zero(of(m)));
    Document {
        index: match source {
            Source::Index(index) => Some(index),
            Source::Deterministic => None,
        },
        outcome: outcome.outcome.name(),
        reason: outcome.reason.name(),
        runout_m,
        max_displacement_m: measure(|m| m.max_displacement_m),
        displacement_q999_m: measure(|m| m.displacement_q999_m),
        toe_advance_m: measure(|m| m.toe_advance_m),
        crest_retreat_m: measure(|m| m.crest_retreat_m),
        moved_area_m2: measure(|m| m.moved_area_m2),
        deposit_height_at_toe_m: measure(|m| m.deposit_height_at_toe_m),
        time_to_rest_s: outcome.measures.as_ref().and_then(|m| m.time_to_rest_s),
        energy: outcome.energy,
        energy_drift: outcome.energy.as_ref().map(Energy::drift),
        marked: outcome.mark(),
        simulated_s: outcome.simulated_s,
        steps: outcome.steps,
        points: outcome.points,
        wall_s: *wall_s,
        point_updates_per_s: updates_per_s(watched),
        digest: &outcome.digest,
        profile: outcome.profile.as_ref(),
        files,
    }
}

fn rows(watched: &Watched, runout_m: Option<f64>) -> Vec<(&'static str, String)> {
    let Watched { outcome, wall_s, steps } = watched;
    let mut rows = Vec::new();
    let mut row = |name: &'static str, value: String| rows.push((name, value));
    row("outcome", format!("{} ({})", outcome.outcome.name(), outcome.reason.name()));
    let metres = |v: f64| significant(v, 6);
    if let Some(runout) = runout_m {
        row("runout, m", metres(runout));
    }
    measures(outcome).into_iter().for_each(|(name, value)| row(name, metres(value)));
    if let Some(energy) = &outcome.energy {
        row("work of gravity, J per m", significant(energy.outer_work_j, 4));
        let drift = 100.0 * energy.drift();
        let mark = if outcome.energy_drifted { " (beyond the limit)" } else { "" };
        row("drift of the energy balance", format!("{} %{mark}", significant(drift, 2)));
    }
    row("simulated, s", significant(outcome.simulated_s, 6));
    row("steps", format!("{} ({steps} with the gravity stage)", outcome.steps));
    row("points", outcome.points.to_string());
    row("wall time, s", significant(*wall_s, 4));
    row("point updates per s", significant(updates_per_s(watched), 4));
    row("digest", outcome.digest.clone());
    rows
}

fn measures(outcome: &Outcome) -> Vec<(&'static str, f64)> {
    let Some(m) = &outcome.measures else { return Vec::new() };
    let mut rows = vec![
        ("largest displacement, m", m.max_displacement_m),
        ("displacement, 99.9 % quantile, m", m.displacement_q999_m),
        ("toe advance, m", m.toe_advance_m),
        ("crest retreat, m", m.crest_retreat_m),
        ("moved area, m2", unsigned_zero(m.moved_area_m2)),
        ("deposit height at the toe, m", m.deposit_height_at_toe_m),
    ];
    rows.extend(m.time_to_rest_s.map(|t| ("time to rest, s", t)));
    rows
}

fn updates_per_s(watched: &Watched) -> f64 {
    watched.steps as f64 * watched.outcome.points as f64 / watched.wall_s.max(f64::MIN_POSITIVE)
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("it must be a number greater than 0".to_owned()),
    }
}
