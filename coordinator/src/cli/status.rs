//! `runout status`: where a campaign stands, from its coordinator or from its run directory.

use super::{Failure, json_text, print_while_read, runtime};
use crate::run_directory;
use crate::status::{self, State, Status};
use anyhow::Context;
use clap::Args;
use runout_proto::v1::StatusRequest;
use runout_proto::v1::coordinator_client::CoordinatorClient;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::time::Duration;
use tonic::transport::Endpoint;

/// How long a coordinator may take to answer.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);
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
}

/// Runs the command; returns the exit code.
///
/// # Errors
/// Neither coordinator nor run directory can be read.
pub fn main(args: &StatusArgs) -> Result<u8, Failure> {
    runtime()?.block_on(async {
        loop {
            let status = look(&args.target).await?;
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

async fn look(target: &str) -> Result<Status, Failure> {
    if target.starts_with("http://") || target.starts_with("https://") {
        return Ok(ask(target).await.with_context(|| format!("{target}: no coordinator answers"))?);
    }
    let path = Path::new(target);
    let frame = run_directory::read_frame(path).map_err(|e| Failure::Input(e.to_string()))?;
    if let Some(url) = frame.address
        && let Ok(status) = ask(&url).await
        && status.digest == frame.spec.digest()
    {
        return Ok(status);
    }
    Ok(status::of_directory(path)?)
}

async fn ask(url: &str) -> anyhow::Result<Status> {
    let endpoint = Endpoint::from_shared(url.to_owned())?.connect_timeout(ANSWER_LIMIT).timeout(ANSWER_LIMIT);
    let mut client = CoordinatorClient::new(endpoint.connect().await?);
    let reply = client.status(StatusRequest {}).await?.into_inner();
    Ok(serde_json::from_str(&reply.json)?)
}
