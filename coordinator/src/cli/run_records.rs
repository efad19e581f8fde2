//! What `results`, `report` and `replay` read of a run directory: the campaign, and its outcomes up to the one that
//! decided.

use super::Failure;
use crate::load::{self, Loaded};
use crate::run_directory::{self, RunView};
use crate::status;
use crate::store::log::Record;
use std::path::Path;
use tracing::warn;

/// A run directory as read.
#[derive(Debug)]
pub(super) struct RunRecords {
    /// Campaign, site data and fit, from the texts in the directory.
    pub(super) loaded: Loaded,
    /// The directory's content.
    pub(super) view: RunView,
    decided: usize,
}

impl RunRecords {
    /// Reads `dir`, whether or not a coordinator works on it.
    pub(super) fn read(dir: &Path) -> Result<RunRecords, Failure> {
        let view = run_directory::read(dir).map_err(|e| Failure::Input(e.to_string()))?;
        let loaded = load::load_texts(
            &dir.join("campaign.toml"),
            view.campaign_text.clone(),
            view.site_text.clone(),
            view.profile_text.clone(),
        )?;
        if loaded.spec.digest() != view.spec.digest() {
            warn!(
                "{}: campaign.toml and site.csv no longer freeze to the directory's spec; its outcomes belong to the spec",
                dir.display()
            );
        }
        let decided = status::results(&loaded.campaign, &view).len();
        Ok(RunRecords { loaded, view, decided })
    }

    /// The records that the estimates rest on: the contiguous prefix up to the stopping index. Which ones lie beyond
    /// depends on the number of workers and is no result.
    pub(super) fn decided(&self) -> &[Record] {
        &self.view.records[..self.decided]
    }

    /// What people should know of the directory beside its outcomes.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = self.view.damage.clone();
        notes.extend(self.view.conflicts.iter().map(|c| {
            format!(
                "realisation {} gave another digest on worker {} (attempt {}): one of the machines computes wrongly",
                c.outcome.index, c.worker, c.attempt
            )
        }));
        notes
    }

    /// Says on standard error what is left out or damaged.
    pub(super) fn warn(&self) {
        let beyond = self.view.records.len() - self.decided;
        if beyond > 0 {
            warn!(
                "{beyond} outcomes beyond the stopping index, or beyond the first one missing, are left out"
            );
        }
        self.notes().iter().for_each(|note| warn!("{note}"));
    }
}
