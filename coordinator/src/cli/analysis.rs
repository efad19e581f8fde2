//! What `check`, `simulate`, `bench` and `replay` share: the solver's kernel, a prepared spec, one watched analysis.

use super::Failure;
use indicatif::{ProgressBar, ProgressStyle};
use runout_core::gimp::Kernel;
use runout_core::outcome::Outcome;
use runout_core::realisation::{Cancelled, Prepared, Progress, Snapshot, Source};
use runout_core::spec::Spec;
use runout_proto::identity;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often the progress bar looks.
const TICK: Duration = Duration::from_millis(50);

/// An analysis and what it cost here.
#[derive(Debug, Clone)]
pub(super) struct Watched {
    /// The outcome.
    pub(super) outcome: Outcome,
    /// Time steps, gravity stage included.
    pub(super) steps: u64,
    /// Time of the computation without the observer's, s.
    pub(super) wall_s: f64,
}

/// The kernel that `RUNOUT_KERNEL` names, or the fastest.
pub(super) fn kernel() -> Result<Kernel, Failure> {
    identity::kernel().map_err(|e| Failure::Input(e.to_string()))
}

/// The spec, laid out and ready.
pub(super) fn prepare(spec: &Spec) -> Result<Prepared, Failure> {
    Prepared::new(spec.clone(), kernel()?).map_err(|e| Failure::Input(e.to_string()))
}

/// Runs one analysis with a progress bar on standard error, if that is a terminal.
pub(super) fn watch(
    prepared: &Prepared,
    source: Source,
    every_s: f64,
    observer: &mut dyn FnMut(&Snapshot<'_>),
) -> Result<Watched, Failure> {
    let progress = Progress::default();
    let done = AtomicBool::new(false);
    let mut observing = Duration::ZERO;
    let (outcome, taken): (Result<Outcome, Cancelled>, Duration) = std::thread::scope(|scope| {
        scope.spawn(|| show(&progress, prepared.spec().model.analysis.duration_s, &done));
        let mut timed = |snapshot: &Snapshot<'_>| {
            let begun = Instant::now();
            observer(snapshot);
            observing += begun.elapsed();
        };
        let begun = Instant::now();
        let outcome = prepared.analyse(source, every_s, &mut timed, &progress);
        done.store(true, Ordering::Relaxed);
        // The thread that shows the progress may sleep a little longer.
        (outcome, begun.elapsed())
    });
    let wall_s = (taken - observing).as_secs_f64();
    let outcome = outcome.map_err(|e| Failure::Work(e.to_string()))?;
    Ok(Watched { outcome, steps: progress.steps(), wall_s })
}

fn show(progress: &Progress, duration_s: f64, done: &AtomicBool) {
    const PER_SECOND: f64 = 1e3;
    let bar = ProgressBar::new((duration_s * PER_SECOND) as u64);
    // The template is a constant: it is right or no test passes.
    let style = ProgressStyle::with_template("{bar:30} {msg} ({elapsed})");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    while !done.load(Ordering::Relaxed) {
        bar.set_position((progress.simulated_s() * PER_SECOND) as u64);
        bar.set_message(format!(
            "{:.2} of at most {duration_s} s, {} steps",
            progress.simulated_s(),
            progress.steps()
        ));
        std::thread::sleep(TICK);
    }
    bar.finish_and_clear();
}
