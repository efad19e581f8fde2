//! The commands, one a file, and what they share: arguments, failures, exit codes, printing.

mod analysis;
mod bench;
pub mod cancel;
mod check;
mod completions;
mod connect;
mod explain;
mod field;
mod fit;
mod init;
mod man;
mod pictures;
mod replay;
mod report;
mod results;
mod retry;
pub mod run;
mod run_records;
mod schema;
pub mod serve;
pub mod showing;
mod simulate;
pub mod status;
mod submit;
pub mod tls;
mod validate;
mod verify;
mod workers;

use crate::load::LoadError;
use crate::local::LocalError;
pub use crate::progress::say;
use crate::serve::ServeError;
use crate::submit::SubmitError;
use clap::builder::styling::{AnsiColor, Styles};
use clap::{Parser, Subcommand};
use runout_proto::logging::LogFormat;
use serde::Serialize;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;
use thiserror::Error;
use tokio::runtime::Runtime;

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 failed, 2 bad usage or bad input, 3 stopped at the maximum number of realisations \
without convergence, 130 interrupted (resumable).
Environment: RUST_LOG sets what is logged (error, warn, info, debug), NO_COLOR turns colours off, \
RUNOUT_KERNEL forces a build of the solver's kernels (baseline, avx2, avx512), RUNOUT_TLS names a directory with \
certificates as --tls does.";

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold())
    .literal(AnsiColor::Cyan.on_default().bold())
    .placeholder(AnsiColor::Cyan.on_default());

/// From a table of soil tests and a slope to the exceedance of its landslide's runout.
///
/// Fits distributions and a copula to measured properties, carries many random realisations of the slope through
/// failure to rest, and reports how far they run, with intervals. Every number follows from the campaign's seed.
#[derive(Debug, Parser)]
#[command(name = "runout", version, after_help = EXIT_CODES, styles = STYLES, arg_required_else_help = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// A command with its arguments.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented example campaign and its data into a new directory
    Init(init::InitArguments),
    /// Validate a campaign file and print what follows from it: size, time step, memory, time
    Check(check::CheckArguments),
    /// Fit marginals and copulas to the site data and print them as tables
    Fit(fit::FitArguments),
    /// Write one realisation's random fields as CSV, VTU or PNG
    Field(field::FieldArguments),
    /// Run one analysis: a realisation, or the slope with mean properties
    Simulate(simulate::SimulateArguments),
    /// Measure the speed of fields and solver on one core of this machine
    Bench(bench::BenchArguments),
    /// Run a whole campaign on this machine
    Run(run::RunArgs),
    /// Coordinate a campaign whose workers run elsewhere
    Serve(serve::ServeArgs),
    /// Hand a campaign to a batch system
    Submit(submit::SubmitArgs),
    /// Show where a campaign stands
    Status(status::StatusArgs),
    /// End a running campaign in good order; its run directory can be resumed
    Cancel(cancel::CancelArgs),
    /// Make and show certificates for coordinator, workers and operators
    #[command(subcommand)]
    Tls(tls::TlsCommand),
    /// Print every outcome of a run directory, in index order, or write it as Parquet
    Results(results::ResultsArguments),
    /// Write report.html, self-contained, and its figures into a run directory
    Report(report::ReportArguments),
    /// Re-run one stored realisation from its seed and check that the bits are the same
    Replay(replay::ReplayArguments),
    /// Check that a run directory holds together; re-run a sample of it
    Verify(verify::VerifyArguments),
    /// Tell the history of one realisation: attempts, workers, losses, outcome
    Explain(explain::ExplainArguments),
    /// Show what each worker did: realisations, speed, losses, conflicts
    Workers(workers::WorkersArguments),
    /// Re-open failed realisations, so that the next session runs them again
    Retry(retry::RetryArguments),
    /// Run the validation suite: closed-form solutions and benchmarks against this machine's solver
    Validate(validate::ValidateArguments),
    /// Print a JSON schema of the campaign file for editors, or its reference page
    Schema(schema::SchemaArguments),
    /// Print completions for a shell
    Completions(completions::CompletionsArguments),
    /// Write the manual pages of all commands into a folder
    Man(man::ManArguments),
}

impl Command {
    /// How its logs are written.
    pub fn log_format(&self) -> LogFormat {
        match self {
            Command::Run(arguments) => arguments.showing.log_format,
            Command::Serve(arguments) => arguments.showing.log_format,
            _ => LogFormat::Text,
        }
    }
}

