//! One party's certificate, key and authority, checked before anybody connects: what is wrong with them is said by
//! the side that can put it right.

use super::{AUTHORITY_FILE, Role, SERVER_NAME_FILE};
use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName, UnixTime};
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;
use time::OffsetDateTime;
use webpki::{EndEntityCert, KeyUsage};

/// What puts most things right.
const ADVICE: &str = "make a new directory with `runout tls init` and exchange all certificates of this one";

/// Credentials that cannot be used.
#[derive(Debug, Error)]
pub enum TlsError {
    /// A file cannot be read.
    #[error("{}: {error}; --tls (or RUNOUT_TLS) names a directory made by `runout tls init`", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// A file holds something else.
    #[error("{}: it holds no {what} in PEM form", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What it should hold.
        what: &'static str,
    },
    /// The name that clients are to expect is none.
    #[error("{}: it must hold one host name, such as coordinator.runout", .0.display())]
    ServerName(PathBuf),
    /// The certificate is not valid now.
    #[error("{}: the certificate {when}; {ADVICE}", path.display())]
    Dates {
        /// The file.
        path: PathBuf,
        /// "ran out on 2026-01-01", say.
        when: String,
    },
    /// The certificate was signed by somebody else.
    #[error("{}: the certificate was not signed by the authority of {AUTHORITY_FILE} beside it; {ADVICE}", .0.display())]
    OtherAuthority(PathBuf),
    /// The certificate is of another role.
    #[error("{}: this is no certificate of the role \"{}\" ({found}); {ADVICE}", path.display(), role.name())]
    OtherRole {
        /// The file.
        path: PathBuf,
        /// The role that is needed.
        role: Role,
        /// What it is instead.
        found: String,
    },
    /// Certificate and key do not belong together, or are of a kind that cannot be used.
    #[error("{}: it cannot be used: {why}; {ADVICE}", path.display())]
    Unusable {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
}

/// One party's certificate and key, and the authority that it trusts.
pub struct Credentials {
    pub(super) authority_pem: Vec<u8>,
    pub(super) certificate_pem: Vec<u8>,
    pub(super) key_pem: Vec<u8>,
    /// The authority that peers must be certified by.
    pub authority: CertificateDer<'static>,
    /// The party's own certificate, and those between it and the authority.
    pub chain: Vec<CertificateDer<'static>>,
    /// Its private key.
    pub key: PrivateKeyDer<'static>,
    /// What the certificate says.
    pub view: CertificateView,
    /// The name that clients expect in the coordinator's certificate; absent if they expect the host that they connect to.
    pub server_name: Option<String>,
}

impl fmt::Debug for Credentials {
    /// Without the key.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Credentials").field("view", &self.view).finish_non_exhaustive()
    }
}

impl Credentials {
    /// Reads and checks the credentials of `role` in a TLS directory.
    ///
    /// # Errors
    /// Files that are not there or hold something else; a certificate that is not valid now, of another authority or
    /// of another role.
    pub fn load(folder: &Path, role: Role) -> Result<Credentials, TlsError> {
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).map(|bytes| (path.clone(), bytes)).map_err(|error| TlsError::File { path, error })
        };
        let (authority_path, authority_pem) = read(AUTHORITY_FILE)?;
        let (path, certificate_pem) = read(&role.certificate_file())?;
        let (key_path, key_pem) = read(&role.key_file())?;
        let form = |path: &Path, what| TlsError::Form { path: path.to_owned(), what };
        let authority = CertificateDer::from_pem_slice(&authority_pem)
            .map_err(|_| form(&authority_path, "certificate"))?;
        let chain = certificates(&certificate_pem).ok_or_else(|| form(&path, "certificate"))?;
        let key = PrivateKeyDer::from_pem_slice(&key_pem).map_err(|_| form(&key_path, "private key"))?;
        let view = check(&path, &authority, &chain, role)?;
        let server_name = server_name(&folder.join(SERVER_NAME_FILE))?;
        Ok(Credentials { authority_pem, certificate_pem, key_pem, authority, chain, key, view, server_name })
    }

    /// As [`Credentials::load`], for whoever looks at campaigns: the operator's, or the worker's where there are no
    /// operator's.
    ///
    /// # Errors
    /// As there.
    pub fn load_for_look(folder: &Path) -> Result<Credentials, TlsError> {
        let operator = folder.join(Role::Operator.certificate_file()).exists();
        let worker = folder.join(Role::Worker.certificate_file()).exists();
        let role = if worker && !operator { Role::Worker } else { Role::Operator };
        Credentials::load(folder, role)
    }

    /// Whether a client that connects to `host` (a name or an IP address) will take this certificate for it.
    pub fn is_valid_for(&self, host: &str) -> bool {
        let host = self.server_name.as_deref().unwrap_or(host);
        let Ok(name) = ServerName::try_from(host.trim_start_matches('[').trim_end_matches(']')) else {
            return false;
        };
        EndEntityCert::try_from(&self.chain[0])
            .is_ok_and(|certificate| certificate.verify_is_valid_for_subject_name(&name).is_ok())
    }
}

/// What a certificate says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CertificateView {
    /// Roles it bears.
    pub roles: Vec<Role>,
    /// Host names it is valid for; IP addresses are not listed.
    pub hosts: Vec<String>,
    /// Last moment of its validity, seconds since 1970.
    pub until_s: u64,
}

