//! `runout replay`: re-runs one stored realisation from its seed and compares the bits.

use super::analysis::{prepare, watch};
use super::pictures::PictureArguments;
use super::{Failure, index, print, print_json, run_records::RunRecords};
use crate::difference;
use crate::gallery::GalleryError;
use crate::store::log::Record;
use clap::Args;
use runout_core::outcome::{Outcome, Reason};
use runout_core::realisation::Source;
use std::path::PathBuf;

/// `runout replay DIR INDEX [--out DIR2]`
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// Run directory
    dir: PathBuf,
    /// Index of the realisation
    #[arg(value_parser = index, allow_negative_numbers = true)]
    index: u64,
    /// Write a ParaView series (.pvd, .vtu), pictures (.png) and an animation (.gif) into this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pictures: PictureArguments,
    /// Print the outcome that came out again, and the files written, as JSON
    #[arg(long)]
    json: bool,
}

/// Time between two moments of the series, s.
const EVERY_S: f64 = 0.25;

pub(super) fn replay(arguments: &ReplayArguments) -> Result<(), Failure> {
    let ReplayArguments { dir, index, out, pictures, json } = arguments;
    let run = RunRecords::read(dir)?;
    let record = run.view.records.iter().find(|r| r.outcome.index == *index).ok_or_else(|| {
        Failure::Input(format!(
            "{}: realisation {index} is not stored there; {}",
            dir.display(),
            stored_in_words(&run.view.records)
        ))
    })?;
    if record.outcome.reason == Reason::Poison {
        return Err(Failure::Input(format!(
            "realisation {index} was given up after taking workers down: it has no result to compare with"
        )));
    }
    let prepared = prepare(&run.view.spec)?;
    let failed = |e: GalleryError| Failure::Work(e.to_string());
    let mut gallery = pictures.gallery(out.as_deref())?;
    let every_s = if gallery.is_some() { EVERY_S } else { f64::INFINITY };
    let watched = watch(&prepared, Source::Index(*index), every_s, &mut |snapshot| {
        if let Some(gallery) = &mut gallery {
            gallery.observe(snapshot);
        }
    })?;
    let mut files = Vec::new();
    if let Some(gallery) = gallery {
        let what = format!("{}, realisation {index}", run.loaded.campaign.name);
        let random = &run.loaded.campaign.random;
        files = gallery.finish(&run.view.spec.model, random, &what, &watched.outcome).map_err(failed)?;
    }
    if *json {
        compare(*index, &record.outcome, &watched.outcome)?;
        return print_json(&serde_json::json!({ "same": true, "outcome": watched.outcome, "files": files }));
    }
    print(&files.iter().map(|file| format!("wrote {}\n", file.display())).collect::<String>())?;
    compare(*index, &record.outcome, &watched.outcome)?;
    print(&format!("realisation {index}: the same bits, digest {}\n", watched.outcome.digest))?;
    Ok(())
}

/// Which indices there are to choose from.
fn stored_in_words(records: &[Record]) -> String {
    match (records.first(), records.last()) {
        (Some(first), Some(last)) => format!(
            "it holds {} realisations with indices from {} to {}",
            records.len(),
            first.outcome.index,
            last.outcome.index
        ),
        _ => "it holds no realisation yet".to_owned(),
    }
}

fn compare(index: u64, stored: &Outcome, found: &Outcome) -> Result<(), Failure> {
    if stored == found {
        return Ok(());
    }
    let value = |outcome: &Outcome| serde_json::to_value(outcome).map_err(|e| Failure::work("JSON", e));
    let lines = difference::lines(&value(stored)?, &value(found)?);
    Err(Failure::Work(format!(
        "realisation {index} is not the same (stored -> replayed): another build, or a machine that computes wrongly\n  {}",
        lines.join("\n  ")
    )))
}
