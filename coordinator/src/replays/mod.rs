//! Realisations run again for the report: the final states of those it shows, and where the campaign records none, the
//! profiles of some along the ground.
//!
//! An outcome holds no final state: what lies where is a thousand times as much as its measures. But (spec, index) gives
//! the same bits again, so that the report replays as many realisations as it needs and keeps what came out in the run
//! directory, `replays/INDEX.json`. What is kept is used again only if build and spec are the same; the outcome in it
//! is compared with the recorded one by whoever reads it.

use crate::store::write_atomically;
use rayon::prelude::*;
use runout_core::outcome::Outcome;
use runout_core::profile::{LOOK_EVERY_S, Profile, Recorder, Stations};
use runout_core::realisation::{Cancelled, Prepared, Progress, Snapshot, Source};
use runout_proto::identity;
use serde::{Deserialize, Serialize};
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Points that are analysed side by side at most: some 4 GB of state.
const MOST_POINTS: usize = 2_000_000;

/// States of more points are not kept on the disk: some 10 MB each.
const MOST_KEPT_POINTS: usize = 200_000;

/// Replays that cannot be made.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The system refused.
    #[error("{}: {error}", path.display())]
    File {
        /// File or directory.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
    /// No threads.
    #[error("threads cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What to replay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// Which analysis.
    pub source: Source,
    /// Whether its final state is needed.
    pub scene: bool,
}

/// Where the points were at the start of failure and at the end, and how they sheared; point order, m.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Scene {
    /// Positions before.
    pub x0: Vec<f32>,
    /// Positions before.
    pub y0: Vec<f32>,
    /// Positions at the end.
    pub x: Vec<f32>,
    /// Positions at the end.
    pub y: Vec<f32>,
    /// Equivalent plastic strain.
    pub plastic_strain: Vec<f32>,
    /// Time since failure began, s.
    pub time_s: f64,
}

/// An analysis run again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Replay {
    /// Its outcome, computed anew.
    pub outcome: Outcome,
    /// What it did along the ground: from the outcome, or where the campaign records none, looked at as it does.
    pub profile: Option<Profile>,
    /// Its final state, if it was asked for and there is one.
    pub scene: Option<Scene>,
}

/// A replay as kept.
#[derive(Serialize, Deserialize)]
struct Kept {
    build: String,
    spec: String,
    replay: Replay,
}

/// Replays what is wanted, in that order, on all cores; `done` is called after each. What `folder` keeps is not run again.
///
/// # Errors
/// The folder cannot be written, or threads cannot be started.
pub fn replay(
    prepared: &Prepared,
    wanted: &[Wanted],
    folder: &Path,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Replay>, ReplayError> {
    std::fs::create_dir_all(folder).map_err(|error| ReplayError::File { path: folder.to_owned(), error })?;
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let threads = cores.min((MOST_POINTS / prepared.points()).max(1));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let spec = prepared.spec().digest();
    pool.install(|| {
        wanted
            .par_iter()
            .map(|wanted| {
                let path = folder.join(file_name(wanted.source));
                let replay = match kept(&path, &spec, wanted) {
                    Some(replay) => replay,
                    None => run_and_keep(prepared, wanted, &path, &spec)?,
                };
                done();
                Ok(replay)
            })
            .collect()
    })
}

/// How many of the wanted `folder` has no file of.
pub fn outstanding(wanted: &[Wanted], folder: &Path) -> usize {
    wanted.iter().filter(|wanted| !folder.join(file_name(wanted.source)).exists()).count()
}

fn file_name(source: Source) -> String {
    match source {
        Source::Index(index) => format!("{index:06}.json"),
        Source::Deterministic => "mean-properties.json".to_owned(),
    }
}

/// What is kept of it, if that is of this build and spec and all that is wanted; a file that cannot be read is none.
fn kept(path: &Path, spec: &str, wanted: &Wanted) -> Option<Replay> {
    let kept: Kept = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
    let fits = kept.build == identity::build() && kept.spec == spec;
    let enough = !wanted.scene || kept.replay.scene.is_some() || kept.replay.outcome.measures.is_none();
    (fits && enough).then_some(kept.replay)
}

fn run_and_keep(
    prepared: &Prepared,
    wanted: &Wanted,
    path: &Path,
    spec: &str,
) -> Result<Replay, ReplayError> {
    let replay = run(prepared, wanted)?;
    if wanted.scene && prepared.points() > MOST_KEPT_POINTS {
        return Ok(replay);
    }
    let kept = Kept { build: identity::build(), spec: spec.to_owned(), replay };
    let json = serde_json::to_vec(&kept).expect("a replay holds only numbers, words and lists");
    write_atomically(path, &json).map_err(|error| ReplayError::File { path: path.to_owned(), error })?;
    Ok(kept.replay)
}

/// Runs one analysis; under the eyes of a recorder, if it records no profile itself.
fn run(prepared: &Prepared, wanted: &Wanted) -> Result<Replay, Cancelled> {
    let model = &prepared.spec().model;
    let mut recorder =
        (!model.sample.profile).then(|| Recorder::new(Stations::of(&model.slope, &model.mesh)));
    // Without a recorder only the last moment matters: nothing lasts this long.
    let every_s = if recorder.is_some() { LOOK_EVERY_S } else { f64::MAX };
    let mut scene = None;
    let mut observe = |snapshot: &Snapshot<'_>| {
        if let Some(recorder) = &mut recorder {
            recorder.look(snapshot.state.motion());
        }
        // The last moment is the end.
        if wanted.scene {
            scene = Some(Scene::of(snapshot));
        }
    };
    let outcome = prepared.analyse(wanted.source, every_s, &mut observe, &Progress::default())?;
    let profile = recorder.map(Recorder::finish).or_else(|| outcome.profile.clone());
    Ok(Replay { outcome, profile, scene })
}

impl Scene {
    /// The points at a moment.
    pub fn of(snapshot: &Snapshot<'_>) -> Scene {
        let single = |values: &[f64]| values.iter().map(|v| *v as f32).collect();
        Scene {
            x0: single(snapshot.x0),
            y0: single(snapshot.y0),
            x: single(&snapshot.state.x),
            y: single(&snapshot.state.y),
            plastic_strain: single(&snapshot.state.plastic_strain),
            time_s: snapshot.time_s,
        }
    }
}
