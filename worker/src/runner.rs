//! The slots: each leases a realisation, computes it on a thread of its own, and hands the outcome on to be delivered
//! while it computes the next.

use crate::board::{Board, Held, Mode, reached};
use crate::client::{Client, ClientError, Introduction};
use crate::delivery::{Outgoing, broke, deliver_left_behind, give_back};
use crate::leave::Leave;
use crate::machine::machine;
use crate::options::Options;
use crate::spool::Spool;
use crate::{Prepare, Realise, heartbeat};
use runout_core::outcome::Outcome;
use runout_core::realisation::Cancelled;
use runout_proto::convert::encode_outcome;
use runout_proto::identity::{self, KernelError};
use runout_proto::logging;
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

/// Longest wait for a cancelled computation when the worker is leaving: the process ends its threads anyway.
const LEAVE_LIMIT: Duration = Duration::from_secs(1);
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
    /// A computation has not seen its cancellation, and holds its slot for ever.
    #[error(
        "realisation {index} was cancelled {limit:.0?} ago and has not ended: it holds a slot and a core for ever, so \
         this worker ends; start another one in its place"
    )]
    Stuck {
        /// Its index.
        index: u64,
        /// How long it was waited for.
        limit: Duration,
    },
}

/// What every slot works with.
pub(crate) struct Work {
    pub(crate) client: Client,
    pub(crate) board: Arc<Board>,
    leave: Leave,
    pub(crate) spool: Spool,
    realise: Realise,
    stuck_after: Duration,
    grace: Duration,
}

