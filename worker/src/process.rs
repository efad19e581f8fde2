//! The worker as a process: signals, the parent's end, logging, exit codes.

use crate::options::Options;
use crate::runner::WorkerError;
use crate::{Prepare, documents, runner};
use clap::Parser;
use runout_proto::logging;
use std::io::{self, IsTerminal, Read, Write};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tracing_subscriber::layer::{Layer, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Registry};

/// Exit code after a second SIGTERM: 128 + 15, as shells count.
const TERMINATED: i32 = 143;

/// Exit code of a worker that cannot work for this coordinator, now or later (another build, say).
pub const CANNOT_WORK: u8 = 2;

/// Parses the command line, works, and gives the exit code: 0 if the worker left in order, [`CANNOT_WORK`] if no
/// other attempt would fare better, 1 if it went wrong. `build` is the identity to register with.
pub fn main(prepare: Prepare, build: String) -> ExitCode {
    if let Some(written) = documents::asked_for() {
        return written;
    }
    let options = Options::parse();
    // Of a local worker only what is wrong matters: its coordinator shows the progress.
    let usual = if options.leave_with_parent { "warn" } else { "warn,runout_worker=info" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(usual));
    let colour = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
    let lines = logging::layer::<Registry, _>(options.log_format, colour, io::stderr);
    tracing_subscriber::registry().with(lines.with_filter(filter)).init();
    match work(&options, prepare, build) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // A reader of standard error that has gone away is no reason to panic.
            let _ = writeln!(io::stderr(), "runout-worker: {error}");
            ExitCode::from(if error.is_final() { CANNOT_WORK } else { 1 })
        }
    }
}

fn work(options: &Options, prepare: Prepare, build: String) -> Result<(), WorkerError> {
    if options.leave_with_parent {
        thread::Builder::new().name("parent".to_owned()).spawn(leave_with_parent)?;
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    let ended = runtime.block_on(async {
        let interrupts = interruptions()?;
        runner::run(options, prepare, build, interrupts).await
    });
    // A computing thread that has not yet seen its cancellation is no reason to stay.
    runtime.shutdown_background();
    ended
}

/// Signals that come this soon after one another are one: `timeout` and batch systems signal a process and its group.
const ONE_SIGNAL: Duration = Duration::from_millis(500);

/// Counts SIGTERM and SIGINT; the second one ends the process at once.
fn interruptions() -> io::Result<watch::Receiver<u32>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let (count, counted) = watch::channel(0);
    tokio::spawn(async move {
        let mut last: Option<Instant> = None;
        loop {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            if last.is_some_and(|at| at.elapsed() < ONE_SIGNAL) {
                continue;
            }
            last = Some(Instant::now());
            count.send_modify(|n| *n += 1);
            if *count.borrow() > 1 {
                std::process::exit(TERMINATED);
            }
        }
    });
    Ok(counted)
}

/// Ends the process when the parent has closed standard input or is gone. Finished outcomes are in the spool.
fn leave_with_parent() {
    let mut ignored = [0; 64];
    while io::stdin().read(&mut ignored).is_ok_and(|n| n > 0) {}
    std::process::exit(0);
}
