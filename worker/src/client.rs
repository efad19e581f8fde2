//! The only gRPC of the worker: every call is retried with jittered back-off, registration is renewed when the
//! coordinator does not know the worker (any more), and a coordinator that stays away too long is given up.

use crate::address::Way;
use runout_core::spec::{Spec, SpecError};
use runout_proto::check::Check;
use runout_proto::convert::{DecodeError, readable};
use runout_proto::tls::{EndpointError, TlsError, refusal};
use runout_proto::v1::coordinator_client::CoordinatorClient;
use runout_proto::v1::{
    HeartbeatReply, HeartbeatRequest, LeaseProgress, LeaseRef, LeaseReply, LeaseRequest, Machine,
    RegisterRequest, ReleaseRequest, ReportReply, ReportRequest,
};
use runout_proto::{LONGEST_POLL_S, MESSAGE_LIMIT_BYTES, identity};
use std::hash::{BuildHasher, RandomState};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};
use thiserror::Error;
use tonic::transport::Channel;
use tonic::{Code, Status};

/// First wait before a call is repeated; doubled each time.
const FIRST_WAIT: Duration = Duration::from_millis(100);
/// Longest wait: a restarted coordinator is found again within this.
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// Silence of the coordinator after which the log says so, and again as often.
const SILENCE: Duration = Duration::from_secs(5);
const CONNECT_LIMIT: Duration = Duration::from_secs(5);
/// Longer than a lease call is held open.
const CALL_LIMIT: Duration = Duration::from_secs(30);
/// Longest message of the coordinator's that is shown, characters.
const SHOWN: usize = 500;

