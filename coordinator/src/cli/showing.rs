//! What `run` and `serve` show while they coordinate: the live page and the logs.

use super::{Failure, say};
use crate::listen::Access;
use crate::page::{self, Door, Page, PageError, Place};
use crate::serve::{Coordinator, ServeError};
use clap::Args;
use runout_proto::logging::LogFormat;
use std::net::SocketAddr;
use std::path::Path;

/// What to show.
#[derive(Debug, Clone, Args)]
pub struct Showing {
    /// Address of the live page [default: a port of loopback, the same one when a campaign is continued]; it is
    /// written to page.addr. Beyond loopback it needs --tls, and browsers the operator's certificate
    #[arg(long, value_name = "ADDR", conflicts_with = "no_page")]
    pub page: Option<SocketAddr>,
    /// Serve no live page
    #[arg(long)]
    pub no_page: bool,
    /// How logs are written to standard error: text, or json (an object a line)
    #[arg(long, value_name = "text|json", default_value = "text")]
    pub log_format: LogFormat,
}

impl Showing {
    /// Listens for the live page of the run directory `out`, on more than loopback as `access` has it.
    ///
    /// # Errors
    /// The address that was asked for cannot be had.
    pub async fn listen(&self, out: &Path, access: &Access) -> Result<Option<Door>, Failure> {
        let place = match (self.page, self.no_page) {
            (_, true) => Place::Nowhere,
            (None, false) => Place::Usual,
            (Some(address), false) => Place::At { address, access: access.clone() },
        };
        Ok(page::listen(place, out).await.map_err(ServeError::from)?)
    }
}

/// Starts the live page, where there is one, and says where it is.
///
/// # Errors
/// Its address cannot be written into the run directory.
pub fn start(door: Option<Door>, coordinator: &Coordinator, out: &Path) -> Result<Option<Page>, Failure> {
    let Some(door) = door else { return Ok(None) };
    let page =
        Page::start(door, coordinator, out).map_err(|error| ServeError::from(PageError::Announce(error)))?;
    say(&format!("live page: {}\n", page.url()));
    Ok(Some(page))
}
