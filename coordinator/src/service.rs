//! The gRPC service: check caller and message, call the engine, make durable, encode.
//!
//! What must happen once it has begun (storing an outcome, noting that it is stored) runs in a task of its own,
//! so that a client that hangs up in the middle leaves nothing half done.

use crate::engine::{Engine, Step, Verdict, poison};
use crate::events::What;
use crate::limits;
use crate::listen::{Caller, Notes, Right};
use crate::queue::{Attempts, Event, Held, Lease, LeaseAnswer, Order, UnknownWorker};
use crate::status::{self, Status};
use crate::store::log::Entry;
use crate::tally::{Answer, Tally};
use crate::writer::{Job, Writer};
use runout_core::campaign::Campaign;
use runout_proto::check::Check;
use runout_proto::convert::{self, DecodeError, readable};
use runout_proto::v1::coordinator_server::Coordinator;
use runout_proto::{LONGEST_POLL_S, identity, v1};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use tokio::sync::Notify;
use tonic::{Request, Response};

/// Longest text of a peer's in a message, characters.
const SHOWN: usize = 500;

/// Refusals of calls.
static NOTES: Notes = Notes::new();

/// What all calls share.
#[derive(Debug)]
pub struct Shared {
    /// The campaign.
    pub campaign: Campaign,
    /// Digest of its spec.
    pub digest: String,
    spec_json: String,
    /// What this machine computes: see [`identity::fingerprint`].
    fingerprint: String,
    engine: Mutex<Engine>,
    tally: Mutex<Tally>,
    /// Woken whenever a waiting worker might get another answer, or the campaign may be over.
    changed: Notify,
    writer: Writer,
    started: Instant,
    /// Longest time that running realisations get once the campaign is cancelled.
    grace: Duration,
    cancelled: AtomicBool,
}

impl Shared {
    /// What all calls share, at the start.
    pub fn new(
        campaign: Campaign,
        spec_json: String,
        digest: String,
        fingerprint: String,
        engine: Engine,
        writer: Writer,
        grace: Duration,
    ) -> Shared {
        let tally = Mutex::new(Tally::new(campaign.model.sample.measure));
        Shared {
            campaign,
            digest,
            spec_json,
            fingerprint,
            engine: Mutex::new(engine),
            tally,
            changed: Notify::new(),
            writer,
            started: Instant::now(),
            grace,
            cancelled: AtomicBool::new(false),
        }
    }

