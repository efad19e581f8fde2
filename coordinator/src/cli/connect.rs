//! The way from a command to a running coordinator, for those that ask or cancel.

use runout_proto::MESSAGE_LIMIT_BYTES;
use runout_proto::check::Check;
use runout_proto::convert::readable;
use runout_proto::tls::{self, Credentials, EndpointError, TlsError, refusal};
use runout_proto::v1::coordinator_client::CoordinatorClient;
use std::path::Path;
use std::time::{Duration, Instant};
use thiserror::Error;
use tonic::transport::Channel;
use tonic::{Code, Response, Status};

/// How long a coordinator may take to answer.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);
/// For how long a call is made again whose connection ended without a word, and the wait before.
const AGAIN_FOR: Duration = Duration::from_secs(1);
const AGAIN_AFTER: Duration = Duration::from_millis(50);
/// Longest message of a coordinator that is shown, characters.
const SHOWN: usize = 500;

/// Why a coordinator was not asked, or did not do what was asked.
#[derive(Debug, Error)]
pub(super) enum AskError {
    /// Nobody answers.
    #[error("no coordinator answers ({0})")]
    Away(String),
    /// The URL, or what is needed for it, is wrong.
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    /// The certificates cannot be used.
    #[error(transparent)]
    Credentials(#[from] TlsError),
    /// The two do not trust each other.
    #[error("{0}")]
    Untrusted(String),
    /// It answers, and refuses.
    #[error("the coordinator refuses: {0}")]
    Refused(String),
}

impl From<Status> for AskError {
    fn from(status: Status) -> AskError {
        if let Some(why) = refusal::seen_by_client(&status) {
            return AskError::Untrusted(why);
        }
        let message = readable(status.message(), SHOWN);
        match status.code() {
            Code::Unavailable | Code::Unknown | Code::DeadlineExceeded | Code::Cancelled => {
                AskError::Away(message)
            }
            _ => AskError::Refused(message),
        }
    }
}

/// A client of the coordinator at `url`; `https://` takes the operator's certificate from `folder`. Connects with the
/// first call. Needs a runtime around it.
///
/// # Errors
/// Not such a URL, or certificates that cannot be used.
pub(super) fn connect(url: &str, folder: Option<&Path>) -> Result<CoordinatorClient<Channel>, AskError> {
    let credentials = folder.map(Credentials::load_for_look).transpose()?;
    let endpoint = tls::endpoint(url, credentials.as_ref())?;
    let channel = endpoint.connect_timeout(ANSWER_LIMIT).timeout(ANSWER_LIMIT).connect_lazy();
    Ok(CoordinatorClient::new(channel)
        .max_decoding_message_size(MESSAGE_LIMIT_BYTES)
        .max_encoding_message_size(MESSAGE_LIMIT_BYTES))
}

/// As [`connect`], for an address that the run directory `out` names: a coordinator without TLS is asked without, whatever
/// is set for others, and one with TLS with the run directory's own certificates, where no others are given.
///
/// # Errors
/// As there. That there are no certificates for `https://` is said only where somebody listens.
pub(super) async fn connect_as_announced(
    url: &str,
    out: &Path,
    folder: Option<&Path>,
) -> Result<CoordinatorClient<Channel>, AskError> {
    let Some(address) = url.strip_prefix("https://") else { return connect(url, None) };
    let own = out.join(crate::tls::FOLDER);
    let folder = folder.or_else(|| own.is_dir().then_some(own.as_path()));
    if folder.is_none() {
        let listens = tokio::time::timeout(ANSWER_LIMIT, tokio::net::TcpStream::connect(address)).await;
        if !matches!(listens, Ok(Ok(_))) {
            return Err(AskError::Away("nobody listens there".to_owned()));
        }
    }
    connect(url, folder)
}

/// Makes a call that can be repeated without harm, and gives its checked answer.
///
/// # Errors
/// Nobody answers, the two do not trust each other, or the coordinator refuses.
pub(super) async fn ask<T, F, C>(client: &CoordinatorClient<Channel>, call: C) -> Result<T, AskError>
where
    T: Check,
    F: Future<Output = Result<Response<T>, Status>>,
    C: Fn(CoordinatorClient<Channel>) -> F,
{
    let started = Instant::now();
    let reply = loop {
        match call(client.clone()).await {
            Ok(reply) => break reply.into_inner(),
            // A connection that the other side has closed while the call was on its way does not tell why.
            Err(status) if status.code() == Code::Cancelled && started.elapsed() < AGAIN_FOR => {
                tokio::time::sleep(AGAIN_AFTER).await;
            }
            Err(status) => return Err(status.into()),
        }
    };
    let not_understood = |why| AskError::Refused(format!("its answer cannot be understood: {why}"));
    reply.check().map_err(not_understood)?;
    Ok(reply)
}

/// Whether a target is the URL of a coordinator, and not a run directory.
pub(super) fn is_url(target: &str) -> bool {
    target.starts_with("http://") || target.starts_with("https://")
}
