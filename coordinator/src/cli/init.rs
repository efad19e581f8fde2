//! `runout init`: writes a commented example campaign and its data.

use super::{Failure, print, print_json};
use clap::{Args, ValueEnum};
use include_dir::{Dir, include_dir};
use serde::Serialize;
use std::path::PathBuf;

static ELKHORN_RIVER: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../campaigns/elkhorn-river");
static SALT_CREEK: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../campaigns/salt-creek");
static LAYERED_SLOPE: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../campaigns/layered-slope");
static QUICK: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../campaigns/quick");

/// `runout init DIR [--example NAME] [--json]`
#[derive(Debug, Args)]
pub struct InitArguments {
    /// Directory to write into; made if it is not there
    dir: PathBuf,
    /// Which example to write
    #[arg(long, value_enum, default_value = "elkhorn-river")]
    example: Example,
    /// Print the files written as one JSON document
    #[arg(long)]
    json: bool,
}

/// The names of this document are a contract.
#[derive(Debug, Serialize)]
struct Document {
    campaign: String,
    files: Vec<String>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Example {
    /// Cohesion and friction angle of 25 tests (two random properties)
    ElkhornRiver,
    /// Cohesion, friction angle and unit weight of 42 tests (three random properties)
    SaltCreek,
    /// A surveyed section of two layers with a water table and a wall (given distributions)
    LayeredSlope,
    /// The Elkhorn River data on a coarse slope: a campaign in about two minutes
    Quick,
}

impl Example {
    fn files(self) -> &'static Dir<'static> {
        match self {
            Example::ElkhornRiver => &ELKHORN_RIVER,
            Example::SaltCreek => &SALT_CREEK,
            Example::LayeredSlope => &LAYERED_SLOPE,
            Example::Quick => &QUICK,
        }
    }
}

pub(super) fn init(arguments: &InitArguments) -> Result<(), Failure> {
    let dir = &arguments.dir;
    let fault = |path: &std::path::Path, e: std::io::Error| Failure::work(path.display(), e);
    let targets: Vec<(PathBuf, &[u8])> = arguments
        .example
        .files()
        .files()
        .map(|file| (dir.join(file.path().file_name().unwrap_or_default()), file.contents()))
        .collect();
    if let Some((present, _)) = targets.iter().find(|(path, _)| path.exists()) {
        return Err(Failure::Input(format!(
            "{} exists already, and init overwrites nothing; name another directory",
            present.display()
        )));
    }
    std::fs::create_dir_all(dir).map_err(|e| fault(dir, e))?;
    for (path, contents) in &targets {
        std::fs::write(path, contents).map_err(|e| fault(path, e))?;
    }
    let campaign = dir.join("campaign.toml").display().to_string();
    let files: Vec<String> = targets.iter().map(|(path, _)| path.display().to_string()).collect();
    if arguments.json {
        return print_json(&Document { campaign, files });
    }
    let said: String = files.iter().map(|file| format!("wrote {file}\n")).collect();
    print(&format!(
        "{said}next: read {campaign}, then runout check {campaign}, runout fit {campaign}, \
         runout run {campaign} --out runs/first\n"
    ))
}
