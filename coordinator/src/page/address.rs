//! Where the page listens: loopback unless more is accepted, and at the same port again when a campaign is continued.

use crate::store::write_atomically;
use std::fs;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use thiserror::Error;
use tokio::net::TcpListener;

/// File of a run directory that holds the page's address. It stays, so that a coordinator that continues the campaign
/// takes the same port and an open page finds it again.
pub const ADDRESS_FILE: &str = "page.addr";

/// A free port of loopback.
const ANY_PORT: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

/// Where the page shall be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Nowhere.
    Nowhere,
    /// At a port of loopback: the one it had before, or a free one.
    Usual,
    /// At this address; elsewhere than on loopback only if `insecure` is accepted.
    At {
        /// Address.
        address: SocketAddr,
        /// Whether it may be open to other machines without encryption or authentication.
        insecure: bool,
    },
}

/// A page that cannot be where it was asked for.
#[derive(Debug, Error)]
pub enum PageError {
    /// The address is open to other machines, and nothing protects it.
    #[error(
        "--page {0}: it can be reached from other machines, and the page is neither encrypted nor protected; take a \
         loopback address (and from elsewhere `ssh -L PORT:127.0.0.1:PORT HOST`), or accept that with `runout serve --insecure`"
    )]
    Insecure(SocketAddr),
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
pub async fn listen(place: Place, out: &Path) -> Result<Option<TcpListener>, PageError> {
    match place {
        Place::Nowhere => Ok(None),
        Place::At { address, insecure } if !address.ip().is_loopback() && !insecure => {
            Err(PageError::Insecure(address))
        }
        Place::At { address, .. } => {
            TcpListener::bind(address).await.map(Some).map_err(|error| PageError::Listen { address, error })
        }
        Place::Usual => {
            if let Some(before) = before(out)
                && let Ok(listener) = TcpListener::bind(before).await
            {
                return Ok(Some(listener));
            }
            let listener = TcpListener::bind(ANY_PORT).await;
            if let Err(error) = &listener {
                tracing::warn!("there is no live page: {ANY_PORT}: {error}");
            }
            Ok(listener.ok())
        }
    }
}

/// Writes the address into the run directory.
pub(super) fn announce(out: &Path, address: SocketAddr) -> io::Result<()> {
    write_atomically(&out.join(ADDRESS_FILE), format!("http://{address}/\n").as_bytes())
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

    #[tokio::test]
    async fn the_usual_place_is_the_one_before_where_it_is_free() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let usual =
            || async { listen(Place::Usual, folder.path()).await.expect("loopback").expect("a port") };
        let first = usual().await;
        let address = first.local_addr().expect("an address");
        announce(folder.path(), address).expect("it can be written");
        let taken = usual().await;
        assert_ne!(taken.local_addr().expect("an address"), address);
        drop(first);
        assert_eq!(usual().await.local_addr().expect("an address"), address);
        // Nobody is sent beyond loopback by a file.
        announce(folder.path(), "0.0.0.0:80".parse().expect("an address")).expect("it can be written");
        assert_eq!(before(folder.path()), None);
    }

    #[tokio::test]
    async fn beyond_loopback_only_if_that_is_accepted() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let address = "0.0.0.0:0".parse().expect("an address");
        let refused = listen(Place::At { address, insecure: false }, folder.path()).await;
        assert!(matches!(refused, Err(PageError::Insecure(_))));
        assert!(
            listen(Place::At { address, insecure: true }, folder.path()).await.is_ok_and(|l| l.is_some())
        );
        assert!(listen(Place::Nowhere, folder.path()).await.is_ok_and(|l| l.is_none()));
    }
}
