//! `runout completions`: what a shell needs to complete the command line.

use super::{Arguments, Failure, print};
use clap::{Args, CommandFactory};
use clap_complete::Shell;

/// Arguments of `runout completions`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
For bash: runout completions bash > ~/.local/share/bash-completion/completions/runout
For zsh: runout completions zsh > DIR/_runout, with DIR in $fpath
For fish: runout completions fish > ~/.config/fish/completions/runout.fish
`runout-worker completions SHELL` does the same for the worker.")]
pub struct CompletionsArguments {
    /// Shell
    pub shell: Shell,
}

/// Runs the command.
///
/// # Errors
/// Standard output cannot be written.
pub(super) fn completions(args: &CompletionsArguments) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Arguments::command(), "runout", &mut text);
    print(&String::from_utf8_lossy(&text))
}
