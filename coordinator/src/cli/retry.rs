//! `runout retry DIR --failed`: re-opens failed realisations, so that the next session runs them again.
//!
//! A poisoned realisation has no result: workers died on it, perhaps for want of memory, and it is always worth another
//! try. A numerical failure is a result: it follows from (spec, index), and the same build gives it again to the bit, so
//! that it is re-opened only on demand, for a build that mends what failed.

use super::{Failure, print, print_json};
use crate::events::{Events, What};
use crate::queue::Attempts;
use crate::run_directory::{self, RunDirectoryError};
use crate::store::Store;
use crate::store::log::Entry;
use crate::store::wire::Gist;
use clap::Args;
use runout_core::outcome::{OutcomeKind, Reason};
use serde::Serialize;
use std::path::PathBuf;

/// `runout retry DIR --failed [--numerical] [--json]`
#[derive(Debug, Args)]
pub struct RetryArguments {
    /// Run directory; no coordinator may be working on it
    dir: PathBuf,
    /// Re-open realisations that were given up after taking workers down (`poison`)
    #[arg(long, required = true)]
    failed: bool,
    /// Re-open numerical failures too: they follow from spec and index, so the same build gives them again
    #[arg(long)]
    numerical: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Retried {
    /// Indices that are open again.
    reopened: Vec<u64>,
    /// Numerical failures that were left.
    left: Vec<u64>,
}

pub(super) fn retry(arguments: &RetryArguments) -> Result<(), Failure> {
    let dir = &arguments.dir;
    let input = |e: RunDirectoryError| Failure::Input(e.to_string());
    run_directory::read_frame(dir).map_err(input)?;
    let _lock = run_directory::lock(dir).map_err(input)?;
    let (mut store, contents) = Store::open(dir).map_err(crate::serve::ServeError::from)?;
    contents.notes.iter().for_each(|note| tracing::warn!("{note}"));
    let failed = contents.records.iter().filter(|record| record.outcome == OutcomeKind::Failed);
    let (reopened, left): (Vec<&Gist>, Vec<&Gist>) =
        failed.partition(|record| arguments.numerical || record.reason == Reason::Poison);
    let entries: Vec<Entry> = reopened.iter().map(|record| withdrawal(record)).collect();
    // The attempt numbers go on, the losses are forgiven: else the first one would make it poison again.
    let attempts: Vec<(u64, Attempts)> = reopened
        .iter()
        .map(|record| {
            let given = contents.attempts.get(&record.index).copied().unwrap_or_default();
            (record.index, Attempts { attempt: given.attempt.max(record.attempt), losses: 0 })
        })
        .collect();
    if !entries.is_empty() {
        store.commit(&entries, &attempts).map_err(crate::serve::ServeError::from)?;
        let events = Events::open(dir);
        reopened.iter().for_each(|record| events.note(What::Withdrawn { index: record.index }));
    }
    let indices = |records: &[&Gist]| records.iter().map(|record| record.index).collect();
    let retried = Retried { reopened: indices(&reopened), left: indices(&left) };
    if arguments.json { print_json(&retried) } else { print(&retried.text(dir)) }
}

fn withdrawal(record: &Gist) -> Entry {
    Entry::Withdrawn { index: record.index, attempt: record.attempt, digest: record.digest_text() }
}

impl Retried {
    fn text(&self, dir: &std::path::Path) -> String {
        let mut text = match self.reopened.as_slice() {
            [] => "nothing to re-open\n".to_owned(),
            indices => format!(
                "re-opened {} realisations: {}\nrun the campaign into {} again to run them\n",
                indices.len(),
                super::some_of(indices),
                dir.display()
            ),
        };
        if !self.left.is_empty() {
            text += &format!(
                "left {} numerical failures ({}): the same build would give the same bits again; --numerical \
                 re-opens them for another one\n",
                self.left.len(),
                super::some_of(&self.left)
            );
        }
        text
    }
}
