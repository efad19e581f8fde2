//! The gRPC service: check caller and message, call the engine, make durable, encode.

use crate::engine::{Step, Verdict};
use crate::events::What;
use crate::expected;
use crate::limits;
use crate::listen::{Notes, Right};
use crate::machine::Machine;
use crate::queue::{Event, Held, Lease, LeaseAnswer, Order, UnknownWorker};
use crate::seen::Answer;
use crate::shared::Shared;
use crate::writer::Job;
use admission::{admit, check_identity};
use runout_proto::convert::{self, DecodeError, readable};
use runout_proto::v1::coordinator_server::Coordinator;
use runout_proto::{LONGEST_POLL_S, v1};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tonic::{Request, Response};

mod admission;

/// Longest text of a peer's in a message, characters.
const SHOWN: usize = 500;

/// Refusals of calls.
static NOTES: Notes = Notes::new();

/// The service.
#[derive(Debug, Clone)]
pub struct Service {
    shared: Arc<Shared>,
}

impl Service {
    /// A service for what is shared.
    pub fn new(shared: Arc<Shared>) -> Service {
        Service { shared }
    }

    /// Notes something that a worker has done, by its name.
    fn note(&self, worker: u64, what: impl FnOnce(String) -> What) {
        let name = self.shared.engine().queue().worker(worker).map(|known| known.name.clone());
        // One that has just left has no name any more, and nothing to say.
        if let Some(name) = name {
            self.shared.writer().note(what(name));
        }
    }

    async fn lease_now(&self, worker: u64) -> Result<Option<v1::LeaseReply>, tonic::Status> {
        let (answer, to_write) = {
            let mut engine = self.shared.engine();
            let answer = engine.lease(worker, self.shared.now()).map_err(unknown)?;
            let to_write = match answer {
                LeaseAnswer::Assigned(lease) if !engine.queue().is_reserved(lease) => {
                    Some(Job::Attempts(lease.index, engine.queue().attempts(lease.index)))
                }
                _ => None,
            };
            (answer, to_write)
        };
        let reply = |kind, lease| Ok(Some(v1::LeaseReply { kind: kind as i32, lease }));
        match answer {
            LeaseAnswer::Wait => Ok(None),
            LeaseAnswer::Draining => reply(v1::lease_reply::Kind::Draining, None),
            LeaseAnswer::Finished => {
                self.shared.changed().notify_waiters();
                reply(v1::lease_reply::Kind::Finished, None)
            }
            LeaseAnswer::Assigned(lease) => {
                self.shared.reserve();
                if let Some(job) = to_write {
                    self.shared.writer().write(job).await?;
                }
                let Lease { index, attempt } = lease;
                self.note(worker, |worker| What::Leased { index, attempt, worker });
                reply(v1::lease_reply::Kind::Assigned, Some(encode_lease(lease)))
            }
        }
    }

    /// Takes a report: checked, decided, and durable where it is recorded.
    async fn take_report(&self, request: v1::ReportRequest) -> Result<Verdict, tonic::Status> {
        if request.spec_digest != self.shared.digest {
            return Err(tonic::Status::failed_precondition("the report is of another campaign"));
        }
        let outcome = convert::decode_outcome(request.outcome).map_err(invalid)?;
        expected::check(&self.shared.campaign.model, &outcome).map_err(tonic::Status::invalid_argument)?;
        let (index, attempt, wall_s) = (outcome.index, request.attempt, request.wall_s);
        let step = self
            .shared
            .engine()
            .report(request.worker_id, attempt, outcome, wall_s, self.shared.now())
            .map_err(unknown)?;
        let verdict = match step {
            Step::Answer(verdict) => {
                self.note(request.worker_id, |worker| match verdict {
                    Verdict::NotWanted => What::NotWanted { index, attempt, worker },
                    _ => What::Duplicate { index, attempt, worker },
                });
                self.shared.changed().notify_waiters();
                verdict
            }
            Step::Busy => return Err(tonic::Status::unavailable("the outcome is being stored: ask again")),
            Step::Store(entry, verdict) => {
                // The slot is free: a lease call that has overtaken the report need not wait for the disk.
                self.shared.changed().notify_waiters();
                let stored = tokio::spawn(Arc::clone(&self.shared).store(*entry));
                stored.await.map_err(|e| tonic::Status::internal(e.to_string()))??;
                verdict
            }
        };
        if verdict == Verdict::Conflict {
            tracing::error!(
                index,
                attempt,
                "realisation {index}: a second outcome has another digest; both are kept, and a third run by another \
                 worker decides"
            );
        }
        Ok(verdict)
    }
}

