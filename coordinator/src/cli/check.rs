//! `runout check`: validates a campaign and prints what follows from it: size, time step, memory, time, warnings.
//!
//! What a realisation costs is told by some steps of the failure stage, in a few milliseconds, with the range that they
//! leave open; `--measure` runs a piece of realisation 0 instead.

use super::analysis::{kernel, prepare};
use super::{Failure, print, print_json};
use crate::advice;
use crate::load;
use crate::overrides::Override;
use crate::table::{list, significant};
use clap::Args;
use runout_core::campaign::{InitialStress, Layer};
use runout_core::field::effective::ScoreCorrelation;
use runout_core::gimp::Kernel;
use runout_core::outcome::Outcome;
use runout_core::realisation::{Prepared, Progress, Source};
use runout_core::slope;
use runout_core::spec::Spec;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// `runout check CAMPAIGN [--set KEY=VALUE] [--measure] [--json]`
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Campaign file
    campaign: PathBuf,
    /// Change a key of the campaign file, in TOML's syntax (repeatable): --set mesh.cell_size_m=0.8
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// Time a piece of realisation 0 (some seconds) instead of single steps (some milliseconds)
    #[arg(long)]
    measure: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// How long steps are timed at least, and how many at least. One goes before, which finds memory and caches cold.
const BRIEF: Duration = Duration::from_millis(5);
const FEWEST_STEPS: usize = 5;

/// How long `--measure` runs in the failure stage, and at most in all.
const PROBE: Duration = Duration::from_millis(700);
const PROBE_LIMIT: Duration = Duration::from_secs(20);
const LOOK: Duration = Duration::from_millis(5);

/// The names of this document are a contract.
#[derive(Debug, Serialize)]
struct Document {
    campaign: String,
    spec_digest: String,
    points: usize,
    cells: usize,
    point_spacing_m: f64,
    height_m: f64,
    mean_angle_deg: f64,
    /// From the top; empty if the ground is of one material.
    layers: Vec<LayerFacts>,
    obstacles: usize,
    kernel: &'static str,
    effective_scales: Vec<Scale>,
    time_step_s: Option<f64>,
    steps_at_most: Option<u64>,
    steps_per_s: f64,
    seconds_per_realisation_at_most: Option<f64>,
    /// What the quarter of faster and the quarter of slower steps would make of it; absent with `--measure`.
    seconds_per_realisation_range: Option<[f64; 2]>,
    /// Steps that were timed.
    timed_steps: u64,
    /// How many times as long a step takes as with [`Kernel::Avx2`]; absent if it does not.
    kernel_slowdown: Option<f64>,
    /// Samples that the stopping rule is likely to need, under the assumption of [`advice::likely_samples`].
    likely_samples: Option<u64>,
    peak_memory_mib: Option<f64>,
    warnings: Vec<String>,
    choices: Vec<String>,
}

/// Scales of fluctuation of a property's field after the copula, beside what was asked for.
#[derive(Debug, Serialize)]
struct Scale {
    property: &'static str,
    horizontal_m: f64,
    vertical_m: f64,
}

/// What became of a layer.
#[derive(Debug, Serialize)]
struct LayerFacts {
    name: String,
    points: usize,
    random: bool,
}

pub(super) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let loaded = load::load_with(&arguments.campaign, &arguments.set)?;
    let prepared = prepare(&loaded.spec)?;
    let speed = if arguments.measure { probe(&prepared) } else { brief(&prepared) };
    let kernel = kernel()?;
    let model = &loaded.spec.model;
    let steps_at_most = speed.steps_at_most;
    let [columns, rows] = prepared.grid().nodes.map(|n| n - 1);
    let mut warnings = advice::warnings(&loaded.campaign);
    if let Some(steps) = steps_at_most.filter(|steps| *steps > model.maximum_steps) {
        warnings.push(format!(
            "run.maximum_steps = {} is less than the {steps} steps that the whole duration takes: long slides would \
             end as failed",
            model.maximum_steps
        ));
    }
    warnings.extend(slow_kernel(kernel));
    let layers = layers(&prepared);
    for layer in layers.iter().filter(|layer| layer.points == 0) {
        warnings.push(format!("layers.{}: no material point lies in it", layer.name));
    }
    let document = Document {
        campaign: loaded.campaign.name.clone(),
        spec_digest: loaded.spec.digest(),
        points: prepared.points(),
        cells: columns * rows,
        point_spacing_m: model.mesh.point_spacing_m(),
        height_m: slope::height_m(&model.slope),
        mean_angle_deg: slope::mean_angle_rad(&model.slope).to_degrees(),
        layers,
        obstacles: model.obstacles.len(),
        kernel: kernel.name(),
        effective_scales: scales(&loaded.spec)?,
        time_step_s: speed.time_step_s,
        steps_at_most,
        steps_per_s: speed.steps_per_s,
        seconds_per_realisation_at_most: steps_at_most.map(|steps| steps as f64 / speed.steps_per_s),
        seconds_per_realisation_range: speed.range_s,
        timed_steps: speed.timed_steps,
        kernel_slowdown: is_slow(kernel).then_some(BASELINE_SLOWDOWN),
        likely_samples: advice::likely_samples(&loaded.campaign.stop.rule),
        peak_memory_mib: peak_memory_mib(),
        warnings,
        choices: advice::choices(&loaded.campaign),
    };
    if arguments.json {
        print_json(&document)?;
    } else {
        print(&text(&arguments.campaign.display().to_string(), &document))?;
    }
    Ok(())
}

