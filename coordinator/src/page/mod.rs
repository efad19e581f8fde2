//! The live page of a campaign: where it stands, in a browser, and the same for machines.
//!
//! Data flow one way: the coordinator's [`Shared`] state is read into a `snapshot` at most
//! once a second, whoever asks; `charts`, `parts` and `metrics` make of it what is shown; `server` hands that out:
//!
//! * `/`: the page, complete without scripts; with them its parts are renewed by the events of `/events`;
//! * `/api/status`: what `runout status --json` prints; `/metrics`: Prometheus' text format.
//!
//! Nothing can be changed through the page. On loopback it asks nobody who he is; beyond that it has the coordinator's own
//! TLS, and shows itself to who may look at the campaign.

mod address;
mod charts;
mod live;
mod metrics;
mod parts;
mod server;
mod snapshot;

pub use address::{ADDRESS_FILE, Door, PageError, Place, listen};

use crate::serve::Coordinator;
use crate::shared::Shared;
use crate::status::State;
use live::Live;
use server::Limits;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::timeout;

/// Longest wait, at the end of the campaign, for browsers to take the last state.
const FAREWELL: Duration = Duration::from_secs(2);

/// A page being served.
#[derive(Debug)]
pub struct Page {
    url: String,
    live: Arc<Live>,
    ending: watch::Sender<bool>,
    server: JoinHandle<()>,
}

impl Page {
    /// Serves the page of the campaign in the run directory `out` to who comes to `door`, and writes its address into
    /// the directory.
    ///
    /// # Errors
    /// The address cannot be written.
    pub fn start(door: Door, coordinator: &Coordinator, out: &Path) -> io::Result<Page> {
        let url = door.url().to_owned();
        address::announce(out, &url)?;
        let live = Arc::new(Live::new(&coordinator.shared, out));
        let (ending, ended) = watch::channel(false);
        let server = tokio::spawn(server::run(door, Arc::clone(&live), Limits::default(), ended));
        Ok(Page { url, live, ending, server })
    }

    /// Where it is.
    pub fn url(&self) -> &str {
        &self.url
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
