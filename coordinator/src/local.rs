//! Worker processes on this machine, for `runout run`.
//!
//! A worker holds the other end of its standard input: when this process dies, however it dies, the worker sees the
//! end and leaves. A worker that crashes is replaced, within a bound.

use crate::service::Shared;
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

/// Crashes of one local worker after which it is not replaced any more.
const MOST_CRASHES: u32 = 20;
/// Wait before a crashed worker is replaced, so that one that cannot start does not spin.
const RESTART_DELAY: Duration = Duration::from_millis(500);
/// Longest wait for a worker to leave once the coordinator is done; then it is killed.
const LEAVE_LIMIT: Duration = Duration::from_secs(5);

/// Local workers that cannot be started.
#[derive(Debug, Error)]
pub enum LocalError {
    /// The program is not there.
    #[error("{}: the worker program is not there; it belongs beside `runout` (build it with `cargo build --release`)", .0.display())]
    NoProgram(PathBuf),
    /// The system does not say where this program is.
    #[error("where `runout` itself is cannot be found out: {0}")]
    NoOwnPath(io::Error),
    /// Every worker has crashed too often.
    #[error("every local worker crashed {MOST_CRASHES} times; the last messages on stderr say why")]
    AllCrashed,
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

/// Keeps `count` workers running until each has left in order or crashed too often, or `stop` is set; then kills
/// what is left.
///
/// # Errors
/// All of them crashed too often.
pub async fn keep_running(
    program: PathBuf,
    url: String,
    spool: PathBuf,
    count: usize,
    shared: Weak<Shared>,
    stop: watch::Receiver<bool>,
) -> Result<(), LocalError> {
    let mut all = JoinSet::new();
    for number in 1..=count {
        let (program, url, spool) = (program.clone(), url.clone(), spool.clone());
        all.spawn(keep_one(program, url, spool, number, Weak::clone(&shared), stop.clone()));
    }
    let left_in_order = all.join_all().await;
    if left_in_order.contains(&true) { Ok(()) } else { Err(LocalError::AllCrashed) }
}

/// Returns whether the worker left in order.
async fn keep_one(
    program: PathBuf,
    url: String,
    spool: PathBuf,
    number: usize,
    shared: Weak<Shared>,
    mut stop: watch::Receiver<bool>,
) -> bool {
    for crashes in 0..MOST_CRASHES {
        let name = format!("local-{number}.{}", crashes + 1);
        let what = match start(&program, &url, &spool, &name) {
            Err(error) => format!("cannot be started: {error}"),
            Ok(mut child) => {
                // Waiting for a child closes its standard input, and that would tell it to leave.
                let lifeline = child.stdin.take();
                let ended = tokio::select! {
                    ended = child.wait() => Some(ended),
                    _ = stop.wait_for(|s| *s) => None,
                };
                match ended {
                    None => {
                        drop(lifeline);
                        end(child).await;
                        return true;
                    }
                    Some(Ok(status)) if status.success() && is_ending(&shared) => return true,
                    Some(Ok(status)) => format!("ended with {status}"),
                    Some(Err(error)) => format!("cannot be waited for: {error}"),
                }
            }
        };
        tracing::warn!("worker {name} {what}; it is replaced");
        if let Some(shared) = shared.upgrade() {
            let events = shared.engine().worker_died(&name);
            shared.handle(events);
        }
        tokio::select! {
            () = sleep(RESTART_DELAY) => {}
            _ = stop.wait_for(|s| *s) => return true,
        }
    }
    tracing::error!("local worker {number} crashed {MOST_CRASHES} times and is not replaced any more");
    false
}

fn start(program: &Path, url: &str, spool: &Path, name: &str) -> io::Result<Child> {
    Command::new(program)
        .args(["--coordinator", url, "--slots", "1", "--name", name, "--leave-with-parent", "--spool"])
        .arg(spool)
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