fn text(path: &str, document: &Document) -> String {
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
    let or_dash = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| significant(v, 3));
    row("spec digest", document.spec_digest.clone());
    row("material points", document.points.to_string());
    row("grid cells", document.cells.to_string());
    row("point spacing, m", significant(document.point_spacing_m, 6));
    let shape = (significant(document.height_m, 4), significant(document.mean_angle_deg, 3));
    row("slope, m", format!("{} high at {}\u{b0}", shape.0, shape.1));
    for layer in &document.layers {
        let constants = if layer.random { "random fields" } else { "constants" };
        row(&format!("layer {}", layer.name), format!("{} points, {constants}", layer.points));
    }
    if document.obstacles > 0 {
        row("rigid obstacles", document.obstacles.to_string());
    }
    for scale in &document.effective_scales {
        let pair = format!("{} x {}", significant(scale.horizontal_m, 3), significant(scale.vertical_m, 3));
        row(&format!("effective scale of fluctuation, {}, m", scale.property), pair);
    }
    row("kernel", document.kernel.to_owned());
    row("time step, s", or_dash(document.time_step_s));
    row(
        "steps for the whole duration",
        document.steps_at_most.map_or_else(|| "-".to_owned(), |s| s.to_string()),
    );
    row("steps per s, one core", significant(document.steps_per_s, 3));
    row("seconds per realisation, at most", longest(document));
    if let Some(samples) = document.likely_samples {
        let assumed = advice::LIKELY_VARIATION;
        row(
            "slides that the rule needs, about",
            format!(
                "{samples} (if runout has a coefficient of variation of {assumed}; stable slopes come on top)"
            ),
        );
    }
    row("memory of one realisation, MiB", or_dash(document.peak_memory_mib));
    let mut text = format!("{path}: sound\n\n{}", list(&rows));
    for (title, lines) in
        [("Warnings", &document.warnings), ("Choices that move the answer", &document.choices)]
    {
        if !lines.is_empty() {
            text.push_str(&format!("\n{title}\n"));
            lines.iter().for_each(|line| text.push_str(&format!("- {line}\n")));
        }
    }
    text
}

/// The longest that a realisation may take, and how well that is known.
fn longest(document: &Document) -> String {
    let Some(seconds) = document.seconds_per_realisation_at_most else { return "-".to_owned() };
    let seconds = significant(seconds, 2);
    let steps = document.timed_steps;
    match document.seconds_per_realisation_range {
        Some([low, high]) => {
            let range = format!("{} to {}", significant(low, 2), significant(high, 2));
            format!("{seconds} ({range} by {steps} steps; --measure times more; stable slopes end early)")
        }
        None => format!("{seconds} (by {steps} steps; stable slopes end early)"),
    }
}

/// Time of a step with the baseline kernel over that with AVX2 on x86-64, which has no fused multiply-add without it: 20
/// in one phase (docs/performance.md).
const BASELINE_SLOWDOWN: f64 = 20.0;

/// Whether fused multiply-adds are emulated; other architectures have them.
fn is_slow(kernel: Kernel) -> bool {
    cfg!(target_arch = "x86_64") && kernel == Kernel::Baseline
}

fn slow_kernel(kernel: Kernel) -> Option<String> {
    let why = if Kernel::best() == kernel {
        "this processor has no AVX2 with fused multiply-add".to_owned()
    } else {
        format!("RUNOUT_KERNEL asks for it, though this processor runs {}", Kernel::best().name())
    };
    is_slow(kernel).then(|| {
        format!(
            "kernel baseline: {why}; the outcomes are the same to the bit, and each step takes about \
             {BASELINE_SLOWDOWN} times as long as with avx2 (the times here count that in)"
        )
    })
}

fn layers(prepared: &Prepared) -> Vec<LayerFacts> {
    let random = &prepared.spec().random;
    let facts = |(i, layer): (usize, &Layer)| LayerFacts {
        name: layer.name.clone(),
        points: prepared.materials().iter().filter(|&&m| usize::from(m) == i).count(),
        random: random.iter().any(|r| layer.soil.constant(r.property).is_none()),
    };
    prepared.spec().model.layers.iter().enumerate().map(facts).collect()
}