/// A coordinator that cannot be worked for.
#[derive(Debug, Error)]
pub enum ClientError {
    /// A URL that leads nowhere.
    #[error("--coordinator {url}: {error}")]
    Url {
        /// What was given.
        url: String,
        /// Why it leads nowhere.
        error: EndpointError,
    },
    /// The certificates cannot be used.
    #[error(transparent)]
    Credentials(#[from] TlsError),
    /// Coordinator and worker do not trust each other.
    #[error("no connection to the coordinator: {0}")]
    Untrusted(String),
    /// Its answer breaks the contract.
    #[error("the coordinator's answer cannot be understood: {0}")]
    Answer(#[from] DecodeError),
    /// It has not answered for too long.
    #[error("the coordinator has not answered for {0:.0?}; the last failure: {1}")]
    GaveUp(Duration, String),
    /// Nobody has written its address.
    #[error("{}: no coordinator has written its address to coordinator.addr for {waited:.0?}", path.display())]
    NoAddress {
        /// The run directory.
        path: PathBuf,
        /// How long it was waited for.
        waited: Duration,
    },
    /// It does not want this worker, or not this call.
    #[error("the coordinator refuses: {0}")]
    Refused(String),
    /// Its spec is none.
    #[error("the coordinator's campaign: {0}")]
    Spec(#[from] SpecError),
    /// It has another campaign now.
    #[error("the coordinator has another campaign now")]
    OtherCampaign,
}

/// What registration gave.
#[derive(Debug, Clone)]
pub struct Registration {
    /// The worker's id.
    pub worker_id: u64,
    /// The campaign's spec.
    pub spec: Spec,
    /// Its digest.
    pub digest: String,
    /// Time between heartbeats.
    pub heartbeat: Duration,
}

/// How the worker introduces itself.
#[derive(Debug, Clone)]
pub struct Introduction {
    /// Name.
    pub name: String,
    /// Slots.
    pub slots: u32,
    /// Build identity; see [`identity::build`].
    pub build: String,
    /// What this machine computes; see [`identity::fingerprint`].
    pub fingerprint: String,
    /// What this machine is.
    pub machine: Machine,
}

/// A connection. Heartbeat and slots have one each, and share the registration.
#[derive(Debug)]
pub struct Client {
    way: Way,
    connection: Mutex<Connection>,
    introduction: Introduction,
    give_up_after: Duration,
    heard: Mutex<Heard>,
}

/// What was heard of the coordinator.
#[derive(Debug, Clone, Copy)]
struct Heard {
    /// When last; since when there is a client, if never.
    last: Instant,
    /// Whether ever.
    ever: bool,
}

/// Where calls go.
#[derive(Debug)]
struct Connection {
    url: String,
    grpc: CoordinatorClient<Channel>,
}

impl Connection {
    /// To the coordinator at `url`; connects with the first call. Needs a runtime around it.
    fn new(way: &Way, url: &str) -> Result<Connection, ClientError> {
        let endpoint = way.endpoint(url)?;
        let channel = endpoint
            .connect_timeout(CONNECT_LIMIT)
            .timeout(CALL_LIMIT)
            .tcp_nodelay(true)
            .http2_keep_alive_interval(Duration::from_secs(10))
            .keep_alive_timeout(Duration::from_secs(10))
            .connect_lazy();
        let grpc = CoordinatorClient::new(channel)
            .max_decoding_message_size(MESSAGE_LIMIT_BYTES)
            .max_encoding_message_size(MESSAGE_LIMIT_BYTES);
        Ok(Connection { url: url.to_owned(), grpc })
    }
}

impl Client {
    /// A client for the coordinator that `way` leads to, now at `url`; connects with the first call. Needs a runtime
    /// around it.
    ///
    /// # Errors
    /// Not a URL, or not one for the worker's certificates.
    pub fn new(
        way: Way,
        url: &str,
        introduction: Introduction,
        give_up_after: Duration,
    ) -> Result<Client, ClientError> {
        let connection = Mutex::new(Connection::new(&way, url)?);
        let heard = Mutex::new(Heard { last: Instant::now(), ever: false });
        Ok(Client { way, connection, introduction, give_up_after, heard })
    }

    /// Registers, with the leases that the worker still holds.
    ///
    /// # Errors
    /// The coordinator refuses this build or machine, stays away, or sends no spec.
    pub async fn register(&self, held: Vec<LeaseRef>) -> Result<Registration, ClientError> {
        let request = RegisterRequest {
            protocol: identity::PROTOCOL,
            build: self.introduction.build.clone(),
            fingerprint: self.introduction.fingerprint.clone(),
            name: self.introduction.name.clone(),
            slots: self.introduction.slots,
            held,
            machine: Some(self.introduction.machine.clone()),
        };
        let reply = self
            .retried(|mut grpc| {
                let request = request.clone();
                async move { grpc.register(request).await }
            })
            .await?
            .ok_or_else(|| ClientError::Refused("it does not register workers".to_owned()))?;
        let spec = Spec::from_json(&reply.spec_json)?;
        let digest = spec.digest();
        // A period that is next to nothing would be a busy loop.
        let heartbeat = Duration::from_secs_f64(reply.heartbeat_s.max(0.01));
        Ok(Registration { worker_id: reply.worker_id, spec, digest, heartbeat })
    }

    /// Asks for a lease. `None`: not registered any more.
    ///
    /// # Errors
    /// The coordinator stays away or refuses.
    pub async fn lease(&self, worker_id: u64) -> Result<Option<LeaseReply>, ClientError> {
        let request = LeaseRequest { worker_id, poll_s: LONGEST_POLL_S };
        self.retried(|mut grpc| async move { grpc.lease(request).await }).await
    }

    /// Reports an outcome. `None`: not registered any more.
    ///
    /// # Errors
    /// The coordinator stays away or refuses.
    pub async fn report(&self, report: &ReportRequest) -> Result<Option<ReportReply>, ClientError> {
        self.retried(|mut grpc| {
            let report = report.clone();
            async move { grpc.report(report).await }
        })
        .await
    }

    /// Sends one heartbeat; not retried, the next one comes soon. `Ok(None)`: not registered any more.
    ///
    /// # Errors
    /// The coordinator did not answer.
    pub async fn heartbeat(
        &self,
        worker_id: u64,
        running: Vec<LeaseProgress>,
        limit: Duration,
    ) -> Result<Option<HeartbeatReply>, Status> {
        let mut grpc = self.grpc();
        let call = grpc.heartbeat(HeartbeatRequest { worker_id, running });
        let status = match tokio::time::timeout(limit, call).await {
            Err(_) => Status::deadline_exceeded("no answer to the heartbeat"),
            Ok(Ok(reply)) => {
                let reply = reply.into_inner();
                reply.check().map_err(|error| Status::internal(error.to_string()))?;
                return Ok(Some(reply));
            }
            Ok(Err(status)) if status.code() == Code::NotFound => return Ok(None),
            Ok(Err(status)) => status,
        };
        self.follow();
        Err(status)
    }

    /// Gives leases back, once: what does not arrive is noticed by the missing heartbeats.
    pub async fn release(&self, request: ReleaseRequest) {
        let mut grpc = self.grpc();
        match tokio::time::timeout(CONNECT_LIMIT, grpc.release(request)).await {
            Ok(Ok(_)) => {}
            Ok(Err(status)) => tracing::debug!("release: {}", status.message()),
            Err(_) => tracing::debug!("release: no answer"),
        }
    }

    fn grpc(&self) -> CoordinatorClient<Channel> {
        self.connection.lock().expect("nobody panics with it locked").grpc.clone()
    }

    /// After a failure: turns to the coordinator's new address if it has moved.
    fn follow(&self) {
        let Some(url) = self.way.address.now() else { return };
        let mut connection = self.connection.lock().expect("nobody panics with it locked");
        if url == connection.url {
            return;
        }
        match Connection::new(&self.way, &url) {
            Ok(new) => {
                tracing::info!("the coordinator has moved to {url}");
                *connection = new;
            }
            Err(error) => tracing::warn!("{error}"),
        }
    }

    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().expect("nobody panics with it locked")
    }

    /// Repeats a call until it is answered. `None`: the coordinator does not know the worker.
    async fn retried<T, F, C>(&self, call: C) -> Result<Option<T>, ClientError>
    where
        T: Check,
        C: Fn(CoordinatorClient<Channel>) -> F,
        F: Future<Output = Result<tonic::Response<T>, Status>>,
    {
        let mut wait = FIRST_WAIT;
        let (mut said, mut distrust) = (SILENCE, String::new());
        loop {
            let failure = match call(self.grpc()).await {
                Ok(reply) => {
                    *self.heard() = Heard { last: Instant::now(), ever: true };
                    let reply = reply.into_inner();
                    reply.check()?;
                    return Ok(Some(reply));
                }
                Err(status) if status.code() == Code::NotFound => return Ok(None),
                Err(status) => status,
            };
            let heard = *self.heard();
            let why = match refusal::seen_by_client(&failure) {
                // Where no answer ever came the set-up is wrong. Later the coordinator may be back with another.
                Some(why) if !heard.ever => return Err(ClientError::Untrusted(why)),
                Some(why) => {
                    if why != distrust {
                        tracing::warn!("no connection to the coordinator: {why}");
                        distrust.clone_from(&why);
                    }
                    why
                }
                None if is_final(failure.code()) => {
                    return Err(ClientError::Refused(readable(failure.message(), SHOWN)));
                }
                None => readable(failure.message(), SHOWN),
            };
            let silent = heard.last.elapsed();
            if silent > self.give_up_after {
                return Err(ClientError::GaveUp(silent, why));
            }
            tracing::debug!("{why}: again in {wait:?}");
            self.follow();
            if silent > said {
                let left = self.give_up_after.saturating_sub(silent);
                tracing::warn!(
                    "the coordinator has not answered for {silent:.0?} ({why}): is it running at that address? trying for \
                     another {left:.0?}"
                );
                // Ever more rarely: an hour's silence makes ten lines.
                said = silent * 2;
            }
            tokio::time::sleep(jittered(wait)).await;
            wait = (wait * 2).min(LONGEST_WAIT);
        }
    }
}

/// What no repetition can cure.
fn is_final(code: Code) -> bool {
    matches!(
        code,
        Code::FailedPrecondition
            | Code::InvalidArgument
            | Code::Unimplemented
            | Code::PermissionDenied
            | Code::Unauthenticated
            | Code::OutOfRange
    )
}

/// Between half and all of `wait`, so that many workers do not come back at the same moment.
fn jittered(wait: Duration) -> Duration {
    // Freshly keyed hashes are random enough here; 53 bits make a double in [0, 1).
    let share = (RandomState::new().hash_one(0_u8) >> 11) as f64 / (1_u64 << 53) as f64;
    wait.mul_f64(0.5 + 0.5 * share)
}
