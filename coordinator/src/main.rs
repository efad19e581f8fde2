//! The user's command: parses, calls, maps the exit code.

use clap::Parser;
use runout::cli::{self, Arguments, Ending, Failure};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    cli::start_logging();
    match cli::execute(arguments.command) {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::NotConverged) => ExitCode::from(3),
        Ok(Ending::Interrupted) => ExitCode::from(130),
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(match failure {
                Failure::Input(_) => 2,
                Failure::Work(_) => 1,
            })
        }
    }
}
