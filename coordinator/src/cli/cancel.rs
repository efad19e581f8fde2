//! `runout cancel`: ends a running campaign in good order.

use super::connect::{self, AskError, connect, connect_as_announced, is_url};
use super::tls::TlsArgument;
use super::{Failure, print, runtime};
use crate::run_directory;
use clap::Args;
use runout_proto::v1::coordinator_client::CoordinatorClient;
use runout_proto::v1::{CancelReply, CancelRequest};
use std::path::Path;
use tonic::transport::Channel;

/// Arguments of `runout cancel`.
#[derive(Debug, Clone, Args)]
pub struct CancelArgs {
    /// Run directory with a coordinator at work, or URL of one
    #[arg(value_name = "DIR-or-URL")]
    pub target: String,
    /// Certificates for https://
    #[command(flatten)]
    pub tls: TlsArgument,
}

/// Runs the command.
///
/// # Errors
/// No coordinator is at work, or it refuses.
pub fn main(args: &CancelArgs) -> Result<(), Failure> {
    let reply = runtime()?.block_on(cancel(args))?;
    print(&match reply.state.as_str() {
        "running" => format!(
            "{}: no new realisations; running ones have {} s to finish, then the coordinator leaves (resumable)\n",
            args.target, reply.grace_s
        ),
        state => {
            format!("{}: the campaign is over ({state}); its coordinator is about to leave\n", args.target)
        }
    })
}

async fn cancel(args: &CancelArgs) -> Result<CancelReply, Failure> {
    let failed = |error: AskError| match error {
        AskError::Away(_) => Failure::Work(format!("{}: {error}: there is nothing to cancel", args.target)),
        _ => Failure::Input(format!("{}: {error}", args.target)),
    };
    let (client, spec_digest) = if is_url(&args.target) {
        (connect(&args.target, args.tls.folder()).map_err(failed)?, None)
    } else {
        let path = Path::new(&args.target);
        let (url, digest) = run_directory::announced(path).map_err(|e| Failure::Input(e.to_string()))?;
        let nobody = || {
            Failure::Work(format!(
                "{}: no coordinator works on this run directory: nothing to cancel",
                args.target
            ))
        };
        let url = url.ok_or_else(nobody)?;
        (connect_as_announced(&url, path, args.tls.folder()).await.map_err(failed)?, Some(digest))
    };
    let request = CancelRequest { spec_digest };
    let call = |mut grpc: CoordinatorClient<Channel>| {
        let request = request.clone();
        async move { grpc.cancel(request).await }
    };
    connect::ask(&client, call).await.map_err(failed)
}
