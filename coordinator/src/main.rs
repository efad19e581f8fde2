//! The user's command: parses, calls, maps the exit code.

use clap::{Parser, Subcommand};
use runout::cli;
use std::process::ExitCode;

#[derive(Parser)]
#[command(name = "runout", version, about = "Stochastic landslide runout")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a whole campaign on this machine
    Run(cli::run::RunArgs),
    /// Coordinate a campaign whose workers run elsewhere
    Serve(cli::serve::ServeArgs),
    /// Show where a campaign stands
    Status(cli::status::StatusArgs),
}

fn main() -> ExitCode {
    let filter = tracing_subscriber::EnvFilter::try_from_env("RUNOUT_LOG")
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("info,sled=warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let ended = match Arguments::parse().command {
        Command::Run(args) => cli::run::main(&args),
        Command::Serve(args) => cli::serve::main(&args),
        Command::Status(args) => cli::status::main(&args),
    };
    match ended {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            eprintln!("runout: {failure:#}");
            ExitCode::from(failure.exit_code())
        }
    }
}
