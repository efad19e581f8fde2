//! `runout check`: validates a campaign and prints what follows from it.

use super::{Ending, Failure, print};
use crate::load;
use clap::Args;
use std::path::PathBuf;

/// `runout check CAMPAIGN [--json]`
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Campaign file
    campaign: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(super) fn check(arguments: &CheckArguments) -> Result<Ending, Failure> {
    let loaded = load::load(&arguments.campaign)?;
    print(&format!("{}: sound; spec {}\n", arguments.campaign.display(), loaded.spec.digest()))?;
    Ok(Ending::Done)
}
