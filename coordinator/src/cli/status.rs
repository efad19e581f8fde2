//! `runout status`: where a campaign stands, from its coordinator or from its run directory.

use super::connect::{self, AskError, connect, connect_as_announced, is_url};
use super::tls::TlsArgument;
use super::{Failure, json_text, print_while_read, runtime};
use crate::run_directory;
use crate::status::{self, State, Status};
use clap::Args;
use runout_proto::v1::StatusRequest;
use runout_proto::v1::coordinator_client::CoordinatorClient;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::time::Duration;
use tonic::transport::Channel;

/// Time between two looks with `--watch`.
const WATCH_PERIOD: Duration = Duration::from_secs(2);

/// Moves a terminal's cursor to its upper left corner and clears what is below.
const CLEAR: &str = "\x1b[H\x1b[J";

/// Arguments of `runout status`.
#[derive(Debug, Clone, Args)]
pub struct StatusArgs {
    /// Run directory, or URL of a coordinator
    #[arg(value_name = "DIR-or-URL")]
    pub target: String,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Look again every two seconds until the campaign does not run any more
    #[arg(long)]
    pub watch: bool,
    /// Certificates for https://
    #[command(flatten)]
    pub tls: TlsArgument,
}

/// Runs the command; returns the exit code.
///
/// # Errors
/// Neither coordinator nor run directory can be read.
pub fn main(args: &StatusArgs) -> Result<u8, Failure> {
    runtime()?.block_on(async {
        loop {
            let status = look(args).await?;
            let redraws = args.watch && !args.json && io::stdout().is_terminal();
            let text = if args.json { json_text(&status)? } else { status.text() };
            let read = print_while_read(&(if redraws { CLEAR } else { "" }.to_owned() + &text))?;
            if !read {
                return Ok(0);
            }
            if !args.watch || status.state != State::Running {
                return Ok(0);
            }
            tokio::time::sleep(WATCH_PERIOD).await;
        }
    })
}

async fn look(args: &StatusArgs) -> Result<Status, Failure> {
    let (target, tls) = (args.target.as_str(), args.tls.folder());
    let failed = |error: AskError| match error {
        AskError::Away(_) => Failure::Work(format!("{target}: {error}")),
        _ => Failure::Input(format!("{target}: {error}")),
    };
    if is_url(target) {
        return ask(connect(target, tls).map_err(failed)?).await.map_err(failed);
    }
    let path = Path::new(target);
    let view = run_directory::read(path).map_err(|e| Failure::Input(e.to_string()))?;
    if let Some(url) = view.address {
        let asked = match connect_as_announced(&url, tls).await {
            Ok(client) => ask(client).await,
            Err(error) => Err(error),
        };
        match asked {
            Ok(status) if status.digest == view.spec.digest() => return Ok(status),
            // Another coordinator listens there now, or none: the files tell.
            Ok(_) | Err(AskError::Away(_)) => {}
            // Somebody is at work, and the files would say that nobody is.
            Err(error) => return Err(failed(error)),
        }
    }
    Ok(status::of_directory(path)?)
}

async fn ask(client: CoordinatorClient<Channel>) -> Result<Status, AskError> {
    let reply = connect::ask(&client, |mut grpc| async move { grpc.status(StatusRequest {}).await }).await?;
    Status::from_peer(&reply.json)
        .map_err(|e| AskError::Refused(format!("its answer cannot be understood: {e}")))
}
