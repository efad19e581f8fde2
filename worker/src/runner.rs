//! The slots: each leases a realisation, computes it on a thread of its own, spools the outcome, and reports it
//! until it is acknowledged.

use crate::board::{Board, Held, Mode, reached};
use crate::client::{Client, ClientError, Introduction};
use crate::options::Options;
use crate::spool::Spool;
use crate::{Prepare, Realise, heartbeat};
use runout_core::outcome::Outcome;
use runout_core::realisation::Cancelled;
use runout_proto::convert::encode_outcome;
use runout_proto::identity::{self, KernelError};
use runout_proto::v1::report_reply::Verdict;
use runout_proto::v1::{LeaseRef, ReleaseRequest, ReportRequest, lease_reply};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};
use thiserror::Error;
use tokio::sync::{oneshot, watch};
use tokio::task::JoinSet;

/// Wait before a draining coordinator is asked again: it is about to go.
const DRAINING_WAIT: Duration = Duration::from_secs(1);

/// A worker that cannot work.
#[derive(Debug, Error)]
pub enum WorkerError {
    /// No coordinator to work for.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The kernel that the environment asks for cannot be used.
    #[error(transparent)]
    Kernel(#[from] KernelError),
    /// The campaign cannot be prepared.
    #[error("the campaign cannot be run: {0}")]
    Prepare(String),
    /// The spool cannot be used.
    #[error("--spool {}: {error}", path.display())]
    Spool {
        /// Its folder.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The system refuses a thread.
    #[error("the system refuses a thread: {0}")]
    System(#[from] io::Error),
}

/// What every slot works with.
struct Work {
    client: Client,
    board: Arc<Board>,
    spool: Spool,
    realise: Realise,
}

impl WorkerError {
    /// Whether another attempt would fare no better, so that nobody need make one.
    pub fn is_final(&self) -> bool {
        match self {
            WorkerError::Client(ClientError::GaveUp(..)) | WorkerError::Spool { .. } => false,
            WorkerError::System(_) => false,
            WorkerError::Client(_) | WorkerError::Prepare(_) | WorkerError::Kernel(_) => true,
        }
    }
}

/// Works until the campaign is over, or `interrupts` counts one: what runs then gets `options.grace` to finish.
/// `build` is the identity to register with.
///
/// # Errors
/// The coordinator refuses the worker or stays away too long, or the system refuses something.
pub async fn run(
    options: &Options,
    prepare: Prepare,
    build: String,
    mut interrupts: watch::Receiver<u32>,
) -> Result<(), WorkerError> {
    let endpoint = options.endpoint()?;
    let kernel = identity::kernel()?;
    let fingerprint = identity::fingerprint(kernel);
    let introduction = Introduction { name: options.name(), slots: options.slots(), build, fingerprint };
    let client = Client::new(endpoint.clone(), introduction.clone(), options.give_up_after);
    let registration = tokio::select! {
        registration = client.register(Vec::new()) => registration?,
        _ = interrupts.wait_for(|n| *n > 0) => return Ok(()),
    };
    tracing::info!("registered with {} as {}", options.coordinator, introduction.name);
    let (spec, digest) = (registration.spec.clone(), registration.digest.clone());
    let board = Arc::new(Board::new(registration));
    let beating =
        heartbeat::start(endpoint, introduction.clone(), options.give_up_after, Arc::clone(&board))?;
    let realise = prepare(spec, kernel).map_err(WorkerError::Prepare)?;
    let spool = Spool::open(&options.spool(), &digest)
        .map_err(|error| WorkerError::Spool { path: options.spool(), error })?;
    let work = Arc::new(Work { client, board, spool, realise });

    let leaving = tokio::spawn(leave_when_asked(Arc::clone(&work), interrupts, options.grace));
    let mut slots = JoinSet::new();
    slots.spawn(deliver_left_behind(Arc::clone(&work)));
    for _ in 0..introduction.slots {
        slots.spawn(slot(Arc::clone(&work)));
    }
    for ended in slots.join_all().await {
        if let Err(error) = ended {
            work.board.fail(error);
        }
    }
    leaving.abort();
    work.board.raise(Mode::Stopping);
    let failure = work.board.failure();
    if failure.is_none() {
        let worker_id = work.board.registration().worker_id;
        let leases = work.board.leases();
        work.client.release(ReleaseRequest { worker_id, leases, error: None, leaving: true }).await;
    }
    // The thread ends within one heartbeat's answer; an answer that never comes is no reason to stay.
    drop(beating);
    failure.map_or(Ok(()), |error| Err(error.into()))
}

async fn leave_when_asked(work: Arc<Work>, mut interrupts: watch::Receiver<u32>, grace: Duration) {
    if interrupts.wait_for(|n| *n > 0).await.is_ok() {
        tracing::info!("asked to leave: running realisations have {grace:.0?} to finish");
        work.board.raise(Mode::Draining);
        tokio::time::sleep(grace).await;
        work.board.raise(Mode::Stopping);
    }
}

/// Delivers what an earlier process with the same spool left behind.
async fn deliver_left_behind(work: Arc<Work>) -> Result<(), ClientError> {
    let reports = work.spool.left_behind().unwrap_or_else(|error| {
        tracing::warn!("the spool cannot be read: {error}");
        Vec::new()
    });
    if !reports.is_empty() {
        tracing::info!("delivering {} outcomes that an earlier worker left behind", reports.len());
    }
    for (path, report) in reports {
        match deliver(&work, report).await {
            Ok(true) => work.spool.forget(&path),
            Ok(false) => return Ok(()),
            Err(ClientError::Refused(why)) => {
                tracing::warn!("an outcome left behind is refused: {why}");
                work.spool.forget(&path);
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

async fn slot(work: Arc<Work>) -> Result<(), ClientError> {
    let mut mode = work.board.mode();
    loop {
        let id = work.board.registration().worker_id;
        let reply = tokio::select! {
            biased;
            () = reached(&mut mode, Mode::Draining) => return Ok(()),
            reply = work.client.lease(id) => reply?,
        };
        let Some(reply) = reply else {
            tokio::select! {
                renewed = work.board.renew(&work.client, id) => renewed?,
                () = reached(&mut mode, Mode::Draining) => return Ok(()),
            }
            continue;
        };
        match (reply.kind(), reply.lease) {
            (lease_reply::Kind::Assigned, Some(lease)) => run_lease(&work, lease).await?,
            (lease_reply::Kind::Finished, _) => {
                tracing::info!("nothing left to do");
                work.board.raise(Mode::Stopping);
                return Ok(());
            }
            (lease_reply::Kind::Draining, _) => {
                tokio::select! {
                    () = tokio::time::sleep(DRAINING_WAIT) => {}
                    () = reached(&mut mode, Mode::Draining) => return Ok(()),
                }
            }
            _ => {}
        }
    }
}

async fn run_lease(work: &Arc<Work>, lease: LeaseRef) -> Result<(), ClientError> {
    let held = work.board.take(lease);
    let (computed, wall) = compute(work, &held, lease.index).await;
    let broken = match computed {
        Computed::Outcome(outcome) => {
            held.reporting.store(true, Ordering::Relaxed);
            let report = ReportRequest {
                worker_id: 0,
                attempt: lease.attempt,
                spec_digest: work.board.registration().digest,
                outcome: Some(encode_outcome(&outcome)),
                wall_s: wall.as_secs_f64(),
            };
            match report_until_acknowledged(work, report).await {
                Err(ClientError::Refused(why)) => Some(format!("the outcome was refused: {why}")),
                other => {
                    other?;
                    None
                }
            }
        }
        Computed::Cancelled => None,
        Computed::Broken(message) => Some(message),
    };
    work.board.drop_lease(lease);
    if let Some(message) = broken {
        tracing::error!("realisation {} broke: {message}", lease.index);
        let worker_id = work.board.registration().worker_id;
        let request = ReleaseRequest { worker_id, leases: vec![lease], error: Some(message), leaving: false };
        work.client.release(request).await;
    }
    Ok(())
}

enum Computed {
    Outcome(Outcome),
    Cancelled,
    Broken(String),
}

/// Computes on a thread of its own, so that neither runtime is held up.
async fn compute(work: &Arc<Work>, held: &Arc<Held>, index: u64) -> (Computed, Duration) {
    let (done, result) = oneshot::channel();
    let (worker, progress) = (Arc::clone(work), Arc::clone(held));
    let started = Instant::now();
    let spawned = thread::Builder::new().name(format!("realisation {index}")).spawn(move || {
        let computed = catch_unwind(AssertUnwindSafe(|| (worker.realise)(index, &progress.progress)));
        // Nobody waits for it any more if the worker is stopping.
        let _ = done.send(computed);
    });
    let computed = match spawned {
        Err(error) => Computed::Broken(format!("the system refuses a thread: {error}")),
        Ok(_) => match result.await {
            Ok(Ok(Ok(outcome))) => Computed::Outcome(outcome),
            Ok(Ok(Err(Cancelled))) => Computed::Cancelled,
            Ok(Err(panic)) => Computed::Broken(panic_message(panic.as_ref())),
            Err(_) => Computed::Broken("the computing thread ended without a result".to_owned()),
        },
    };
    (computed, started.elapsed())
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    format!("panic: {}", text.unwrap_or("without a message"))
}

async fn report_until_acknowledged(work: &Arc<Work>, report: ReportRequest) -> Result<(), ClientError> {
    let kept = work.spool.keep(&report);
    if let Err(error) = &kept {
        tracing::warn!("the outcome is not spooled and lives in memory only: {error}");
    }
    let delivered = deliver(work, report).await;
    let settled = matches!(delivered, Ok(true) | Err(ClientError::Refused(_)));
    if let (true, Ok(path)) = (settled, kept) {
        work.spool.forget(&path);
    }
    delivered.map(|_| ())
}

/// Delivers a report; false if the worker had to stop before it was acknowledged.
async fn deliver(work: &Arc<Work>, mut report: ReportRequest) -> Result<bool, ClientError> {
    let mut mode = work.board.mode();
    let index = report.outcome.as_ref().map_or(0, |o| o.index);
    loop {
        let id = work.board.registration().worker_id;
        report.worker_id = id;
        let reply = tokio::select! {
            biased;
            reply = work.client.report(&report) => reply?,
            () = reached(&mut mode, Mode::Stopping) => return Ok(false),
        };
        match reply.map(|r| r.verdict()) {
            Some(Verdict::Conflict) => {
                tracing::error!("realisation {index}: another worker got other bits");
                return Ok(true);
            }
            Some(_) => return Ok(true),
            None => tokio::select! {
                renewed = work.board.renew(&work.client, id) => renewed?,
                () = reached(&mut mode, Mode::Stopping) => return Ok(false),
            },
        }
    }
}
