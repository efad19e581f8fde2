//! `runout serve`: the coordinator only; workers come from elsewhere.

use super::showing::{self, Showing};
use super::tls::TlsArgument;
use super::{Failure, print, print_json, runtime, say, seconds};
use crate::listen::{Access, Advertised, Listener};
use crate::load;
use crate::serve::{self, Options, ServeError};
use crate::status::Status;
use clap::Args;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Arguments of `runout serve`.
#[derive(Debug, Clone, Args)]
pub struct ServeArgs {
    /// Campaign file
    pub campaign: PathBuf,
    /// Run directory: made anew, or continued if it holds this campaign
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Address to listen on; port 0 takes a free one (it is written to coordinator.addr)
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:7421")]
    pub listen: SocketAddr,
    /// Address for others, written to coordinator.addr: where it is not the one listened on [default: the address
    /// listened on, or this machine's name where that is every interface]
    #[arg(long, value_name = "HOST[:PORT]")]
    pub advertise: Option<Advertised>,
    /// Encrypt, and let in only who has a certificate
    #[command(flatten)]
    pub tls: TlsArgument,
    /// Listen where other machines can connect, without encryption or authentication
    #[arg(long)]
    pub insecure: bool,
    /// Print the final status as JSON
    #[arg(long)]
    pub json: bool,
    /// What to show
    #[command(flatten)]
    pub showing: Showing,
    /// How to coordinate
    #[command(flatten)]
    pub tuning: Tuning,
}

/// Settings of a coordinator that rarely change.
#[derive(Debug, Clone, Args)]
pub struct Tuning {
    /// Time between a worker's heartbeats; three missed ones make it lost
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = seconds)]
    pub heartbeat: Duration,
    /// When interrupted, time for running realisations to finish
    #[arg(long, value_name = "SECONDS", default_value = "20", value_parser = seconds)]
    pub grace: Duration,
    /// Time without a step after which a realisation counts as hung and is given to another worker; longer where
    /// realisations usually take longer
    #[arg(long, value_name = "SECONDS", default_value = "120", value_parser = seconds)]
    pub hang: Duration,
}

impl Tuning {
    /// As the server takes them.
    pub fn options(&self) -> Options {
        Options { heartbeat: self.heartbeat, grace: self.grace, hang: self.hang }
    }
}

/// Runs the command; returns the exit code.
///
/// # Errors
/// What cannot be done.
pub fn main(args: &ServeArgs) -> Result<u8, Failure> {
    let loaded = load::load(&args.campaign)?;
    runtime()?.block_on(async {
        let options = args.tuning.options();
        let interrupts = serve::interruptions().map_err(ServeError::from)?;
        let tls = args.tls.folder().map(Path::to_owned);
        let access = Access { tls, insecure: args.insecure, advertise: args.advertise.clone() };
        let listener = Listener::bind(args.listen, &access).await.map_err(ServeError::from)?;
        let page = args.showing.listen(&args.out, &access).await?;
        let mut coordinator = serve::open(&loaded, &args.out, &options)?;
        if coordinator.has_ended() {
            return finish(&coordinator.shared.status(), &args.out, args.json);
        }
        coordinator.page = showing::start(page, &coordinator, &args.out)?;
        say(&format!("listening on {}\n", listener.url()));
        let status = serve::serve(listener, coordinator, &options, interrupts).await?;
        finish(&status, &args.out, args.json)
    })
}

/// Prints how the campaign in `out` stands at the end; returns the exit code.
pub(super) fn finish(status: &Status, out: &Path, json: bool) -> Result<u8, Failure> {
    if json {
        print_json(status)?
    } else {
        print(&status.summary(out))?
    }
    Ok(status.state.exit_code())
}
