//! Outcomes on their way to the coordinator: spooled, reported until they are acknowledged, forgotten.

use crate::board::{Mode, reached};
use crate::client::ClientError;
use crate::runner::{Work, WorkerError};
use runout_proto::v1::report_reply::Verdict;
use runout_proto::v1::{LeaseRef, ReleaseRequest, ReportRequest};
use std::sync::Arc;
use tokio::task::JoinHandle;

/// The outcome of a slot that is on its way, if there is one.
#[derive(Default)]
pub(crate) struct Outgoing(Option<JoinHandle<Result<(), WorkerError>>>);

impl Outgoing {
    /// Hands in an outcome when the one before has arrived; returns when this one is on its way.
    ///
    /// # Errors
    /// The one before could not be delivered.
    pub(crate) async fn hand_in(
        &mut self,
        work: &Arc<Work>,
        lease: LeaseRef,
        report: ReportRequest,
    ) -> Result<(), WorkerError> {
        self.arrived().await?;
        self.0 = Some(tokio::spawn(report_lease(Arc::clone(work), lease, report)));
        // The report shall set out before the slot asks for another lease: the coordinator gives a worker no more leases
        // than it has slots.
        tokio::task::yield_now().await;
        Ok(())
    }

    /// Waits until nothing is on its way.
    ///
    /// # Errors
    /// The outcome could not be delivered.
    pub(crate) async fn arrived(&mut self) -> Result<(), WorkerError> {
        match self.0.take() {
            // A panic goes on where the slot is waited for.
            Some(outgoing) => outgoing.await.unwrap_or_else(|e| std::panic::resume_unwind(e.into_panic())),
            None => Ok(()),
        }
    }
}

async fn report_lease(work: Arc<Work>, lease: LeaseRef, report: ReportRequest) -> Result<(), WorkerError> {
    let refused = match report_until_acknowledged(&work, report).await {
        Err(ClientError::Refused(why)) => Some(format!("the outcome was refused: {why}")),
        other => {
            other?;
            None
        }
    };
    work.board.drop_lease(lease);
    if let Some(message) = refused {
        broke(&work, lease, message).await;
    }
    Ok(())
}

/// Gives back a lease whose realisation has no outcome for this reason.
pub(crate) async fn broke(work: &Work, lease: LeaseRef, message: String) {
    let (index, attempt) = (lease.index, lease.attempt);
    tracing::error!(index, attempt, "realisation {index} broke: {message}");
    give_back(work, lease, Some(message)).await;
}

/// Gives back a lease; `error` says how it broke.
pub(crate) async fn give_back(work: &Work, lease: LeaseRef, error: Option<String>) {
    let worker_id = work.board.registration().worker_id;
    work.client.release(ReleaseRequest { worker_id, leases: vec![lease], error, leaving: false }).await;
}

/// Delivers what an earlier process with the same spool left behind.
pub(crate) async fn deliver_left_behind(work: Arc<Work>) -> Result<(), WorkerError> {
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
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// Reports an outcome until it is acknowledged. It is spooled meanwhile, since both wait for a disk.
async fn report_until_acknowledged(work: &Arc<Work>, report: ReportRequest) -> Result<(), ClientError> {
    let (spool, spooled) = (work.spool.clone(), report.clone());
    let spooling = tokio::task::spawn_blocking(move || spool.keep(&spooled));
    let keep = async {
        let kept = spooling.await.unwrap_or_else(|panic| Err(panic.into()));
        kept.inspect_err(|error| {
            tracing::warn!("the outcome is not spooled and lives in memory only: {error}");
        })
    };
    let (delivered, kept) = tokio::join!(deliver(work, report), keep);
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
                let attempt = report.attempt;
                tracing::error!(index, attempt, "realisation {index}: another worker got other bits");
                return Ok(true);
            }
            Some(verdict) => {
                tracing::debug!("realisation {index}, attempt {}: {}", report.attempt, verdict.as_str_name());
                return Ok(true);
            }
            None => tokio::select! {
                renewed = work.board.renew(&work.client, id) => renewed?,
                () = reached(&mut mode, Mode::Stopping) => return Ok(false),
            },
        }
    }
}