impl WorkerError {
    /// Whether another attempt would fare no better, so that nobody need make one.
    pub fn is_final(&self) -> bool {
        match self {
            WorkerError::Client(ClientError::GaveUp(..) | ClientError::NoAddress { .. }) => false,
            WorkerError::Spool { .. } | WorkerError::System(_) | WorkerError::Stuck { .. } => false,
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
    let way = options.way()?;
    let kernel = identity::kernel()?;
    let fingerprint = identity::fingerprint(kernel);
    let introduction = Introduction {
        name: options.name(),
        slots: options.slots(),
        build,
        fingerprint,
        machine: machine(kernel),
    };
    let leave = Leave::new(options.leave_after, options.idle_leave, options.grace);
    let url = tokio::select! {
        url = way.address.wait(options.give_up_after) => url,
        _ = interrupts.wait_for(|n| *n > 0) => return Ok(()),
    };
    let url = url.ok_or_else(|| ClientError::NoAddress {
        path: options.run_directory.clone().unwrap_or_default(),
        waited: options.give_up_after,
    })?;
    let client = Client::new(way.clone(), &url, introduction.clone(), options.give_up_after)?;
    let registration = tokio::select! {
        registration = client.register(Vec::new()) => registration?,
        _ = interrupts.wait_for(|n| *n > 0) => return Ok(()),
    };
    let (spec, digest) = (registration.spec.clone(), registration.digest.clone());
    // A worker knows the campaign by its spec alone.
    logging::belongs_to(&digest);
    let (name, slots) = (&introduction.name, introduction.slots);
    tracing::info!(worker = name, slots, "registered with {url} as {name}, {slots} slots");
    let board = Arc::new(Board::new(registration));
    let beating =
        heartbeat::start(way, url.clone(), introduction.clone(), options.give_up_after, Arc::clone(&board))?;
    let realise = prepare(spec, kernel, options.shared_threads()).map_err(WorkerError::Prepare)?;
    let spool = Spool::open(&options.spool(), &digest)
        .map_err(|error| WorkerError::Spool { path: options.spool(), error })?;
    let (stuck_after, grace) = (options.stuck_after, options.grace);
    let work = Arc::new(Work { client, board, leave, spool, realise, stuck_after, grace });

    let leaving = tokio::spawn(leave_when_asked(Arc::clone(&work), interrupts, options.grace));
    let mut slots = JoinSet::new();
    slots.spawn(deliver_left_behind(Arc::clone(&work)));
    for _ in 0..introduction.slots {
        slots.spawn(slot(Arc::clone(&work)));
    }
    let failed = slots.join_all().await.into_iter().find_map(Result::err);
    leaving.abort();
    work.board.raise(Mode::Stopping);
    let failure = work.board.failure().map(WorkerError::from).or(failed);
    if !matches!(failure, Some(WorkerError::Client(_))) {
        let worker_id = work.board.registration().worker_id;
        let leases = work.board.leases();
        work.client.release(ReleaseRequest { worker_id, leases, error: None, leaving: true }).await;
    }
    // The thread ends within one heartbeat's answer; an answer that never comes is no reason to stay.
    drop(beating);
    failure.map_or(Ok(()), Err)
}

async fn leave_when_asked(work: Arc<Work>, mut interrupts: watch::Receiver<u32>, grace: Duration) {
    let why = tokio::select! {
        asked = interrupts.wait_for(|n| *n > 0) => match asked {
            Ok(_) => "asked to leave",
            Err(_) => return,
        },
        why = work.leave.due(&work.board) => why,
    };
    tracing::info!("{why}: running realisations have {grace:.0?} to finish");
    work.board.raise(Mode::Draining);
    tokio::time::sleep(grace).await;
    work.board.raise(Mode::Stopping);
}

/// Leases and computes until there is nothing more to do. While one outcome is on its way the next realisation is leased
/// and begun; no second outcome is handed in before the first one has arrived, so that no more than one is on its way.
async fn slot(work: Arc<Work>) -> Result<(), WorkerError> {
    let mut outgoing = Outgoing::default();
    let ended = work_through(&work, &mut outgoing).await;
    outgoing.arrived().await?;
    if ended? == Ended::Finished {
        tracing::info!("nothing left to do");
        work.board.raise(Mode::Stopping);
    }
    Ok(())
}

/// Why a slot takes no more leases.
#[derive(PartialEq)]
enum Ended {
    /// The coordinator has nothing left to do.
    Finished,
    /// The worker leaves.
    Leaving,
}

async fn work_through(work: &Arc<Work>, outgoing: &mut Outgoing) -> Result<Ended, WorkerError> {
    let mut mode = work.board.mode();
    loop {
        if work.leave.is_too_late() {
            tracing::info!("what is left of the time is too short for another realisation");
            return Ok(Ended::Leaving);
        }
        let id = work.board.registration().worker_id;
        let reply = tokio::select! {
            biased;
            () = reached(&mut mode, Mode::Draining) => return Ok(Ended::Leaving),
            reply = work.client.lease(id) => reply?,
        };
        let Some(reply) = reply else {
            tokio::select! {
                renewed = work.board.renew(&work.client, id) => renewed?,
                () = reached(&mut mode, Mode::Draining) => return Ok(Ended::Leaving),
            }
            continue;
        };
        match (reply.kind(), reply.lease) {
            // The call may have been held open for long.
            (lease_reply::Kind::Assigned, Some(lease)) if work.leave.is_too_late() => {
                give_back(work, lease, None).await;
            }
            (lease_reply::Kind::Assigned, Some(lease)) => run_lease(work, lease, outgoing).await?,
            (lease_reply::Kind::Finished, _) => return Ok(Ended::Finished),
            (lease_reply::Kind::Draining, _) => {
                tokio::select! {
                    () = tokio::time::sleep(DRAINING_WAIT) => {}
                    () = reached(&mut mode, Mode::Draining) => return Ok(Ended::Leaving),
                }
            }
            _ => {}
        }
    }
}

async fn run_lease(work: &Arc<Work>, lease: LeaseRef, outgoing: &mut Outgoing) -> Result<(), WorkerError> {
    let held = work.board.take(lease);
    tracing::debug!(index = lease.index, attempt = lease.attempt, "realisation {} begins", lease.index);
    let (computed, wall) = compute(work, &held, lease.index).await;
    work.leave.note(wall);
    match computed {
        Computed::Outcome(outcome) => {
            held.reporting.store(true, Ordering::Relaxed);
            let report = ReportRequest {
                worker_id: 0,
                attempt: lease.attempt,
                spec_digest: work.board.registration().digest,
                outcome: Some(encode_outcome(&outcome)),
                wall_s: wall.as_secs_f64(),
            };
            outgoing.hand_in(work, lease, report).await?;
        }
        Computed::Cancelled => work.board.drop_lease(lease),
        Computed::Broken(message) => {
            work.board.drop_lease(lease);
            broke(work, lease, message).await;
        }
        Computed::Stuck => {
            work.board.drop_lease(lease);
            return stuck(work, lease.index);
        }
    }
    Ok(())
}

/// A computation that does not end takes its slot with it. Threads cannot be ended from outside, so the whole process
/// has to go: the other slots finish what they run, within the grace.
fn stuck(work: &Arc<Work>, index: u64) -> Result<(), WorkerError> {
    if *work.board.mode().borrow() == Mode::Stopping {
        return Ok(());
    }
    tracing::error!("realisation {index} does not end although it was cancelled: this worker leaves");
    work.board.raise(Mode::Draining);
    let others = Arc::clone(work);
    tokio::spawn(async move {
        tokio::time::sleep(others.grace).await;
        others.board.raise(Mode::Stopping);
    });
    Err(WorkerError::Stuck { index, limit: work.stuck_after })
}

enum Computed {
    Outcome(Box<Outcome>),
    Cancelled,
    Broken(String),
    /// It was cancelled and has not ended within the limit.
    Stuck,
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
        Ok(_) => tokio::select! {
            biased;
            ended = result => match ended {
                Ok(Ok(Ok(outcome))) => Computed::Outcome(Box::new(outcome)),
                Ok(Ok(Err(Cancelled))) => Computed::Cancelled,
                Ok(Err(panic)) => Computed::Broken(panic_message(panic.as_ref())),
                Err(_) => Computed::Broken("the computing thread ended without a result".to_owned()),
            },
            () = does_not_end(work, held) => Computed::Stuck,
        },
    };
    (computed, started.elapsed())
}

/// Returns when a computation has had its time to end after it was cancelled.
async fn does_not_end(work: &Work, held: &Held) {
    held.cancelled().await;
    let mut mode = work.board.mode();
    let leaving = async {
        reached(&mut mode, Mode::Stopping).await;
        tokio::time::sleep(LEAVE_LIMIT).await;
    };
    tokio::select! {
        () = tokio::time::sleep(work.stuck_after) => {}
        () = leaving => {}
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    format!("panic: {}", text.unwrap_or("without a message"))
}
