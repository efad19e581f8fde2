//! The user's commands, one a file.

pub mod run;
pub mod serve;
pub mod status;

use crate::load::LoadError;
use crate::local::LocalError;
use crate::serve::ServeError;
use crate::status::Status;
use std::time::Duration;
use thiserror::Error;
use tokio::runtime::Runtime;

/// A command that cannot do what was asked.
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
    /// Anything else that went wrong.
    #[error(transparent)]
    Other(#[from] anyhow::Error),
}

impl Failure {
    /// The exit code: 2 for bad input, 1 for what went wrong on the way.
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Load(_) | Failure::Local(LocalError::NoProgram(_)) => 2,
            Failure::Serve(error) => error.exit_code(),
            Failure::Local(_) | Failure::Other(_) => 1,
        }
    }
}

/// The asynchronous runtime of the commands that serve or ask.
///
/// # Errors
/// The system refuses threads.
pub fn runtime() -> Result<Runtime, ServeError> {
    Ok(tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?)
}

/// Prints the final status; returns the exit code.
pub fn finish(status: &Status, json: bool) -> u8 {
    if json {
        println!("{}", serde_json::to_string_pretty(status).expect("a status is JSON"));
    } else {
        eprint!("{}", status.text());
    }
    status.state.exit_code()
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
