//! The user's command: parses, calls, maps the exit code.

use clap::Parser;
use runout::cli::{self, Arguments};
use runout::logs;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    logs::start(arguments.command.log_format());
    match cli::execute(arguments.command) {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            // The alternate form tells the whole chain of causes.
            cli::say(&format!("error: {failure:#}\n"));
            ExitCode::from(failure.exit_code())
        }
    }
}
