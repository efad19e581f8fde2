//! The only gRPC of the worker: every call is retried with jittered back-off, registration is renewed when the
//! coordinator does not know the worker (any more), and a coordinator that stays away too long is given up.

use crate::address::Address;
use runout_core::spec::{Spec, SpecError};
use runout_proto::v1::coordinator_client::CoordinatorClient;
use runout_proto::v1::{
    HeartbeatReply, HeartbeatRequest, LeaseProgress, LeaseRef, LeaseReply, LeaseRequest, RegisterRequest,
    ReleaseRequest, ReportReply, ReportRequest,
};
use runout_proto::{LONGEST_POLL_S, MESSAGE_LIMIT_BYTES, identity};
use std::hash::{BuildHasher, RandomState};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use thiserror::Error;
use tonic::transport::{Channel, Endpoint};
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

/// A coordinator that cannot be worked for.
#[derive(Debug, Error)]
pub enum ClientError {
    /// Not a URL.
    #[error("--coordinator {url}: not a URL like http://127.0.0.1:7421 ({why})")]
    Url {
        /// What was given.
        url: String,
        /// Why it is none.
        why: String,
    },
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
}

/// A connection. Heartbeat and slots have one each, and share the registration.
#[derive(Debug)]
pub struct Client {
    address: Address,
    connection: Mutex<Connection>,
    introduction: Introduction,
    give_up_after: Duration,
    heard: Mutex<Instant>,
}

/// Where calls go.
#[derive(Debug)]
struct Connection {
    url: String,
    grpc: CoordinatorClient<Channel>,
}

impl Connection {
    /// To the coordinator at `url`; connects with the first call. Needs a runtime around it.
    fn new(url: &str) -> Result<Connection, ClientError> {
        let endpoint = Endpoint::from_shared(url.to_owned())
            .map_err(|e| ClientError::Url { url: url.to_owned(), why: e.to_string() })?;
        if endpoint.uri().scheme_str() != Some("http") || endpoint.uri().authority().is_none() {
            let why = "it must begin with http://".to_owned();
            return Err(ClientError::Url { url: url.to_owned(), why });
        }
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
    /// A client for the coordinator at `address`, now at `url`; connects with the first call. Needs a runtime around
    /// it.
    ///
    /// # Errors
    /// Not a URL.
    pub fn new(
        address: Address,
        url: &str,
        introduction: Introduction,
        give_up_after: Duration,
    ) -> Result<Client, ClientError> {
        let connection = Mutex::new(Connection::new(url)?);
        Ok(Client { address, connection, introduction, give_up_after, heard: Mutex::new(Instant::now()) })
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
        // A period that is no time would be a busy loop or a panic.
        let heartbeat_s =
            if reply.heartbeat_s.is_finite() { reply.heartbeat_s.clamp(0.01, 3600.0) } else { 5.0 };
        let heartbeat = Duration::from_secs_f64(heartbeat_s);
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
            Ok(Ok(reply)) => return Ok(Some(reply.into_inner())),
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
        let Some(url) = self.address.now() else { return };
        let mut connection = self.connection.lock().expect("nobody panics with it locked");
        if url == connection.url {
            return;
        }
        match Connection::new(&url) {
            Ok(new) => {
                tracing::info!("the coordinator has moved to {url}");
                *connection = new;
            }
            Err(error) => tracing::warn!("{error}"),
        }
    }

    /// Repeats a call until it is answered. `None`: the coordinator does not know the worker.
    async fn retried<T, F, C>(&self, call: C) -> Result<Option<T>, ClientError>
    where
        C: Fn(CoordinatorClient<Channel>) -> F,
        F: Future<Output = Result<tonic::Response<T>, Status>>,
    {
        let mut wait = FIRST_WAIT;
        let mut said = SILENCE;
        loop {
            match call(self.grpc()).await {
                Ok(reply) => {
                    *self.heard.lock().expect("nobody panics with it locked") = Instant::now();
                    return Ok(Some(reply.into_inner()));
                }
                Err(status) if status.code() == Code::NotFound => return Ok(None),
                Err(status) if is_final(status.code()) => {
                    return Err(ClientError::Refused(status.message().to_owned()));
                }
                Err(status) => {
                    let silent = self.heard.lock().expect("nobody panics with it locked").elapsed();
                    if silent > self.give_up_after {
                        return Err(ClientError::GaveUp(silent, status.message().to_owned()));
                    }
                    tracing::debug!("{}: again in {wait:?}", status.message());
                    self.follow();
                    if silent > said {
                        let left = self.give_up_after.saturating_sub(silent);
                        tracing::warn!(
                            "the coordinator has not answered for {silent:.0?} ({}): is it running at that address? \
                             trying for another {left:.0?}",
                            status.message()
                        );
                        // Ever more rarely: an hour's silence makes ten lines.
                        said = silent * 2;
                    }
                }
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
