//! `runout man`: manual pages, one a command, made of the help texts.

use super::{Arguments, Failure};
use clap::{Args, CommandFactory};
use std::path::PathBuf;

/// Arguments of `runout man`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
They are read with `man -l DIR/runout.1`, or by their names where DIR is a folder man1 in man's path. \
`runout-worker man DIR` writes the worker's.")]
pub struct ManArguments {
    /// Folder: made if it is not there
    #[arg(value_name = "DIR")]
    pub dir: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// The folder cannot be made or written.
pub(super) fn man(args: &ManArguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&args.dir)
        .and_then(|()| clap_mangen::generate_to(Arguments::command(), &args.dir))
        .map_err(|error| {
            Failure::Input(format!("{}: the manual pages cannot be written: {error}", args.dir.display()))
        })
}
