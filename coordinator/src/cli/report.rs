//! `runout report`: one self-contained page and its figures, in the run directory.

use super::analysis::prepare;
use super::{Failure, print, print_json, run_records::RunRecords, say};
use crate::events::{self, What};
use crate::machine::Machine;
use crate::replays::{self, ReplayError, Wanted};
use crate::report::analysis::{Distance, analyse};
use crate::report::figures::Content;
use crate::report::{self, Material, Replays, Report, Work};
use crate::status::duration;
use crate::store::log::Record;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use runout_core::estimate::Estimate;
use runout_core::outcome::Outcome;
use runout_core::realisation::{Prepared, Source};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// `runout report DIR [--profiles N] [--no-gallery] [--no-replays] [--json]`
#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Run directory; report.html, figures/ and replays/ are written into it
    dir: PathBuf,
    /// Samples chosen at random and replayed for deposit depths and speeds along the ground, where the campaign does not record
    /// them in every realisation (sample.profile); what was replayed before is kept
    #[arg(long, value_name = "N", default_value = "20", value_parser = clap::value_parser!(u16).range(0..=1000))]
    profiles: u16,
    /// No pictures of the median, 90th and 99th percentile and longest slide, and no run with mean properties
    #[arg(long)]
    no_gallery: bool,
    /// Replay nothing: neither profiles nor gallery, a report within seconds
    #[arg(long, conflicts_with = "profiles")]
    no_replays: bool,
    /// Print one JSON document: what was written, the estimates and the distances of rare slides
    #[arg(long)]
    json: bool,
}

pub(super) fn report(arguments: &ReportArguments) -> Result<(), Failure> {
    let dir = &arguments.dir;
    let run = RunRecords::read(dir)?;
    run.warn();
    let outcomes: Vec<Outcome> = run.decided().iter().map(|r| r.outcome.clone()).collect();
    let notes = run.notes();
    let prepared = prepare(&run.view.spec)?;
    let replays = replay(arguments, &run, &outcomes, &prepared)?;
    let report = report::report(&Material {
        campaign: &run.loaded.campaign,
        campaign_text: &run.view.campaign_text,
        site: run.loaded.site.as_ref(),
        fit: &run.loaded.fit,
        spec: &run.view.spec,
        outcomes: &outcomes,
        notes: &notes,
        prepared: Some(&prepared),
        replays: &replays,
        work: &work(run.decided(), machines(dir)?),
    })
    .map_err(|e| Failure::work(dir.display(), e))?;
    let figures = dir.join("figures");
    std::fs::create_dir_all(&figures).map_err(|e| Failure::work(figures.display(), e))?;
    let page = dir.join("report.html");
    write(&page, report.html.as_bytes())?;
    for figure in &report.figures {
        let path = |extension: &str| figures.join(format!("{}.{extension}", figure.name));
        match &figure.content {
            Content::Chart { svg, png } => {
                write(&path("svg"), svg.as_bytes())?;
                write(&path("png"), png)?;
            }
            Content::Picture(png) => write(&path("png"), png)?,
        }
    }
    if arguments.json {
        let Report { estimate, distances, .. } = &report;
        return print_json(&Document { page, figures: names(&report), estimate, distances });
    }
    print(&format!(
        "wrote {} and {} figures in {}\n",
        page.display(),
        report.figures.len(),
        figures.display()
    ))
}

/// The figures' names: each is a file .png in figures/, the charts .svg too.
fn names(report: &Report) -> Vec<&str> {
    report.figures.iter().map(|figure| figure.name.as_str()).collect()
}

/// The names of this document are a contract.
#[derive(Serialize)]
struct Document<'a> {
    page: PathBuf,
    figures: Vec<&'a str>,
    estimate: &'a Estimate,
    distances: &'a [Distance],
}

/// Replays what the page shows.
fn replay(
    arguments: &ReportArguments,
    run: &RunRecords,
    outcomes: &[Outcome],
    prepared: &Prepared,
) -> Result<Replays, Failure> {
    if arguments.no_replays {
        return Ok(Replays::default());
    }
    let analysis = analyse(&run.loaded.campaign, outcomes);
    let seed = run.view.spec.seed;
    let profiles = if run.view.spec.model.sample.profile { 0 } else { usize::from(arguments.profiles) };
    let profiled = Replays::choose(&analysis.indices, profiles, seed);
    let mut wanted: BTreeMap<u64, bool> = profiled.iter().map(|index| (*index, false)).collect();
    if !arguments.no_gallery {
        wanted.extend(analysis.picks.iter().map(|pick| (pick.index, true)));
    }
    let with_means = !arguments.no_gallery && !run.view.spec.random.is_empty();
    let mut list: Vec<Wanted> =
        wanted.iter().map(|(index, scene)| Wanted { source: Source::Index(*index), scene: *scene }).collect();
    if with_means {
        list.push(Wanted { source: Source::Deterministic, scene: true });
    }
    let folder = arguments.dir.join("replays");
    let bar = progress(run.decided(), list.len(), replays::outstanding(&list, &folder));
    let failed = |e: ReplayError| Failure::Work(e.to_string());
    let mut found = replays::replay(prepared, &list, &folder, &|| bar.inc(1)).map_err(failed)?;
    bar.finish_and_clear();
    let mean_properties = if with_means { found.pop() } else { None };
    Ok(Replays { mean_properties, realisations: wanted.into_keys().zip(found).collect(), profiled })
}

/// Says how long it may take to run those `outstanding`, and shows how far it is.
fn progress(records: &[Record], count: usize, outstanding: usize) -> ProgressBar {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let wall_s: f64 = records.iter().map(|r| r.wall_s).sum();
    let each_s = wall_s / records.len().max(1) as f64;
    if outstanding > 0 {
        say(&format!(
            "replaying {outstanding} realisations, about {} if they cost what they did ({cores} cores); --no-replays leaves them out\n",
            duration(each_s * outstanding as f64 / cores as f64),
        ));
    }
    let bar = ProgressBar::new(count as u64);
    // The template is a constant: it is right or no test passes.
    let style = ProgressStyle::with_template("{bar:30} {pos} of {len} replays ({elapsed})");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// What each worker said of its machine, by name.
fn machines(dir: &Path) -> Result<BTreeMap<String, BTreeSet<Machine>>, Failure> {
    let mut machines: BTreeMap<String, BTreeSet<Machine>> = BTreeMap::new();
    let read = events::read(dir, |noted| {
        if let What::Registered { worker, machine: Some(machine), .. } = noted.what {
            machines.entry(worker).or_default().insert(machine);
        }
    });
    read.map(|_| machines).map_err(|e| Failure::work(dir.join(events::EVENTS_FILE).display(), e))
}

/// What each worker did, by name; what the coordinator gave up itself was no work.
fn work(records: &[Record], mut machines: BTreeMap<String, BTreeSet<Machine>>) -> Vec<Work> {
    let mut work: BTreeMap<&str, Work> = BTreeMap::new();
    for record in records.iter().filter(|record| record.attempt > 0) {
        let name = record.worker.as_str();
        let of_worker = work.entry(name).or_insert_with(|| Work {
            worker: name.to_owned(),
            realisations: 0,
            wall_s: 0.0,
            machines: machines.remove(name).into_iter().flatten().collect(),
        });
        of_worker.realisations += 1;
        of_worker.wall_s += record.wall_s;
    }
    work.into_values().collect()
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes).map_err(|e| Failure::work(path.display(), e))
}
