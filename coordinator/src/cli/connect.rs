//! The way from a command to a running coordinator, for those that ask or cancel.

use runout_proto::MESSAGE_LIMIT_BYTES;
use runout_proto::convert::readable;
use runout_proto::tls::{self, Credentials, EndpointError, TlsError, refusal};
use runout_proto::v1::coordinator_client::CoordinatorClient;
use std::path::Path;
use std::time::Duration;
use thiserror::Error;
use tonic::Status;
use tonic::transport::Channel;

/// How long a coordinator may take to answer.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);
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
        use tonic::Code;
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

/// A client of the coordinator at `url`; `https://` takes the operator's certificate from `folder`.
///
/// # Errors
/// Not such a URL, certificates that cannot be used, or nobody answers.
pub(super) async fn connect(
    url: &str,
    folder: Option<&Path>,
) -> Result<CoordinatorClient<Channel>, AskError> {
    let credentials = folder.map(Credentials::load_for_look).transpose()?;
    let endpoint = tls::endpoint(url, credentials.as_ref())?;
    let channel =
        endpoint.connect_timeout(ANSWER_LIMIT).timeout(ANSWER_LIMIT).connect().await.map_err(|error| {
            match refusal::seen_by_client(&error) {
                Some(why) => AskError::Untrusted(why),
                None => AskError::Away(error.to_string()),
            }
        })?;
    Ok(CoordinatorClient::new(channel)
        .max_decoding_message_size(MESSAGE_LIMIT_BYTES)
        .max_encoding_message_size(MESSAGE_LIMIT_BYTES))
}

/// As [`connect`], for an address that a run directory names: a coordinator without TLS is asked without, whatever
/// is set for others.
///
/// # Errors
/// As there. That there are no certificates for `https://` is said only where somebody listens.
pub(super) async fn connect_as_announced(
    url: &str,
    folder: Option<&Path>,
) -> Result<CoordinatorClient<Channel>, AskError> {
    let Some(address) = url.strip_prefix("https://") else { return connect(url, None).await };
    if folder.is_none() {
        let listens = tokio::time::timeout(ANSWER_LIMIT, tokio::net::TcpStream::connect(address)).await;
        if !matches!(listens, Ok(Ok(_))) {
            return Err(AskError::Away("nobody listens there".to_owned()));
        }
    }
    connect(url, folder).await
}

/// Whether a target is the URL of a coordinator, and not a run directory.
pub(super) fn is_url(target: &str) -> bool {
    target.starts_with("http://") || target.starts_with("https://")
}
