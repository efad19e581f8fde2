//! The way to a coordinator: `http://` without protection, `https://` with both sides certified.

use super::Credentials;
use std::time::Duration;
use thiserror::Error;
use tonic::transport::{Certificate, ClientTlsConfig, Endpoint, Identity};

/// Longest time of a TLS handshake, on either side.
pub const HANDSHAKE_LIMIT: Duration = Duration::from_secs(10);

/// A URL that does not lead to a coordinator.
#[derive(Debug, Error)]
pub enum EndpointError {
    /// Not a URL.
    #[error("not a URL like http://127.0.0.1:7421 or https://host:7421 ({0})")]
    Url(String),
    /// TLS was asked for, and this is without.
    #[error(
        "a TLS directory is given (--tls or RUNOUT_TLS), and a URL with http:// would go without: begin it with https://"
    )]
    Unprotected,
    /// TLS needs certificates.
    #[error(
        "https:// needs certificates: give their directory, made by `runout tls init`, with --tls DIR or RUNOUT_TLS"
    )]
    NoCredentials,
    /// The certificates cannot be used.
    #[error("the certificates cannot be used: {0}")]
    Credentials(String),
}

/// The endpoint of the coordinator at `url`, without limits on its calls.
///
/// # Errors
/// Not such a URL; `https://` without credentials, or credentials without it.
pub fn endpoint(url: &str, credentials: Option<&Credentials>) -> Result<Endpoint, EndpointError> {
    let endpoint = Endpoint::from_shared(url.to_owned()).map_err(|e| EndpointError::Url(e.to_string()))?;
    if endpoint.uri().authority().is_none() {
        return Err(EndpointError::Url("it names no host".to_owned()));
    }
    match (endpoint.uri().scheme_str(), credentials) {
        (Some("http"), None) => Ok(endpoint),
        (Some("http"), Some(_)) => Err(EndpointError::Unprotected),
        (Some("https"), None) => Err(EndpointError::NoCredentials),
        (Some("https"), Some(own)) => {
            let mut config = ClientTlsConfig::new()
                .ca_certificate(Certificate::from_pem(&own.authority_pem))
                .identity(Identity::from_pem(&own.certificate_pem, &own.key_pem))
                .timeout(HANDSHAKE_LIMIT);
            if let Some(name) = &own.server_name {
                config = config.domain_name(name);
            }
            endpoint.tls_config(config).map_err(|e| EndpointError::Credentials(causes(&e)))
        }
        _ => Err(EndpointError::Url("it must begin with http:// or https://".to_owned())),
    }
}

/// An error with its causes: tonic's own words are "transport error".
fn causes(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}