#[tonic::async_trait]
impl Coordinator for Service {
    async fn register(
        &self,
        request: Request<v1::RegisterRequest>,
    ) -> Result<Response<v1::RegisterReply>, tonic::Status> {
        let request = admit(request, Right::Work, "register").await?;
        check_identity(&request, &self.shared.fingerprint)
            .inspect_err(|_| self.shared.seen().refused_workers += 1)?;
        let v1::RegisterRequest { name, slots, held, machine, .. } = request;
        let held: Vec<Held> = held
            .into_iter()
            .map(|lease| Held { lease: decode_lease(lease), steps: 0, simulated_s: 0.0, reporting: false })
            .collect();
        let (worker_id, settings) = {
            let mut engine = self.shared.engine();
            if engine.queue().workers().count() >= limits::WORKERS {
                let most = limits::WORKERS;
                NOTES.say(&format!("worker {name} is not registered: {most} are already"));
                return Err(tonic::Status::resource_exhausted(format!(
                    "{most} workers are registered already"
                )));
            }
            let id = engine.register(&name, slots, &held, self.shared.now());
            (id, engine.queue().settings().clone())
        };
        tracing::info!(worker = name, slots, "worker {name} registered with {slots} slots");
        let (held, machine) = (held.len() as u64, machine.map(Machine::from));
        self.shared.writer().note(What::Registered { worker: name, slots, held, machine });
        self.shared.changed().notify_waiters();
        Ok(Response::new(v1::RegisterReply {
            worker_id,
            spec_json: self.shared.spec_json.clone(),
            heartbeat_s: settings.heartbeat.as_secs_f64(),
            lost_after_s: settings.lost_after().as_secs_f64(),
        }))
    }

    async fn lease(
        &self,
        request: Request<v1::LeaseRequest>,
    ) -> Result<Response<v1::LeaseReply>, tonic::Status> {
        let request = admit(request, Right::Work, "lease").await?;
        let poll = Duration::from_secs_f64(request.poll_s.min(LONGEST_POLL_S));
        let deadline = tokio::time::Instant::now() + poll;
        loop {
            let changed = self.shared.changed().notified();
            tokio::pin!(changed);
            // Enabled before the look at the engine, so that no change in between is missed.
            changed.as_mut().enable();
            if let Some(reply) = self.lease_now(request.worker_id).await? {
                return Ok(Response::new(reply));
            }
            if tokio::time::timeout_at(deadline, changed).await.is_err() {
                let kind = v1::lease_reply::Kind::Wait as i32;
                return Ok(Response::new(v1::LeaseReply { kind, lease: None }));
            }
        }
    }

    async fn heartbeat(
        &self,
        request: Request<v1::HeartbeatRequest>,
    ) -> Result<Response<v1::HeartbeatReply>, tonic::Status> {
        let request = admit(request, Right::Work, "heartbeat").await?;
        let held: Vec<Held> = request.running.iter().filter_map(decode_progress).collect();
        let (order, cancel, events) =
            self.shared.engine().heartbeat(request.worker_id, &held, self.shared.now()).map_err(unknown)?;
        for event in &events {
            if let Event::Hung { index } = *event {
                self.note(request.worker_id, |worker| What::Hung { index, worker });
            }
        }
        self.shared.handle(events);
        let order = match order {
            Order::Continue => v1::heartbeat_reply::Order::Continue,
            Order::Drain => v1::heartbeat_reply::Order::Drain,
            Order::Stop => v1::heartbeat_reply::Order::Stop,
        };
        let cancel = cancel.into_iter().map(encode_lease).collect();
        Ok(Response::new(v1::HeartbeatReply { order: order as i32, cancel }))
    }

