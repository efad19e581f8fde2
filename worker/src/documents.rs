//! What is made of the command line's own description: the manual page and completions for shells.
//!
//! Beside [`Options`], whose required flags they do not need.

use crate::options::Options;
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, Parser)]
#[command(name = "runout-worker")]
struct Arguments {
    #[command(subcommand)]
    document: Document,
}

#[derive(Debug, Subcommand)]
enum Document {
    /// Print completions for a shell
    Completions {
        /// Shell
        shell: Shell,
    },
    /// Write the manual page into a folder
    Man {
        /// Folder: made if it is not there
        #[arg(value_name = "DIR")]
        dir: PathBuf,
    },
}

/// Writes the document that the command line asks for, if it does, and gives the exit code.
pub(crate) fn asked_for() -> Option<ExitCode> {
    let first = std::env::args().nth(1)?;
    if !["completions", "man"].contains(&first.as_str()) {
        return None;
    }
    let written = match Arguments::parse().document {
        Document::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Options::command(), "runout-worker", &mut text);
            io::stdout().write_all(&text)
        }
        Document::Man { dir } => std::fs::create_dir_all(&dir)
            .and_then(|()| clap_mangen::generate_to(Options::command(), &dir))
            .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", dir.display()))),
    };
    Some(match written {
        Ok(()) => ExitCode::SUCCESS,
        // `runout-worker completions bash | head`: the reader has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            // There is no better place to complain.
            let _ = writeln!(io::stderr(), "runout-worker: {error}");
            ExitCode::FAILURE
        }
    })
}
