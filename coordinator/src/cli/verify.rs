//! `runout verify`: whether a run directory holds together, and whether a sample of its realisations gives the same bits.

use super::analysis::{prepare, watch};
use super::{DONE, Failure, print, print_json};
use crate::difference;
use crate::run_directory;
use crate::verify::{self, Verification};
use clap::Args;
use runout_core::outcome::{Outcome, Reason};
use runout_core::realisation::Source;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// `runout verify DIR [--rerun N] [--json]`
#[derive(Debug, Args)]
pub struct VerifyArguments {
    /// Run directory; nothing in it is changed (sled is read from a copy in the temporary folder)
    dir: PathBuf,
    /// Run so many recorded realisations again, chosen by the campaign's seed, and compare the bits
    #[arg(long, value_name = "N", default_value = "0")]
    rerun: usize,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A realisation that was run again.
#[derive(Debug, Serialize)]
struct Rerun {
    index: u64,
    same: bool,
}

#[derive(Debug, Serialize)]
struct Document {
    sound: bool,
    #[serde(flatten)]
    found: Verification,
    rerun: Vec<Rerun>,
}

pub(super) fn verify(arguments: &VerifyArguments) -> Result<u8, Failure> {
    let VerifyArguments { dir, rerun, json } = arguments;
    if !run_directory::is_one(dir) {
        // The message of every command that is given something else.
        run_directory::read_frame(dir).map_err(|e| Failure::Input(e.to_string()))?;
    }
    let mut found = verify::verify(dir).map_err(|e| Failure::work(dir.display(), e))?;
    let rerun =
        if *rerun > 0 && found.digest.is_some() { run_again(dir, *rerun, &mut found)? } else { Vec::new() };
    let document = Document { sound: found.is_sound(), found, rerun };
    if *json {
        print_json(&document)?
    } else {
        print(&document.text(dir))?
    }
    Ok(if document.sound { DONE } else { 1 })
}

/// Runs a sample of the recorded realisations again.
fn run_again(dir: &Path, count: usize, found: &mut Verification) -> Result<Vec<Rerun>, Failure> {
    let view = run_directory::read(dir).map_err(|e| Failure::Input(e.to_string()))?;
    let prepared = prepare(&view.spec)?;
    let chosen = sample(view.spec.seed, view.records.iter().map(|record| &record.outcome), count);
    let mut rerun = Vec::new();
    for stored in chosen {
        let index = stored.index;
        let again = watch(&prepared, Source::Index(index), f64::INFINITY, &mut |_| {})?.outcome;
        let same = again == *stored;
        if !same {
            let value =
                |outcome: &Outcome| serde_json::to_value(outcome).map_err(|e| Failure::work("JSON", e));
            let lines = difference::lines(&value(stored)?, &value(&again)?).join("; ");
            found
                .findings
                .push(format!("realisation {index} gives other bits here (stored -> now): {lines}"));
        }
        rerun.push(Rerun { index, same });
    }
    Ok(rerun)
}

/// So many outcomes in index order, chosen by the seed; what was given up has no bits to compare.
fn sample<'a>(seed: u64, outcomes: impl Iterator<Item = &'a Outcome>, count: usize) -> Vec<&'a Outcome> {
    let draw = |index: u64| *blake3::hash(format!("verify {seed} {index}").as_bytes()).as_bytes();
    let mut drawn: Vec<(_, &Outcome)> = outcomes
        .filter(|outcome| outcome.reason != Reason::Poison)
        .map(|outcome| (draw(outcome.index), outcome))
        .collect();
    drawn.sort_by_key(|(draw, _)| *draw);
    let mut chosen: Vec<&Outcome> = drawn.into_iter().take(count).map(|(_, outcome)| outcome).collect();
    chosen.sort_by_key(|outcome| outcome.index);
    chosen
}

impl Document {
    fn text(&self, dir: &Path) -> String {
        let found = &self.found;
        let mut text = format!("{}: ", dir.display());
        text += &match found.findings.len() {
            0 => "sound\n".to_owned(),
            1 => "1 finding\n".to_owned(),
            n => format!("{n} findings\n"),
        };
        if let (Some(campaign), Some(digest)) = (&found.campaign, &found.digest) {
            text += &format!("  campaign {campaign}, spec {digest}\n");
        }
        text += &format!(
            "  log: {} lines, {} outcomes, of which {} are the results and {} lie beyond; {} audits, {} \
             conflicts, {} withdrawn\n",
            found.lines,
            found.outcomes,
            found.results,
            found.beyond,
            found.audits,
            found.conflicts,
            found.withdrawn
        );
        if let Some(stored) = found.stored {
            text += &format!("  store: {stored} outcomes\n");
        }
        if !self.rerun.is_empty() {
            let same = self.rerun.iter().filter(|rerun| rerun.same).count();
            let indices: Vec<u64> = self.rerun.iter().map(|rerun| rerun.index).collect();
            let listed = super::some_of(&indices);
            text += &format!("  run again: {} ({listed}), {same} with the same bits\n", self.rerun.len());
        }
        for what in &found.not_checked {
            text += &format!("  not checked: {what}\n");
        }
        for finding in &found.findings {
            text += &format!("  finding: {finding}\n");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::tests::record;

    #[test]
    fn the_seed_chooses_the_sample() {
        let outcomes: Vec<Outcome> = (0..100).map(|index| record(index).outcome).collect();
        let indices = |seed, count| -> Vec<u64> {
            sample(seed, outcomes.iter(), count).iter().map(|outcome| outcome.index).collect()
        };
        assert_eq!(indices(1, 5), indices(1, 5));
        assert_ne!(indices(1, 5), indices(2, 5));
        assert!(indices(1, 5).is_sorted() && indices(1, 5).len() == 5);
        // A larger sample holds the smaller one.
        assert!(indices(1, 5).iter().all(|index| indices(1, 20).contains(index)));
        assert_eq!(indices(1, 1000).len(), 100);
    }
}
