//! Why two parties did not come to trust each other, in words for the one who reads the message.

use super::credentials::day;
use rustls::{AlertDescription, CertificateError, Error as Tls};
use std::error::Error;
use std::io;

/// What a coordinator that speaks TLS tells a client that does not, and how such a client recognises it.
pub const TLS_ONLY: &str = "this coordinator speaks TLS only: use a URL with https://, and --tls DIR or RUNOUT_TLS with certificates of it";

/// Why a client could not call a coordinator, if TLS was the reason. Nothing but another set-up on one of the two
/// sides will change it.
pub fn seen_by_client(error: &(dyn Error + 'static)) -> Option<String> {
    if let Some(tls) = tls_error(error) {
        return explained_to_client(tls);
    }
    // HTTP/2 keeps of the causes below it only their words.
    let words = words(error);
    if words.contains(TLS_ONLY) {
        return Some(TLS_ONLY.to_owned());
    }
    let alert = words.split("received fatal alert: ").nth(1)?;
    let alert: String = alert.chars().take_while(char::is_ascii_alphanumeric).collect();
    Some(refused_by_coordinator(&alert))
}

/// Why a coordinator did not take a connection.
pub fn seen_by_coordinator(error: &io::Error) -> String {
    let Some(tls) = tls_error(error) else { return format!("the TLS handshake failed: {error}") };
    match tls {
        Tls::NoCertificatesPresented => "it shows no certificate".to_owned(),
        Tls::InvalidCertificate(why) => match why {
            CertificateError::UnknownIssuer | CertificateError::BadSignature => {
                "its certificate was signed by another authority than that of this coordinator's ca.pem".to_owned()
            }
            CertificateError::Expired => "its certificate has run out".to_owned(),
            CertificateError::ExpiredContext { not_after, .. } => {
                format!("its certificate ran out on {}", day(*not_after))
            }
            CertificateError::NotValidYetContext { not_before, .. } => {
                format!("its certificate is not valid before {}", day(*not_before))
            }
            CertificateError::InvalidPurpose | CertificateError::InvalidPurposeContext { .. } => {
                "its certificate is none of a client's".to_owned()
            }
            other => format!("its certificate cannot be accepted: {other}"),
        },
        Tls::AlertReceived(
            AlertDescription::UnknownCA | AlertDescription::BadCertificate | AlertDescription::DecryptError,
        ) => "it does not accept this coordinator's certificate: its ca.pem is of another authority, or the host \
              name in its URL is none that the certificate is for"
            .to_owned(),
        Tls::AlertReceived(AlertDescription::CertificateExpired) => {
            "it says that this coordinator's certificate has run out".to_owned()
        }
        other => format!("the TLS handshake failed: {other}"),
    }
}

fn explained_to_client(error: &Tls) -> Option<String> {
    Some(match error {
        Tls::InvalidCertificate(why) => match why {
            CertificateError::UnknownIssuer | CertificateError::BadSignature => {
                "the coordinator's certificate was signed by another authority than that of ca.pem in the TLS \
                 directory: use certificates made together with the coordinator's (one `runout tls init`)"
                    .to_owned()
            }
            CertificateError::Expired => {
                "the coordinator's certificate has run out: make new ones with `runout tls init`".to_owned()
            }
            CertificateError::ExpiredContext { not_after, .. } => format!(
                "the coordinator's certificate ran out on {}: make new ones with `runout tls init`",
                day(*not_after)
            ),
            CertificateError::NotValidForName => {
                "the coordinator's certificate is not for the host in its URL: name the host to `runout tls init \
                 --host`"
                    .to_owned()
            }
            CertificateError::NotValidForNameContext { expected, presented } => format!(
                "the coordinator's certificate is not for the host \"{}\" of its URL but for {}: use one of these, \
                 or name the host to `runout tls init --host`",
                expected.to_str(),
                presented.join(", ")
            ),
            other => format!("the coordinator's certificate cannot be accepted: {other}"),
        },
        Tls::InvalidMessage(_) => {
            "the coordinator does not speak TLS: start it with --tls, or use http:// where that is safe".to_owned()
        }
        Tls::AlertReceived(alert) => refused_by_coordinator(&format!("{alert:?}")),
        _ => return None,
    })
}

/// An alert of the coordinator's, by its name: it did not accept this side's certificate.
fn refused_by_coordinator(alert: &str) -> String {
    let why = match alert {
        "CertificateRequired" => "it asks for a certificate and was shown none",
        "CertificateExpired" => "by its clock this side's certificate has run out",
        "UnknownCA" | "DecryptError" => {
            "this side's certificate was signed by another authority than its own"
        }
        "BadCertificate" | "UnsupportedCertificate" => "this side's certificate is not valid for this",
        other => return format!("the coordinator refuses this side's certificate (TLS alert {other})"),
    };
    format!(
        "the coordinator refuses this side's certificate: {why}; use certificates of its own `runout tls init`"
    )
}

/// The TLS error among the causes.
fn tls_error<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a Tls> {
    let mut cause = Some(error);
    while let Some(error) = cause {
        // What lies in an I/O error is no cause of it by `source`.
        let inner = error.downcast_ref::<io::Error>().and_then(io::Error::get_ref);
        let found =
            error.downcast_ref::<Tls>().or_else(|| inner.and_then(|inner| inner.downcast_ref::<Tls>()));
        if found.is_some() {
            return found;
        }
        cause = error.source();
    }
    None
}

/// An error and its causes.
fn words(error: &(dyn Error + 'static)) -> String {
    let mut text = String::new();
    let mut cause = Some(error);
    while let Some(error) = cause {
        text = format!("{text}{error}\n");
        cause = error.source();
    }
    text
}