impl CertificateView {
    /// The day on which it runs out (UTC).
    pub fn until(&self) -> String {
        day(UnixTime::since_unix_epoch(Duration::from_secs(self.until_s)))
    }

    /// What it says of a certificate.
    ///
    /// # Errors
    /// It is not one, in words.
    pub fn of(certificate: &CertificateDer<'_>) -> Result<CertificateView, String> {
        let certificate = EndEntityCert::try_from(certificate).map_err(|e| e.to_string())?;
        let uris: Vec<&str> = certificate.valid_uri_names().collect();
        let roles = Role::ALL.into_iter().filter(|role| uris.contains(&role.uri().as_str())).collect();
        let hosts = certificate.valid_dns_names().map(str::to_owned).collect();
        let until_s = not_after(&certificate).ok_or("its dates cannot be read")?;
        Ok(CertificateView { roles, hosts, until_s })
    }
}

/// Reads a certificate file, without any check but its form.
///
/// # Errors
/// It cannot be read, or is none.
pub fn read_certificate(path: &Path) -> Result<CertificateView, TlsError> {
    let pem = fs::read(path).map_err(|error| TlsError::File { path: path.to_owned(), error })?;
    let none = || TlsError::Form { path: path.to_owned(), what: "certificate" };
    let chain = certificates(&pem).ok_or_else(none)?;
    CertificateView::of(&chain[0]).map_err(|why| TlsError::Unusable { path: path.to_owned(), why })
}

/// The name in a `server.name`, which need not be there.
fn server_name(path: &Path) -> Result<Option<String>, TlsError> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(TlsError::File { path: path.to_owned(), error }),
    };
    match ServerName::try_from(text.trim()) {
        Ok(ServerName::DnsName(name)) => Ok(Some(name.as_ref().to_owned())),
        _ => Err(TlsError::ServerName(path.to_owned())),
    }
}

/// The certificates of a PEM file; `None` if there is not at least one.
fn certificates(pem: &[u8]) -> Option<Vec<CertificateDer<'static>>> {
    let all: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(pem).collect();
    all.ok().filter(|chain| !chain.is_empty())
}

fn check(
    path: &Path,
    authority: &CertificateDer<'_>,
    chain: &[CertificateDer<'_>],
    role: Role,
) -> Result<CertificateView, TlsError> {
    let unusable = |why: String| TlsError::Unusable { path: path.to_owned(), why };
    let view = CertificateView::of(&chain[0]).map_err(unusable)?;
    if !view.roles.contains(&role) {
        let names: Vec<&str> = view.roles.iter().map(|role| role.name()).collect();
        let found = if names.is_empty() { "it bears no role".to_owned() } else { names.join(", ") };
        return Err(TlsError::OtherRole { path: path.to_owned(), role, found });
    }
    let anchor = webpki::anchor_from_trusted_cert(authority)
        .map_err(|e| TlsError::Unusable { path: path.with_file_name(AUTHORITY_FILE), why: e.to_string() })?;
    let certificate = EndEntityCert::try_from(&chain[0]).map_err(|e| unusable(e.to_string()))?;
    let usage = match role {
        Role::Server => KeyUsage::server_auth(),
        Role::Worker | Role::Operator => KeyUsage::client_auth(),
    };
    let algorithms = ring::default_provider().signature_verification_algorithms.all;
    let anchors = [anchor];
    let now = UnixTime::now();
    let checked = certificate.verify_for_usage(algorithms, &anchors, &chain[1..], now, usage, None, None);
    let dates = |when: String| TlsError::Dates { path: path.to_owned(), when };
    match checked {
        Ok(_) => Ok(view),
        Err(webpki::Error::CertExpired { not_after, .. }) => {
            Err(dates(format!("ran out on {}", day(not_after))))
        }
        Err(webpki::Error::CertNotValidYet { not_before, .. }) => {
            Err(dates(format!("is not valid before {}: is this machine's clock right?", day(not_before))))
        }
        Err(webpki::Error::UnknownIssuer | webpki::Error::InvalidSignatureForPublicKey) => {
            Err(TlsError::OtherAuthority(path.to_owned()))
        }
        Err(other) => Err(unusable(other.to_string())),
    }
}

/// Last moment of a certificate's validity, seconds since 1970.
fn not_after(certificate: &EndEntityCert<'_>) -> Option<u64> {
    /// The year 9999, up to which certificates can say a date at all.
    const END_OF_TIME: Duration = Duration::from_secs(253_402_300_799);
    // The verifier tells the date only of a certificate that has run out. It looks at dates before signatures.
    let then = UnixTime::since_unix_epoch(END_OF_TIME);
    let algorithms = ring::default_provider().signature_verification_algorithms.all;
    let purposes = [KeyUsage::client_auth(), KeyUsage::server_auth()];
    purposes.into_iter().find_map(|usage| {
        match certificate.verify_for_usage(algorithms, &[], &[], then, usage, None, None) {
            Err(webpki::Error::CertExpired { not_after, .. }) => Some(not_after.as_secs()),
            _ => None,
        }
    })
}

/// The day (UTC) of a moment.
pub(super) fn day(time: UnixTime) -> String {
    let seconds = i64::try_from(time.as_secs()).ok();
    let date = seconds.and_then(|s| OffsetDateTime::from_unix_timestamp(s).ok());
    date.map_or_else(|| "a day beyond the calendar".to_owned(), |time| time.date().to_string())
}
