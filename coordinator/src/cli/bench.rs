//! `runout bench`: the speed of fields and solver on one core of this machine, where a realisation's time goes, and the
//! memory it needs.

use super::analysis::{kernel, prepare};
use super::{Failure, print, print_json, seconds};
use crate::load;
use crate::table::{list, significant};
use clap::Args;
use runout_core::campaign::InitialStress;
use runout_core::gimp::Kernel;
use runout_core::realisation::{Prepared, Progress, Snapshot, Source};
use runout_core::spec::Spec;
use serde::Serialize;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

/// `runout bench CAMPAIGN [--seconds S] [--json]`
#[derive(Debug, Args)]
pub struct BenchArguments {
    /// Campaign file
    campaign: PathBuf,
    /// Start whole realisations for this long, s; the one under way is finished, and at least two are timed
    #[arg(long, value_name = "S", default_value = "20", value_parser = seconds)]
    seconds: Duration,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// At least this many realisations: the first one computes the gravity stage that the others share.
const FEWEST_REALISATIONS: u64 = 2;
/// Fields are timed for this long.
const FIELD_TIME: Duration = Duration::from_millis(500);
/// Each kernel is timed for this long, or for a tenth of the time for realisations if that is shorter.
const KERNEL_TIME: Duration = Duration::from_millis(500);
/// Horizontal over vertical stress where kernels start without a gravity stage: any usual value will do for their time.
const STRESS_RATIO: f64 = 0.5;

/// The names of this document are a contract.
#[derive(Debug, Serialize)]
struct Document {
    points: usize,
    kernel: &'static str,
    realisations: u64,
    steps_per_s: f64,
    point_updates_per_s_per_core: f64,
    /// Mean without the first one, whose gravity stage the others share if the unit weight is not random.
    seconds_per_realisation: f64,
    field_ms: f64,
    /// Reading the campaign, fitting, freezing, laying out the points and planning the fields.
    start_up_ms: f64,
    /// Growth of the most memory resident, from the start to the end of the realisations, over the points; absent where
    /// the system does not tell.
    memory_bytes_per_point: Option<f64>,
    /// The first realisation's gravity stage (or K0), s.
    gravity_stage_s: f64,
    parts: Parts,
    kernels: Vec<KernelSpeed>,
}

/// Where the time of a realisation goes, means without the first one, s.
#[derive(Debug, Clone, Copy, Default, Serialize)]
struct Parts {
    field_s: f64,
    /// Near zero where the first realisation's is kept.
    gravity_stage_s: f64,
    failure_stage_s: f64,
    /// With the digest of the final state.
    measures_s: f64,
}

/// A kernel's speed at the beginning of the failure stage.
#[derive(Debug, Serialize)]
struct KernelSpeed {
    name: &'static str,
    point_updates_per_s_per_core: f64,
}

pub(super) fn bench(arguments: &BenchArguments) -> Result<(), Failure> {
    let resident_before = peak_resident_bytes();
    let begun = Instant::now();
    let loaded = load::load(&arguments.campaign)?;
    let prepared = prepare(&loaded.spec)?;
    let start_up_ms = 1e3 * begun.elapsed().as_secs_f64();
    let document = measure(&prepared, arguments.seconds, start_up_ms, resident_before)?;
    if arguments.json {
        print_json(&document)?;
    } else {
        print(&list(&rows(&document)))?;
    }
    Ok(())
}

fn rows(document: &Document) -> Vec<(&'static str, String)> {
    let show = |v: f64| significant(v, 4);
    let parts = &document.parts;
    let kernels = document
        .kernels
        .iter()
        .map(|kernel| format!("{} {}", kernel.name, show(kernel.point_updates_per_s_per_core)));
    vec![
        ("kernel", document.kernel.to_owned()),
        ("points", document.points.to_string()),
        ("memory, bytes a point", document.memory_bytes_per_point.map_or("?".to_owned(), show)),
        ("start-up, ms", show(document.start_up_ms)),
        ("realisations timed", document.realisations.to_string()),
        ("steps per s, one core", show(document.steps_per_s)),
        ("point updates per s, one core", show(document.point_updates_per_s_per_core)),
        ("each kernel, early in the failure", kernels.collect::<Vec<_>>().join(", ")),
        ("seconds per realisation", show(document.seconds_per_realisation)),
        ("  field", show(parts.field_s)),
        ("  gravity stage", show(parts.gravity_stage_s)),
        ("  failure stage", show(parts.failure_stage_s)),
        ("  measures and digest", show(parts.measures_s)),
        ("first gravity stage, s", show(document.gravity_stage_s)),
        ("field, ms", show(document.field_ms)),
    ]
}

fn measure(
    prepared: &Prepared,
    solver_time: Duration,
    start_up_ms: f64,
    resident_before: Option<f64>,
) -> Result<Document, Failure> {
    let field_ms = field_ms(prepared);
    let begun = Instant::now();
    let (mut steps, mut wall_s, mut realisations) = (0, 0.0, 0);
    let (mut later_wall_s, mut first, mut later) = (0.0, Parts::default(), Parts::default());
    while realisations < FEWEST_REALISATIONS || begun.elapsed() < solver_time {
        let timed = realisation(prepared, realisations, field_ms)?;
        steps += timed.steps;
        wall_s += timed.wall_s;
        if realisations == 0 {
            first = timed.parts;
        } else {
            later_wall_s += timed.wall_s;
            later.add(&timed.parts);
        }
        realisations += 1;
    }
    let resident = peak_resident_bytes().zip(resident_before).map(|(after, before)| after - before);
    let (steps_per_s, later_count) = (steps as f64 / wall_s, (realisations - 1) as f64);
    Ok(Document {
        points: prepared.points(),
        kernel: kernel()?.name(),
        realisations,
        steps_per_s,
        point_updates_per_s_per_core: steps_per_s * prepared.points() as f64,
        seconds_per_realisation: later_wall_s / later_count,
        field_ms,
        start_up_ms,
        memory_bytes_per_point: resident.map(|bytes| bytes / prepared.points() as f64),
        gravity_stage_s: first.gravity_stage_s,
        parts: later.over(later_count),
        kernels: kernel_speeds(prepared.spec(), KERNEL_TIME.min(solver_time / 10))?,
    })
}

/// A realisation, timed.
struct Timed {
    steps: u64,
    wall_s: f64,
    parts: Parts,
}

/// The observer is called where the failure stage begins and where it ends; the field's time is known. No progress bar: its
/// thread would be timed as well.
fn realisation(prepared: &Prepared, index: u64, field_ms: f64) -> Result<Timed, Failure> {
    let beyond_the_end_s = 2.0 * prepared.spec().model.analysis.duration_s;
    let (progress, mut moments) = (Progress::default(), Vec::new());
    let begun = Instant::now();
    let mut observer = |_: &Snapshot<'_>| moments.push(begun.elapsed().as_secs_f64());
    let outcome = prepared.analyse(Source::Index(index), beyond_the_end_s, &mut observer, &progress);
    let wall_s = begun.elapsed().as_secs_f64();
    outcome.map_err(|e| Failure::Work(e.to_string()))?;
    // An analysis that cannot start is seen by no observer: its time is the field's and the gravity stage's.
    let at = |moment: Option<&f64>| moment.copied().unwrap_or(wall_s);
    let (start_s, end_s) = (at(moments.first()), at(moments.last()));
    let field_s = 1e-3 * field_ms;
    let parts = Parts {
        field_s,
        gravity_stage_s: (start_s - field_s).max(0.0),
        failure_stage_s: end_s - start_s,
        measures_s: wall_s - end_s,
    };
    Ok(Timed { steps: progress.steps(), wall_s, parts })
}

impl Parts {
    fn add(&mut self, more: &Parts) {
        self.field_s += more.field_s;
        self.gravity_stage_s += more.gravity_stage_s;
        self.failure_stage_s += more.failure_stage_s;
        self.measures_s += more.measures_s;
    }

