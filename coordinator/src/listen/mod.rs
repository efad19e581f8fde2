//! Where the coordinator listens, and whom it lets in.
//!
//! [`Listener::bind`] refuses to listen beyond loopback without TLS. [`Listener::incoming`] accepts connections under
//! [`crate::limits`], has each show its certificate, and hands on those that did; what a caller may do is decided per
//! call, by [`Caller::may`].

mod accept;
mod address;
mod caller;
mod connection;
mod notes;

pub(crate) use accept::{Refused, let_in};
pub(crate) use address::for_others;
pub use address::{Advertised, host_name};
pub use caller::{Caller, Right, Standing};
pub use connection::Connection;
pub use notes::Notes;

use crate::limits;
use runout_proto::tls::{Credentials, Role, TlsError};
use rustls::server::{NoServerSessionStorage, WebPkiClientVerifier};
use rustls::{RootCertStore, ServerConfig};
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;
use tokio::net::{TcpListener, TcpSocket};
use tokio_rustls::TlsAcceptor;
use tokio_stream::wrappers::ReceiverStream;

/// Who may connect.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// TLS directory; without it nothing is encrypted, and whoever can connect may do everything.
    pub tls: Option<PathBuf>,
    /// Listen beyond loopback without TLS.
    pub insecure: bool,
    /// The address to tell others, if it is not the one listened on.
    pub advertise: Option<Advertised>,
}

/// An address that cannot be listened on.
#[derive(Debug, Error)]
pub enum ListenError {
    /// The address is open to other machines, and nothing protects it.
    #[error(
        "{0} can be reached from other machines, and without TLS whoever reaches it can take part; make certificates \
         with `runout tls init` and give them with --tls DIR, listen on a loopback address, or accept it with --insecure"
    )]
    Insecure(SocketAddr),
    /// The address is taken, or not this machine's.
    #[error(
        "cannot listen on {address}: {error}; {}",
        match error.kind() {
            io::ErrorKind::AddrInUse =>
                "another coordinator may be there: take another port with --listen (0 for any free one)",
            _ => "--listen takes an address of this machine",
        }
    )]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system said.
        error: io::Error,
    },
    /// The certificates cannot be used.
    #[error(transparent)]
    Credentials(#[from] TlsError),
    /// The TLS library refuses them.
    #[error("{}: certificate and key cannot be used: {error}", folder.display())]
    Tls {
        /// The TLS directory.
        folder: PathBuf,
        /// What it said.
        error: String,
    },
    /// Clients would refuse the certificate.
    #[error(
        "--advertise {host}: server.pem is not for this host but for {}: make certificates with `runout tls init \
         --host {host}`", known.join(", ")
    )]
    OtherHost {
        /// The host.
        host: String,
        /// Names in the certificate.
        known: Vec<String>,
    },
}

/// A socket that is listened on.
pub struct Listener {
    socket: TcpListener,
    tls: Option<TlsAcceptor>,
    url: String,
    local_url: String,
}

impl Listener {
    /// Listens on `address`: with TLS, on loopback, or anywhere if that is accepted.
    ///
    /// # Errors
    /// The address is open to others without TLS, taken, or not this machine's; certificates that cannot be used.
    pub async fn bind(address: SocketAddr, access: &Access) -> Result<Listener, ListenError> {
        let credentials =
            access.tls.as_ref().map(|folder| Credentials::load(folder, Role::Server)).transpose()?;
        if credentials.is_none() && !address.ip().is_loopback() && !access.insecure {
            return Err(ListenError::Insecure(address));
        }
        let failed = |error| ListenError::Listen { address, error };
        let socket = listen(address).map_err(failed)?;
        let bound = socket.local_addr().map_err(failed)?;
        let (host, port) = address::for_others(bound, access.advertise.as_ref());
        if let Some(own) = &credentials
            && !own.is_valid_for(&host)
        {
            if access.advertise.is_some() {
                return Err(ListenError::OtherHost { host, known: own.view.hosts.clone() });
            }
            tracing::warn!(
                "coordinator.addr names the host {host}, and server.pem is not for it: whoever connects there will \
                 refuse the certificate; give another name with --advertise, or make certificates with --host {host}"
            );
        }
        let scheme = if credentials.is_some() { "https" } else { "http" };
        let url = format!("{scheme}://{host}:{port}");
        let local_url = format!("{scheme}://{}", address::from_here(bound));
        let tls = match (credentials, &access.tls) {
            (Some(own), Some(folder)) => Some(acceptor(own, folder, b"h2")?),
            _ => None,
        };
        Ok(Listener { socket, tls, url, local_url })
    }

    /// The URL for everybody.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// A URL for this machine.
    pub fn local_url(&self) -> &str {
        &self.local_url
    }

    /// The connections that were let in; the socket closes when the stream is dropped.
    pub fn incoming(self) -> ReceiverStream<io::Result<Connection>> {
        accept::start(self.socket, self.tls)
    }
}

/// What makes TLS of connections, with the coordinator's certificate from `folder`, for one protocol (by its ALPN name).
///
/// # Errors
/// The TLS library refuses the certificate.
pub(crate) fn acceptor(own: Credentials, folder: &Path, protocol: &[u8]) -> Result<TlsAcceptor, ListenError> {
    let failed = |error| ListenError::Tls { folder: folder.to_owned(), error };
    Ok(TlsAcceptor::from(Arc::new(server_config(own, protocol).map_err(failed)?)))
}

/// TLS 1.3 only, with a certificate from every client.
fn server_config(own: Credentials, protocol: &[u8]) -> Result<ServerConfig, String> {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let mut authorities = RootCertStore::empty();
    authorities.add(own.authority).map_err(|e| e.to_string())?;
    let verifier = WebPkiClientVerifier::builder_with_provider(Arc::new(authorities), Arc::clone(&provider))
        .build()
        .map_err(|e| e.to_string())?;
    let mut config = ServerConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|e| e.to_string())?
        .with_client_cert_verifier(verifier)
        .with_single_cert(own.chain, own.key)
        .map_err(|e| e.to_string())?;
    config.alpn_protocols = vec![protocol.to_vec()];
    // A resumed session would not look at the certificate's dates again.
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.send_tls13_tickets = 0;
    Ok(config)
}

/// Listens, with room for as many who come at once as may be connected: beyond the usual 1,024 the system drops what they
/// send, and breaks the connection a minute later.
fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // As any server's: the port of a coordinator that was killed can be taken at once.
    #[cfg(unix)]
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(limits::CONNECTIONS as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpStream;
    use std::time::Duration;

    /// More than the 1,024 that would be usual, and less than the 4,096 that Linux allows.
    const AT_ONCE: usize = 1500;
    /// Less than the second after which the system tries again what was dropped.
    const SOON: Duration = Duration::from_millis(900);

    #[tokio::test]
    async fn many_that_connect_at_once_need_not_try_again() {
        let socket = listen(([127, 0, 0, 1], 0).into()).unwrap();
        let address = socket.local_addr().unwrap();
        let mut connected = Vec::new();
        for _ in 0..AT_ONCE {
            match TcpStream::connect_timeout(&address, SOON) {
                Ok(stream) => connected.push(stream),
                // This process may open fewer files (`ulimit -n`): nothing is shown.
                Err(error) if error.raw_os_error() == Some(24) => {
                    println!("NOT TESTED with {AT_ONCE} connections: {error} after {}", connected.len());
                    return;
                }
                Err(error) => panic!("connection {}: {error}", connected.len()),
            }
        }
    }
}