fn scales(spec: &Spec) -> Result<Vec<Scale>, Failure> {
    let field = &spec.model.field;
    spec.random
        .iter()
        .enumerate()
        .map(|(j, random)| {
            let score = ScoreCorrelation::new(&spec.copula, j).map_err(|e| Failure::Input(e.to_string()))?;
            Ok(Scale {
                property: random.property.name(),
                horizontal_m: score.effective_scale(field.autocorrelation, field.scale_horizontal_m),
                vertical_m: score.effective_scale(field.autocorrelation, field.scale_vertical_m),
            })
        })
        .collect()
}

/// What the steps that were timed tell of a whole realisation.
struct Speed {
    /// Of the failure stage; absent if it cannot be analysed.
    time_step_s: Option<f64>,
    /// For the whole duration, gravity stage included.
    steps_at_most: Option<u64>,
    steps_per_s: f64,
    /// Time for these steps if each took as long as the quarter of faster, and the quarter of slower ones, s.
    range_s: Option<[f64; 2]>,
    timed_steps: u64,
}

/// Times some steps of the failure stage, and takes those of the gravity stage, which are shorter work, to be like them.
fn brief(prepared: &Prepared) -> Speed {
    let Some(mut trial) = prepared.trial() else {
        return Speed {
            time_step_s: None,
            steps_per_s: 0.0,
            steps_at_most: None,
            range_s: None,
            timed_steps: 0,
        };
    };
    trial.step();
    let begun = Instant::now();
    let (mut times_s, mut time_step_s) = (Vec::new(), 0.0);
    while times_s.len() < FEWEST_STEPS || begun.elapsed() < BRIEF {
        let begun = Instant::now();
        time_step_s = trial.step();
        times_s.push(begun.elapsed().as_secs_f64());
    }
    times_s.sort_by(f64::total_cmp);
    let steps = steps_at_most(prepared, time_step_s);
    let at = |share: f64| times_s[(share * (times_s.len() - 1) as f64).round() as usize];
    Speed {
        time_step_s: Some(time_step_s),
        steps_per_s: 1.0 / at(0.5),
        steps_at_most: Some(steps),
        range_s: Some([0.25, 0.75].map(|share| at(share) * steps as f64)),
        timed_steps: times_s.len() as u64,
    }
}

/// Steps of this length for the whole duration, gravity stage included.
fn steps_at_most(prepared: &Prepared, time_step_s: f64) -> u64 {
    let analysis = &prepared.spec().model.analysis;
    let gravity_stage_s = match analysis.initial_stress {
        InitialStress::Gravity => analysis.gravity_stage_s,
        InitialStress::K0(_) => 0.0,
    };
    ((analysis.duration_s + gravity_stage_s) / time_step_s).ceil() as u64
}

/// Runs realisation 0 through its gravity stage and some of its failure stage, then cancels it.
fn probe(prepared: &Prepared) -> Speed {
    let progress = Progress::default();
    let done = AtomicBool::new(false);
    let begun = Instant::now();
    let (outcome, seen) = std::thread::scope(|scope| {
        let watcher = scope.spawn(|| {
            // Steps and time when the failure stage was first seen.
            let mut first: Option<(u64, f64, Instant)> = None;
            while !done.load(Ordering::Relaxed) {
                if first.is_none() && progress.simulated_s() > 0.0 {
                    first = Some((progress.steps(), progress.simulated_s(), Instant::now()));
                }
                let enough = first.is_some_and(|(_, _, since)| since.elapsed() >= PROBE);
                if enough || begun.elapsed() >= PROBE_LIMIT {
                    progress.cancel();
                }
                std::thread::sleep(LOOK);
            }
            first
        });
        let outcome = prepared.analyse(Source::Index(0), f64::INFINITY, &mut |_| {}, &progress).ok();
        done.store(true, Ordering::Relaxed);
        (outcome, watcher.join().ok().flatten())
    });
    let steps_per_s = progress.steps() as f64 / begun.elapsed().as_secs_f64();
    // A small slope may have come to rest before the watcher looked a second time.
    let of_whole = |o: &Outcome| (o.steps > 0).then(|| o.simulated_s / o.steps as f64);
    let of_piece = seen.and_then(|(steps, simulated_s, _)| {
        let more = progress.steps().saturating_sub(steps);
        (more > 0).then(|| (progress.simulated_s() - simulated_s) / more as f64)
    });
    let time_step_s = outcome.as_ref().and_then(of_whole).or(of_piece);
    let steps_at_most = time_step_s.map(|dt| steps_at_most(prepared, dt));
    Speed { time_step_s, steps_per_s, steps_at_most, range_s: None, timed_steps: progress.steps() }
}

/// The largest memory that this process has had, which has just held a realisation; Linux only.
fn peak_memory_mib() -> Option<f64> {
    const KIB_PER_MIB: f64 = 1024.0;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / KIB_PER_MIB)
}
