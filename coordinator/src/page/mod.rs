//! The live page of a campaign: where it stands, in a browser, and the same for machines.
//!
//! Data flow one way: the coordinator's [`Shared`] state is read into a `snapshot` at most
//! once a second, whoever asks; `charts`, `parts` and `metrics` make of it what is shown; `server` hands that out:
//!
//! * `/`: the page, complete without scripts; with them its parts are renewed by the events of `/events`;
//! * `/api/status`: what `runout status --json` prints; `/metrics`: Prometheus' text format.
//!
//! Nothing can be changed through the page. It listens on loopback only: beyond that it needs what the coordinator's own
//! address needs.

mod address;
mod charts;
mod live;
mod metrics;
mod parts;
mod server;
mod snapshot;

pub use address::{ADDRESS_FILE, PageError, Place, listen};

use crate::serve::Coordinator;
use crate::service::Shared;
use crate::status::State;
use live::Live;
use server::Limits;
use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::timeout;

/// Longest wait, at the end of the campaign, for browsers to take the last state.
const FAREWELL: Duration = Duration::from_secs(2);

/// A page being served.
#[derive(Debug)]
pub struct Page {
    address: SocketAddr,
    live: Arc<Live>,
    ending: watch::Sender<bool>,
    server: JoinHandle<()>,
}

impl Page {
    /// Serves the page of the campaign in the run directory `out` to who connects to `listener`, and writes its address
    /// into the directory.
    ///
    /// # Errors
    /// The address cannot be found out or written.
    pub fn start(listener: TcpListener, coordinator: &Coordinator, out: &Path) -> io::Result<Page> {
        let address = listener.local_addr()?;
        address::announce(out, address)?;
        let live = Arc::new(Live::new(&coordinator.shared, out));
        let (ending, ended) = watch::channel(false);
        let server = tokio::spawn(server::run(listener, Arc::clone(&live), Limits::default(), ended));
        Ok(Page { address, live, ending, server })
    }

    /// Where it is.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Shows that the campaign has ended in `state`, to who looks at it, and stops serving.
    pub async fn end(mut self, shared: &Arc<Shared>, state: State) {
        self.live.end(shared, state).await;
        self.ending.send_replace(true);
        // A browser that does not take it has lost nothing but a last look.
        let _ = timeout(FAREWELL, &mut self.server).await;
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.server.abort();
    }
}