    async fn report(
        &self,
        request: Request<v1::ReportRequest>,
    ) -> Result<Response<v1::ReportReply>, tonic::Status> {
        let started = Instant::now();
        let request = admit(request, Right::Work, "report").await?;
        let verdict = self.take_report(request).await;
        let answer = match verdict {
            Ok(Verdict::Recorded) => Answer::Recorded,
            Ok(Verdict::Duplicate) => Answer::Duplicate,
            Ok(Verdict::Conflict) => Answer::Conflict,
            Ok(Verdict::NotWanted) => Answer::NotWanted,
            Err(_) => Answer::Refused,
        };
        self.shared.seen().reported(answer, started.elapsed());
        let verdict = match verdict? {
            Verdict::Recorded => v1::report_reply::Verdict::Recorded,
            Verdict::Duplicate => v1::report_reply::Verdict::Duplicate,
            Verdict::Conflict => v1::report_reply::Verdict::Conflict,
            Verdict::NotWanted => v1::report_reply::Verdict::NotWanted,
        };
        Ok(Response::new(v1::ReportReply { verdict: verdict as i32 }))
    }

    async fn release(
        &self,
        request: Request<v1::ReleaseRequest>,
    ) -> Result<Response<v1::ReleaseReply>, tonic::Status> {
        let request = admit(request, Right::Work, "release").await?;
        let leases: Vec<Lease> = request.leases.iter().copied().map(decode_lease).collect();
        let error = request.error.as_ref().map(|error| {
            let error = readable(error, SHOWN);
            self.shared.seen().broken += 1;
            for Lease { index, attempt } in &leases {
                tracing::error!(index, attempt, "realisation {index} broke (attempt {attempt}): {error}");
            }
            error
        });
        for Lease { index, attempt } in leases.iter().copied() {
            let error = error.clone();
            self.note(request.worker_id, |worker| What::Released { index, attempt, worker, error });
        }
        if request.leaving {
            self.note(request.worker_id, |worker| What::Left { worker });
        }
        let events = self
            .shared
            .engine()
            .release(request.worker_id, &leases, request.error.is_some(), request.leaving, self.shared.now())
            .map_err(unknown)?;
        self.shared.handle(events);
        Ok(Response::new(v1::ReleaseReply {}))
    }

    async fn status(
        &self,
        request: Request<v1::StatusRequest>,
    ) -> Result<Response<v1::StatusReply>, tonic::Status> {
        admit(request, Right::Look, "status").await?;
        let status = self.shared.status();
        let json = serde_json::to_string(&status).expect("a status holds only numbers, words and lists");
        Ok(Response::new(v1::StatusReply { state: status.state.name().to_owned(), json }))
    }

    async fn cancel(
        &self,
        request: Request<v1::CancelRequest>,
    ) -> Result<Response<v1::CancelReply>, tonic::Status> {
        let request = admit(request, Right::Cancel, "cancel").await?;
        if request.spec_digest.is_some_and(|digest| digest != self.shared.digest) {
            return Err(tonic::Status::failed_precondition("this coordinator works on another campaign"));
        }
        let state = self.shared.status().state;
        self.shared.cancel();
        let grace_s = self.shared.grace.as_secs_f64();
        Ok(Response::new(v1::CancelReply { state: state.name().to_owned(), grace_s }))
    }
}

fn invalid(error: DecodeError) -> tonic::Status {
    tonic::Status::invalid_argument(error.to_string())
}

fn unknown(error: UnknownWorker) -> tonic::Status {
    tonic::Status::not_found(error.to_string())
}

fn encode_lease(lease: Lease) -> v1::LeaseRef {
    v1::LeaseRef { index: lease.index, attempt: lease.attempt }
}

fn decode_lease(lease: v1::LeaseRef) -> Lease {
    Lease { index: lease.index, attempt: lease.attempt }
}

/// A progress that was checked names its lease.
fn decode_progress(progress: &v1::LeaseProgress) -> Option<Held> {
    Some(Held {
        lease: decode_lease(progress.lease?),
        steps: progress.steps,
        simulated_s: progress.simulated_s,
        reporting: progress.reporting,
    })
}