/// A command that cannot do what was asked; the message is made for the user.
#[derive(Debug, Error)]
pub enum Failure {
    /// The campaign cannot be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// It cannot be served.
    #[error(transparent)]
    Serve(#[from] ServeError),
    /// Local workers cannot be started.
    #[error(transparent)]
    Local(#[from] LocalError),
    /// It cannot be submitted.
    #[error(transparent)]
    Submit(#[from] SubmitError),
    /// Bad usage or bad input.
    #[error("{0}")]
    Input(String),
    /// The work itself failed.
    #[error("{0}")]
    Work(String),
    /// Anything else that went wrong.
    #[error(transparent)]
    Other(#[from] anyhow::Error),
}

impl Failure {
    /// A failure of the work: `what` was being done when `error` came.
    pub fn work(what: impl Display, error: impl Display) -> Failure {
        Failure::Work(format!("{what}: {error}"))
    }

    /// The exit code: 2 for bad input, 1 for what went wrong on the way.
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Load(_) | Failure::Input(_) | Failure::Local(LocalError::NoProgram(_)) => 2,
            Failure::Serve(error) => error.exit_code(),
            Failure::Submit(error) => error.exit_code(),
            Failure::Local(_) | Failure::Work(_) | Failure::Other(_) => 1,
        }
    }
}

/// Exit code of a command that did what was asked.
const DONE: u8 = 0;

/// Runs a command; returns the exit code.
///
/// # Errors
/// [`Failure`], with the message for the user.
pub fn execute(command: Command) -> Result<u8, Failure> {
    let done = match command {
        Command::Init(arguments) => init::init(&arguments),
        Command::Check(arguments) => check::check(&arguments),
        Command::Fit(arguments) => fit::fit(&arguments),
        Command::Field(arguments) => field::field(&arguments),
        Command::Simulate(arguments) => simulate::simulate(&arguments),
        Command::Bench(arguments) => bench::bench(&arguments),
        Command::Run(arguments) => return run::main(&arguments),
        Command::Serve(arguments) => return serve::main(&arguments),
        Command::Submit(arguments) => submit::submit(&arguments),
        Command::Status(arguments) => return status::main(&arguments),
        Command::Cancel(arguments) => cancel::main(&arguments),
        Command::Tls(command) => tls::main(&command),
        Command::Results(arguments) => results::results(&arguments),
        Command::Report(arguments) => report::report(&arguments),
        Command::Replay(arguments) => replay::replay(&arguments),
        Command::Verify(arguments) => return verify::verify(&arguments),
        Command::Explain(arguments) => explain::explain(&arguments),
        Command::Workers(arguments) => workers::workers(&arguments),
        Command::Retry(arguments) => retry::retry(&arguments),
        Command::Validate(arguments) => return validate::validate(&arguments),
        Command::Schema(arguments) => schema::schema(&arguments),
        Command::Completions(arguments) => completions::completions(&arguments),
        Command::Man(arguments) => man::man(&arguments),
    };
    done.map(|()| DONE)
}

/// Prints `text` to standard output; a reader that has gone away (`runout results DIR | head`) is no failure.
///
/// # Errors
/// Standard output cannot be written, for example because the disk is full.
pub fn print(text: &str) -> Result<(), Failure> {
    print_while_read(text).map(|_| ())
}

/// As [`print()`]; false if the reader has gone away.
///
/// # Errors
/// As [`print()`].
pub fn print_while_read(text: &str) -> Result<bool, Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(e) => Err(Failure::work("standard output", e)),
    }
}

/// Prints one JSON document to standard output.
///
/// # Errors
/// Standard output cannot be written.
pub fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    print(&json_text(document)?)
}

/// A JSON document for people and programs.
///
/// # Errors
/// What cannot be JSON.
pub fn json_text(document: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(document).map_err(|e| Failure::work("JSON", e))?;
    Ok(text + "\n")
}

/// The asynchronous runtime of the commands that serve or ask.
///
/// # Errors
/// The system refuses threads.
pub fn runtime() -> Result<Runtime, ServeError> {
    Ok(tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?)
}

/// Some indices for people: the first ones, and that there are more.
fn some_of(indices: &[u64]) -> String {
    const MOST: usize = 20;
    let shown: Vec<String> = indices.iter().take(MOST).map(u64::to_string).collect();
    shown.join(", ") + if indices.len() > MOST { ", ..." } else { "" }
}

/// An index from the command line.
///
/// # Errors
/// It is no whole number from 0.
pub fn index(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "it must be a whole number from 0".to_owned())
}

/// Writes a file that the user asked for; one that cannot be written where asked is bad input.
///
/// # Errors
/// The system refuses.
pub fn write_asked(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes)
        .map_err(|e| Failure::Input(format!("{}: it cannot be written: {e}", path.display())))
}

/// A positive time from the command line, s.
///
/// # Errors
/// It is none, or longer than a day.
pub fn seconds(text: &str) -> Result<Duration, String> {
    const LONGEST_S: f64 = 86_400.0;
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= LONGEST_S => Ok(Duration::from_secs_f64(value)),
        _ => Err(format!("it must be a number of seconds, greater than 0 and at most {LONGEST_S}")),
    }
}
