//! `runout run`: the whole campaign on this machine, coordinator here and workers as processes of their own.

use super::serve::{Tuning, finish};
use super::showing::Showing;
use super::tls::TlsArgument;
use super::{Failure, runtime, showing};
use crate::listen::{Access, Listener};
use crate::load;
use crate::local::{self, Crew};
use crate::serve::{self, ServeError};
use clap::Args;
use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::sync::watch;

/// Arguments of `runout run`.
#[derive(Debug, Clone, Args)]
pub struct RunArgs {
    /// Campaign file
    pub campaign: PathBuf,
    /// Run directory: made anew, or continued if it holds this campaign
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Worker processes, one realisation at a time each [default: the number of cores]
    #[arg(long, value_name = "N")]
    pub workers: Option<NonZeroUsize>,
    /// Address on which the workers find the coordinator
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:0")]
    pub listen: SocketAddr,
    /// Encrypt, and let in only who has a certificate; needed where other machines can connect
    #[command(flatten)]
    pub tls: TlsArgument,
    /// The worker program, if it is not beside this one
    #[arg(long, value_name = "FILE")]
    pub worker_program: Option<PathBuf>,
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

/// Runs the command; returns the exit code.
///
/// # Errors
/// What cannot be done.
pub fn main(args: &RunArgs) -> Result<u8, Failure> {
    let loaded = load::load(&args.campaign)?;
    let program = local::worker_program(args.worker_program.as_deref())?;
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let count = args.workers.map_or(cores, NonZeroUsize::get);
    runtime()?.block_on(async {
        let options = args.tuning.options();
        let interrupts = serve::interruptions().map_err(ServeError::from)?;
        let tls = args.tls.folder().map(Path::to_owned);
        // Workers of this machine only: anything beyond loopback is for `runout serve`, or protected.
        let access = Access { tls: tls.clone(), ..Access::default() };
        let listener = Listener::bind(args.listen, &access).await.map_err(ServeError::from)?;
        let page = args.showing.listen(&args.out, &access).await?;
        let mut coordinator = serve::open(&loaded, &args.out, &options)?;
        if coordinator.has_ended() {
            return finish(&coordinator.shared.status(), &args.out, args.json);
        }
        coordinator.page = showing::start(page, &coordinator, &args.out)?;
        let crew = Crew {
            program,
            url: listener.local_url().to_owned(),
            spool: coordinator.directory.spool(),
            tls,
            log_format: args.showing.log_format,
        };
        let (stop, stopped) = watch::channel(false);
        let shared = Arc::downgrade(&coordinator.shared);
        let mut workers = tokio::spawn(local::keep_running(crew, count, shared, stopped));

        let serving = serve::serve(listener, coordinator, &options, interrupts);
        tokio::pin!(serving);
        let ended = tokio::select! {
            ended = &mut serving => ended,
            // Workers leave in order only because the coordinator told them to: it ends by itself then.
            left = &mut workers => match left.map_err(anyhow::Error::from)? {
                Ok(()) => serving.await,
                Err(error) => return Err(error.into()),
            },
        };
        // Nobody listens if the workers have left.
        let _ = stop.send(true);
        if !workers.is_finished() {
            workers.await.map_err(anyhow::Error::from)?.ok();
        }
        finish(&ended?, &args.out, args.json)
    })
}