    fn over(self, count: f64) -> Parts {
        Parts {
            field_s: self.field_s / count,
            gravity_stage_s: self.gravity_stage_s / count,
            failure_stage_s: self.failure_stage_s / count,
            measures_s: self.measures_s / count,
        }
    }
}

/// Mean time of one realisation's properties at all points, ms.
fn field_ms(prepared: &Prepared) -> f64 {
    let begun = Instant::now();
    let mut fields = 0;
    while begun.elapsed() < FIELD_TIME || fields == 0 {
        std::hint::black_box(prepared.properties(Source::Index(fields)));
        fields += 1;
    }
    1e3 * begun.elapsed().as_secs_f64() / fields as f64
}

/// Every kernel of this processor on the slope with mean properties, cut short after `time`. It starts from K0 stresses,
/// because the slow kernel would be at its gravity stage for minutes.
fn kernel_speeds(spec: &Spec, time: Duration) -> Result<Vec<KernelSpeed>, Failure> {
    let mut spec = spec.clone();
    spec.model.analysis.initial_stress = InitialStress::K0(STRESS_RATIO);
    let speed = |kernel: Kernel| {
        let prepared = Prepared::new(spec.clone(), kernel).map_err(|e| Failure::Input(e.to_string()))?;
        let progress = Progress::default();
        let mut start = None;
        let taken_s = thread::scope(|scope| {
            scope.spawn(|| {
                thread::sleep(time);
                progress.cancel();
            });
            let mut at_start = |_: &Snapshot<'_>| {
                start.get_or_insert_with(Instant::now);
            };
            // Cut short or, where the slope is small, at its end: both will do.
            let _ = prepared.analyse(Source::Deterministic, f64::MAX, &mut at_start, &progress);
            start.map_or(f64::INFINITY, |start| start.elapsed().as_secs_f64())
        });
        let updates = progress.steps() as f64 * prepared.points() as f64;
        Ok(KernelSpeed { name: kernel.name(), point_updates_per_s_per_core: updates / taken_s })
    };
    Kernel::available().into_iter().map(speed).collect()
}

/// Most memory that this process has had resident so far, bytes, where the system tells it (Linux).
fn peak_resident_bytes() -> Option<f64> {
    const BYTES_PER_KB: f64 = 1024.0;
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? * BYTES_PER_KB)
}
