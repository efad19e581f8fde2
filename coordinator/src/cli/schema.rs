//! `runout schema`: the campaign file described, for editors and for people.

use super::{Failure, print, print_json};
use crate::schema;
use clap::Args;

/// Arguments of `runout schema`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Write it beside a campaign file and name it in that file's first line:
  runout schema > campaign.schema.json
  #:schema ./campaign.schema.json")]
pub struct SchemaArguments {
    /// Print the reference page (Markdown) instead
    #[arg(long)]
    pub page: bool,
}

/// Runs the command.
///
/// # Errors
/// Standard output cannot be written.
pub(super) fn schema(args: &SchemaArguments) -> Result<(), Failure> {
    if args.page { print(&schema::page()) } else { print_json(&schema::json()) }
}
