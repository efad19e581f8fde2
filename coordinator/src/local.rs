//! Worker processes on this machine, for `runout run`.
//!
//! A worker holds the other end of its standard input: when this process dies, however it dies, the worker sees the
//! end and leaves. A worker that crashes is replaced, within a bound; one that cannot work for this campaign, or was set
//! aside, is not.

use crate::shared::Shared;
use runout_proto::logging::LogFormat;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Weak;
use std::time::Duration;
use thiserror::Error;
use tokio::process::{Child, Command};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

/// Crashes in a row, without an outcome between them, after which a local worker is not replaced any more. A
/// realisation that takes workers down is given up after three.
const MOST_CRASHES: u32 = 10;
/// Exit code of a worker that cannot work for this campaign, now or later.
const CANNOT_WORK: i32 = 2;
/// Wait before a crashed worker is replaced, so that one that cannot start does not spin.
const RESTART_DELAY: Duration = Duration::from_millis(500);
/// Longest wait for a worker to leave once the coordinator is done; then it is killed.
const LEAVE_LIMIT: Duration = Duration::from_secs(5);

/// Local workers that cannot be started.
#[derive(Debug, Error)]
pub enum LocalError {
    /// The program is not there.
    #[error("{}: the worker program is not there; it belongs beside `runout` (build both with `cargo build --release`), or name it with --worker-program", .0.display())]
    NoProgram(PathBuf),
    /// The system does not say where this program is.
    #[error("where `runout` itself is cannot be found out: {0}")]
    NoOwnPath(io::Error),
    /// Every worker has crashed too often, was set aside, or cannot work for this campaign.
    #[error(
        "no local worker is left: they cannot work for this campaign, were set aside, or crashed {MOST_CRASHES} times in \
         a row; the messages above say why. What was acknowledged is kept: run the command again to continue"
    )]
    NoneLeft,
}

/// The worker program: `given`, or `runout-worker` beside this program.
///
/// # Errors
/// There is none.
pub fn worker_program(given: Option<&Path>) -> Result<PathBuf, LocalError> {
    let program = match given {
        Some(path) => path.to_owned(),
        None => std::env::current_exe().map_err(LocalError::NoOwnPath)?.with_file_name("runout-worker"),
    };
    if program.is_file() { Ok(program) } else { Err(LocalError::NoProgram(program)) }
}

/// What local workers are started with.
#[derive(Debug, Clone)]
pub struct Crew {
    /// The worker program.
    pub program: PathBuf,
    /// URL of the coordinator.
    pub url: String,
    /// Where they spool.
    pub spool: PathBuf,
    /// TLS directory, for an `https://` URL.
    pub tls: Option<PathBuf>,
    /// How their logs are written.
    pub log_format: LogFormat,
}

/// Keeps `count` workers running until each has left in order, crashed too often or was set aside, or `stop` is set; then
/// kills what is left.
///
/// # Errors
/// None is left but those that crashed too often, were set aside or cannot work.
pub async fn keep_running(
    crew: Crew,
    count: usize,
    shared: Weak<Shared>,
    stop: watch::Receiver<bool>,
) -> Result<(), LocalError> {
    let mut all = JoinSet::new();
    for number in 1..=count {
        all.spawn(keep_one(crew.clone(), number, Weak::clone(&shared), stop.clone()));
    }
    let left_in_order = all.join_all().await;
    if left_in_order.contains(&true) { Ok(()) } else { Err(LocalError::NoneLeft) }
}

/// How a worker process ended.
enum End {
    /// In order, or because it was stopped.
    InOrder,
    /// It said that it cannot work for this campaign.
    CannotWork,
    /// Some other way, in words.
    Crash(String),
}

/// Returns whether the worker left in order.
async fn keep_one(crew: Crew, number: usize, shared: Weak<Shared>, mut stop: watch::Receiver<bool>) -> bool {
    let mut crashes = 0;
    for started in 1_u64.. {
        let name = format!("local-{number}.{started}");
        let what = match run_one(start(&crew, &name), &shared, &mut stop).await {
            End::InOrder => return true,
            End::CannotWork => {
                tracing::error!(worker = name, "worker {name} cannot work for this campaign");
                return false;
            }
            End::Crash(what) => what,
        };
        let delivered = bury(&shared, &name);
        if shared.upgrade().is_some_and(|shared| shared.engine().queue().is_set_aside(&name)) {
            // Its next name would be trusted anew.
            tracing::error!(worker = name, "worker {name} was set aside and is not replaced");
            return false;
        }
        crashes = if delivered { 1 } else { crashes + 1 };
        if crashes >= MOST_CRASHES {
            break;
        }
        tracing::warn!(worker = name, "worker {name} {what}; it is replaced");
        tokio::select! {
            () = sleep(RESTART_DELAY) => {}
            _ = stop.wait_for(|s| *s) => return true,
        }
    }
    tracing::error!(
        "local worker {number} crashed {MOST_CRASHES} times in a row and is not replaced any more"
    );
    false
}

async fn run_one(started: io::Result<Child>, shared: &Weak<Shared>, stop: &mut watch::Receiver<bool>) -> End {
    let mut child = match started {
        Ok(child) => child,
        Err(error) => return End::Crash(format!("cannot be started: {error}")),
    };
    // Waiting for a child closes its standard input, and that would tell it to leave.
    let lifeline = child.stdin.take();
    let ended = tokio::select! {
        ended = child.wait() => Some(ended),
        _ = stop.wait_for(|s| *s) => None,
    };
    let Some(ended) = ended else {
        drop(lifeline);
        end(child).await;
        return End::InOrder;
    };
    match ended {
        Ok(status) if status.success() && is_ending(shared) => End::InOrder,
        Ok(status) if status.code() == Some(CANNOT_WORK) => End::CannotWork,
        Ok(status) => End::Crash(format!("ended with {status}")),
        Err(error) => End::Crash(format!("cannot be waited for: {error}")),
    }
}

/// Gives up a worker that is dead; returns whether it had delivered any outcome.
fn bury(shared: &Weak<Shared>, name: &str) -> bool {
    let Some(shared) = shared.upgrade() else { return false };
    let mut engine = shared.engine();
    let delivered = engine.queue().workers().any(|(_, worker)| worker.name == name && worker.done > 0);
    let events = engine.worker_died(name);
    drop(engine);
    shared.handle(events);
    delivered
}

fn start(crew: &Crew, name: &str) -> io::Result<Child> {
    let log_format = match crew.log_format {
        LogFormat::Text => "text",
        LogFormat::Json => "json",
    };
    let mut command = Command::new(&crew.program);
    command
        .args(["--coordinator", &crew.url, "--slots", "1", "--name", name, "--leave-with-parent"])
        .args(["--log-format", log_format, "--spool"])
        .arg(&crew.spool);
    if let Some(folder) = &crew.tls {
        command.arg("--tls").arg(folder);
    }
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        // Control-C in a terminal is for the coordinator, which tells its workers.
        .process_group(0)
        .kill_on_drop(true)
        .spawn()
}

/// Whether a worker has reason to leave in order.
fn is_ending(shared: &Weak<Shared>) -> bool {
    shared.upgrade().is_none_or(|shared| shared.engine().is_ending())
}

/// Waits for a worker that was told to leave, by the end of its standard input.
async fn end(mut child: Child) {
    if timeout(LEAVE_LIMIT, child.wait()).await.is_err() {
        // It is gone already if this fails.
        let _ = child.kill().await;
    }
}