    /// Whether an operator has cancelled the campaign.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// The engine, locked: never across an await.
    pub fn engine(&self) -> MutexGuard<'_, Engine> {
        self.engine.lock().expect("nobody panics with the engine locked")
    }

    /// What was seen, for the live page; never locked while the engine is asked for.
    pub fn tally(&self) -> MutexGuard<'_, Tally> {
        self.tally.lock().expect("nobody panics with the tally locked")
    }

    /// Time since the start: the queue's `now`.
    pub fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// Woken after every change that may matter to somebody who waits.
    pub fn changed(&self) -> &Notify {
        &self.changed
    }

    /// The thread that makes things durable.
    pub fn writer(&self) -> &Writer {
        &self.writer
    }

    /// Where the campaign stands.
    pub fn status(&self) -> Status {
        status::of_engine(&self.campaign, &self.digest, &self.engine(), self.now())
    }

    /// Deals with what happened by itself.
    pub fn handle(self: &Arc<Self>, events: Vec<Event>) {
        for event in events {
            self.tally().happened(&event);
            match event {
                Event::WorkerLost { name } => {
                    tracing::warn!(worker = name, "worker {name} is lost");
                    self.writer.note(What::WorkerLost { worker: name });
                }
                Event::Hung { index } => {
                    tracing::warn!(
                        index,
                        "realisation {index} takes no more steps: its worker is told to end it"
                    );
                }
                Event::SetAside { name, doubtful } => tracing::error!(
                    worker = name,
                    "worker {name} computes other bits than others and is set aside; {doubtful} of its outcomes are run \
                     again"
                ),
                Event::Corrected { index, .. } => {
                    tracing::warn!(
                        index,
                        "realisation {index}: the outcome recorded first was wrong; another counts now"
                    );
                }
                Event::Poisoned { index } => {
                    tracing::error!(
                        index,
                        "realisation {index} took several workers down: recorded as poison"
                    );
                    self.writer.note(What::Poisoned { index });
                    let shared = Arc::clone(self);
                    tokio::spawn(async move { shared.store(poison(index)).await });
                }
            }
        }
        self.changed.notify_waiters();
    }

    /// Makes an entry durable and tells the engine.
    async fn store(self: Arc<Self>, entry: Entry) -> Result<(), tonic::Status> {
        self.writer.write(Job::Entry(Box::new(entry.clone()))).await?;
        let events = self.engine().stored(&entry);
        self.writer.note(What::from(&entry));
        if let Entry::Outcome(record) = &entry {
            let (index, attempt, worker) = (record.outcome.index, record.attempt, &record.worker);
            tracing::debug!(worker, index, attempt, "realisation {index} is recorded");
            self.tally().recorded(record);
        }
        self.handle(events);
        Ok(())
    }
}

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
        let named = |engine: &Engine| {
            engine.queue().workers().find(|(id, _)| *id == worker).map(|(_, known)| known.name.clone())
        };
        let name = named(&self.shared.engine());
        // One that has just left has no name any more, and nothing to say.
        if let Some(name) = name {
            self.shared.writer.note(what(name));
        }
    }

    async fn lease_now(&self, worker: u64) -> Result<Option<v1::LeaseReply>, tonic::Status> {
        let (answer, attempts) = {
            let mut engine = self.shared.engine();
            let answer = engine.lease(worker, self.shared.now()).map_err(unknown)?;
            let attempts = match answer {
                LeaseAnswer::Assigned(lease) => engine.queue().attempts(lease.index),
                _ => Attempts::default(),
            };
            (answer, attempts)
        };
        let reply = |kind, lease| Ok(Some(v1::LeaseReply { kind: kind as i32, lease }));
        match answer {
            LeaseAnswer::Wait => Ok(None),
            LeaseAnswer::Draining => reply(v1::lease_reply::Kind::Draining, None),
            LeaseAnswer::Finished => {
                self.shared.changed.notify_waiters();
                reply(v1::lease_reply::Kind::Finished, None)
            }
            LeaseAnswer::Assigned(lease) => {
                self.shared.writer.write(Job::Attempts(lease.index, attempts)).await?;
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
                verdict
            }
            Step::Busy => return Err(tonic::Status::unavailable("the outcome is being stored: ask again")),
            Step::Store(entry, verdict) => {
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
        self.shared.changed.notify_waiters();
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
            .inspect_err(|_| self.shared.tally().refused_workers += 1)?;
        let v1::RegisterRequest { name, slots, held, .. } = request;
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
        self.shared.writer.note(What::Registered { worker: name, slots, held: held.len() as u64 });
        self.shared.changed.notify_waiters();
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
            let changed = self.shared.changed.notified();
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
        self.shared.tally().reported(answer, started.elapsed());
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
            self.shared.tally().broken += 1;
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
        if !self.shared.cancelled.swap(true, Ordering::Relaxed) {
            tracing::info!("cancelled by an operator");
        }
        self.shared.changed.notify_waiters();
        let grace_s = self.shared.grace.as_secs_f64();
        Ok(Response::new(v1::CancelReply { state: state.name().to_owned(), grace_s }))
    }
}

/// The message of a call, if the caller may make it and the message keeps to the contract. Waits while the caller
/// calls more often than it may.
async fn admit<M: Check>(request: Request<M>, right: Right, call: &str) -> Result<M, tonic::Status> {
    let caller = request.extensions().get::<Arc<Caller>>().cloned();
    let caller = caller.ok_or_else(|| tonic::Status::internal("the caller is not known"))?;
    caller.pace().await;
    caller.may(right).map_err(|why| {
        NOTES.say(&format!("{call} from {} refused: {why}", caller.peer()));
        tonic::Status::permission_denied(why)
    })?;
    let message = request.into_inner();
    message.check().map_err(invalid)?;
    Ok(message)
}

fn check_identity(request: &v1::RegisterRequest, fingerprint: &str) -> Result<(), tonic::Status> {
    let expected = (identity::PROTOCOL, identity::build(), fingerprint);
    let differs = |what: &str, here: &dyn std::fmt::Display, there: &dyn std::fmt::Display, advice: &str| {
        let there = readable(&there.to_string(), SHOWN);
        Err(tonic::Status::failed_precondition(format!(
            "the worker's {what} is {there}, the coordinator's is {here}: {advice}"
        )))
    };
    if request.protocol != expected.0 {
        return differs("protocol", &expected.0, &request.protocol, "run both from the same version");
    }
    if request.build != expected.1 {
        return differs("build", &expected.1, &request.build, "run both from the same version");
    }
    if request.fingerprint != expected.2 {
        let advice = "this machine computes other bits, so its outcomes would not be reproducible";
        return differs("fingerprint", &expected.2, &request.fingerprint, advice);
    }
    Ok(())
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
