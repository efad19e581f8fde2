//! Certificates: where they lie, whose they are, how a client uses them, and why one is refused.
//!
//! A TLS directory (`runout tls init DIR`) holds the authority's certificate, `ca.pem`, and for each [`Role`] a
//! certificate and its key, `worker.pem` and `worker.key`. Every party needs `ca.pem` and its own two files, no more; where
//! there is a `server.name`, clients need that as well: it is the name that the coordinator's certificate bears wherever
//! the coordinator runs, for coordinators whose host nobody knows beforehand.
//! The role stands in the certificate as a URI name, `runout:role:worker`, signed by the authority with the rest of
//! it; it is read by the library that verifies the certificate, so that no second parser looks at what a peer sent.

mod credentials;
mod endpoint;
pub mod refusal;

pub use credentials::{CertificateView, Credentials, TlsError, read_certificate};
pub use endpoint::{EndpointError, HANDSHAKE_LIMIT, endpoint};

/// Environment variable with the TLS directory, for those who do not want `--tls` in their scripts.
pub const VARIABLE: &str = "RUNOUT_TLS";

/// Name of the authority's certificate in a TLS directory.
pub const AUTHORITY_FILE: &str = "ca.pem";

/// Name of the file in a TLS directory with the name that clients expect in the coordinator's certificate, whatever the host
/// in its URL; absent where they expect that host.
pub const SERVER_NAME_FILE: &str = "server.name";

/// What a certificate is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// The coordinator, which is connected to.
    Server,
    /// Takes leases, reports outcomes.
    Worker,
    /// Looks at a campaign and may cancel it.
    Operator,
}

impl Role {
    /// Every role.
    pub const ALL: [Role; 3] = [Role::Server, Role::Worker, Role::Operator];

    /// Its name, and the stem of its files.
    pub fn name(self) -> &'static str {
        match self {
            Role::Server => "server",
            Role::Worker => "worker",
            Role::Operator => "operator",
        }
    }

    /// The URI name that a certificate of this role bears.
    pub fn uri(self) -> String {
        format!("runout:role:{}", self.name())
    }

    /// Name of its certificate in a TLS directory.
    pub fn certificate_file(self) -> String {
        format!("{}.pem", self.name())
    }

    /// Name of its private key in a TLS directory.
    pub fn key_file(self) -> String {
        format!("{}.key", self.name())
    }
}
