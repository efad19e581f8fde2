//! Where the page listens: on loopback, with TLS anywhere, and at the same port again when a campaign is continued.

use crate::listen::{self, Access, ListenError};
use crate::store::write_atomically;
use runout_proto::tls::{Credentials, Role};
use std::fs;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio_rustls::TlsAcceptor;

/// File of a run directory that holds the page's address. It stays, so that a coordinator that continues the campaign
/// takes the same port and an open page finds it again.
pub const ADDRESS_FILE: &str = "page.addr";

/// A free port of loopback.
const ANY_PORT: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

/// Where the page shall be.
#[derive(Debug, Clone)]
pub enum Place {
    /// Nowhere.
    Nowhere,
    /// At a port of loopback: the one it had before, or a free one.
    Usual,
    /// At this address; elsewhere than on loopback with TLS, or without where `access` accepts that.
    At {
        /// Address.
        address: SocketAddr,
        /// Who may connect.
        access: Access,
    },
}

/// A socket for the page, and what makes TLS of its connections where it needs that.
pub struct Door {
    pub(super) socket: TcpListener,
    pub(super) tls: Option<TlsAcceptor>,
    url: String,
}

impl Door {
    fn new(socket: TcpListener, tls: Option<TlsAcceptor>) -> io::Result<Door> {
        let (host, port) = listen::for_others(socket.local_addr()?, None);
        let scheme = if tls.is_some() { "https" } else { "http" };
        Ok(Door { socket, tls, url: format!("{scheme}://{host}:{port}/") })
    }

    /// The page's URL.
    pub fn url(&self) -> &str {
        &self.url
    }
}

/// A page that cannot be where it was asked for.
#[derive(Debug, Error)]
pub enum PageError {
    /// The address is open to other machines, and nothing protects it.
    #[error(
        "--page {0}: it can be reached from other machines, and without TLS the page is neither encrypted nor protected; \
         give certificates with --tls DIR, take a loopback address (and from elsewhere `ssh -L \
         PORT:127.0.0.1:PORT HOST`), or accept that with `runout serve --insecure`"
    )]
    Insecure(SocketAddr),
    /// The certificates cannot be used.
    #[error("--page: {0}")]
    Tls(#[from] ListenError),
    /// The address is taken, or not this machine's.
    #[error("--page {address}: {error}; take another port (0 for any free one), or --no-page")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system said.
        error: io::Error,
    },
    /// The run directory does not take its address.
    #[error("{ADDRESS_FILE}: {0}")]
    Announce(io::Error),
}

/// Listens at `place` for the campaign in the run directory `out`. Nothing, where no page is wanted, or where the usual
/// place cannot be had: that is no reason not to run a campaign.
///
/// # Errors
/// An address that was asked for cannot be had, or would be open to others.
pub async fn listen(place: Place, out: &Path) -> Result<Option<Door>, PageError> {
    match place {
        Place::Nowhere => Ok(None),
        Place::At { address, access } => at(address, &access).await.map(Some),
        Place::Usual => {
            if let Some(before) = before(out)
                && let Ok(socket) = TcpListener::bind(before).await
            {
                return Ok(Door::new(socket, None).ok());
            }
            let door = TcpListener::bind(ANY_PORT).await.and_then(|socket| Door::new(socket, None));
            if let Err(error) = &door {
                tracing::warn!("there is no live page: {ANY_PORT}: {error}");
            }
            Ok(door.ok())
        }
    }
}

async fn at(address: SocketAddr, access: &Access) -> Result<Door, PageError> {
    let tls = match &access.tls {
        // Who is on this machine need not show a certificate, as with the usual place.
        _ if address.ip().is_loopback() => None,
        Some(folder) => {
            let own = Credentials::load(folder, Role::Server).map_err(ListenError::from)?;
            Some(listen::acceptor(own, folder, b"http/1.1")?)
        }
        None if access.insecure => None,
        None => return Err(PageError::Insecure(address)),
    };
    let socket = TcpListener::bind(address).await;
    socket.and_then(|socket| Door::new(socket, tls)).map_err(|error| PageError::Listen { address, error })
}

/// Writes the page's URL into the run directory.
pub(super) fn announce(out: &Path, url: &str) -> io::Result<()> {
    write_atomically(&out.join(ADDRESS_FILE), format!("{url}\n").as_bytes())
}

/// The loopback address that the page of this run directory had before.
fn before(out: &Path) -> Option<SocketAddr> {
    let text = fs::read_to_string(out.join(ADDRESS_FILE)).ok()?;
    let address: SocketAddr = text.trim().strip_prefix("http://")?.strip_suffix('/')?.parse().ok()?;
    address.ip().is_loopback().then_some(address)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tls::{Names, Validity};
    use std::path::PathBuf;

    #[tokio::test]
    async fn the_usual_place_is_the_one_before_where_it_is_free() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let usual =
            || async { listen(Place::Usual, folder.path()).await.expect("loopback").expect("a port") };
        let first = usual().await;
        let url = first.url().to_owned();
        announce(folder.path(), &url).expect("it can be written");
        let taken = usual().await;
        assert_ne!(taken.url(), url);
        drop(first);
        assert_eq!(usual().await.url(), url);
        // Nobody is sent beyond loopback by a file.
        announce(folder.path(), "http://0.0.0.0:80/").expect("it can be written");
        assert_eq!(before(folder.path()), None);
    }

    #[tokio::test]
    async fn beyond_loopback_with_certificates_or_where_that_is_accepted() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = async |address: &str, tls: Option<PathBuf>, insecure| {
            let address = address.parse().expect("an address");
            let access = Access { tls, insecure, advertise: None };
            let door = listen(Place::At { address, access }, folder.path()).await?;
            Ok::<String, PageError>(door.expect("a page was asked for").url().to_owned())
        };
        assert!(matches!(at("0.0.0.0:0", None, false).await, Err(PageError::Insecure(_))));
        assert!(at("0.0.0.0:0", None, true).await.is_ok_and(|url| url.starts_with("http://")));
        let tls = folder.path().join("tls");
        assert!(matches!(at("0.0.0.0:0", Some(tls.clone()), false).await, Err(PageError::Tls(_))));
        crate::tls::init(&tls, &Names::default(), Validity::days(1)).expect("certificates");
        assert!(at("0.0.0.0:0", Some(tls.clone()), false).await.is_ok_and(|url| url.starts_with("https://")));
        assert!(at("127.0.0.1:0", Some(tls), false).await.is_ok_and(|url| url.starts_with("http://")));
        assert!(listen(Place::Nowhere, folder.path()).await.is_ok_and(|door| door.is_none()));
    }
}
