//! `runout status`: where a campaign stands, from its coordinator or from its run directory.

use super::connect::{self, AskError, connect, connect_as_announced, is_url};
use super::tls::TlsArgument;
use super::{DONE, Failure, print, print_json, print_while_read, runtime, seconds};
use crate::run_directory;
use crate::status::{self, State, Status};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use runout_proto::v1::StatusRequest;
use runout_proto::v1::coordinator_client::CoordinatorClient;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::time::{Duration, Instant};
use tonic::transport::Channel;

/// A coordinator that was there may be silent for this long before a watcher gives up: it is being restarted.
const PATIENCE: Duration = Duration::from_secs(30);

/// Arguments of `runout status`.
#[derive(Debug, Clone, Args)]
pub struct StatusArgs {
    /// Run directory, or URL of a coordinator
    #[arg(value_name = "DIR-or-URL")]
    pub target: String,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Look again and again until the campaign does not run any more; end with its exit code
    #[arg(long)]
    pub watch: bool,
    /// With --watch: time between two looks
    #[arg(long, value_name = "SECONDS", default_value = "2", value_parser = seconds, requires = "watch")]
    pub every: Duration,
    /// Certificates for https://
    #[command(flatten)]
    pub tls: TlsArgument,
}

/// Runs the command; returns the exit code: with `--watch` that of the campaign's end.
///
/// # Errors
/// Neither coordinator nor run directory can be read.
pub fn main(args: &StatusArgs) -> Result<u8, Failure> {
    runtime()?.block_on(async {
        if args.watch {
            return watch(args).await;
        }
        let status = look(args).await?;
        if args.json {
            print_json(&status)?
        } else {
            print(&status.text())?
        };
        Ok(DONE)
    })
}

/// Looks until the campaign does not run any more, or nobody reads what is printed.
async fn watch(args: &StatusArgs) -> Result<u8, Failure> {
    let mut screen = Screen::new(args.json);
    let mut heard: Option<Instant> = None;
    loop {
        match look(args).await {
            Ok(status) => {
                heard = Some(Instant::now());
                let read = screen.show(&status)?;
                if status.state != State::Running {
                    return Ok(status.state.exit_code());
                }
                if !read {
                    return Ok(DONE);
                }
            }
            Err(error) => match heard {
                None => return Err(error),
                Some(heard) if heard.elapsed() > PATIENCE => {
                    return Err(Failure::Work(format!(
                        "{error:#}; it was there before: it has ended or is out of reach, and its run directory tells \
                         more (`runout status DIR`)"
                    )));
                }
                Some(_) => {}
            },
        }
        tokio::time::sleep(args.every).await;
    }
}

/// Where a watcher shows what it sees.
enum Screen {
    /// On a terminal: drawn over each time, however it is wrapped.
    Terminal(ProgressBar),
    /// Elsewhere: everything at first and at the end, a line for every advance between.
    Lines { realisations: Option<u64> },
    /// JSON, a document a line.
    Json,
}

impl Screen {
    fn new(json: bool) -> Screen {
        if json {
            return Screen::Json;
        }
        if !io::stdout().is_terminal() {
            return Screen::Lines { realisations: None };
        }
        let screen = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout());
        screen.set_style(ProgressStyle::with_template("{msg}").expect("the template is sound"));
        Screen::Terminal(screen)
    }

    /// Shows where the campaign stands; false if nobody reads it any more.
    fn show(&mut self, status: &Status) -> Result<bool, Failure> {
        let running = status.state == State::Running;
        match self {
            Screen::Terminal(screen) => {
                screen.set_message(status.text().trim_end().to_owned());
                if !running {
                    screen.finish();
                }
                Ok(true)
            }
            Screen::Json => {
                let line = serde_json::to_string(status).map_err(|e| Failure::work("JSON", e))?;
                print_while_read(&(line + "\n"))
            }
            Screen::Lines { realisations } => {
                let before = realisations.replace(status.realisations);
                match before {
                    Some(before) if running && before == status.realisations => Ok(true),
                    Some(_) if running => print_while_read(&(status.lines().join("; ") + "\n")),
                    _ => print_while_read(&status.text()),
                }
            }
        }
    }
}

async fn look(args: &StatusArgs) -> Result<Status, Failure> {
    let (target, tls) = (args.target.as_str(), args.tls.folder());
    let failed = |error: AskError| match error {
        AskError::Away(_) => Failure::Work(format!(
            "{target}: {error}; the address is the one in coordinator.addr, not that of the live page; without a coordinator \
             name the run directory"
        )),
        _ => Failure::Input(format!("{target}: {error}")),
    };
    if is_url(target) {
        return ask(connect(target, tls).map_err(failed)?).await.map_err(failed);
    }
    let path = Path::new(target);
    let frame = run_directory::read_frame(path).map_err(|e| Failure::Input(e.to_string()))?;
    if let Some(url) = frame.address {
        let asked = match connect_as_announced(&url, path, tls).await {
            Ok(client) => ask(client).await,
            Err(error) => Err(error),
        };
        match asked {
            Ok(status) if status.digest == frame.spec.digest() => return Ok(status),
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
