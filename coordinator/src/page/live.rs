//! The page's content, made at most once a second for everybody who looks, and not at all while nobody does.

use super::parts::{self, Part};
use super::snapshot::Snapshot;
use crate::report::figures;
use crate::report::html;
use crate::shared::Shared;
use crate::status::State;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};
use tokio::sync::Mutex;

/// Shortest time for which a view is shown.
const FRESH: Duration = Duration::from_secs(1);
/// A view is shown for this multiple of what making it took, so that a page takes at most a twentieth of a core.
const SHARE: u32 = 20;

/// What is shown at one moment.
#[derive(Debug)]
pub(super) struct View {
    /// What it was made from.
    pub(super) snapshot: Snapshot,
    /// The page's parts.
    pub(super) parts: Vec<Part>,
}

/// The page's content over time.
#[derive(Debug)]
pub(super) struct Live {
    shared: Weak<Shared>,
    out: PathBuf,
    section: String,
    kept: Mutex<Option<Kept>>,
}

#[derive(Debug)]
struct Kept {
    view: Arc<View>,
    made: Instant,
    good_for: Duration,
    /// The campaign has ended: nothing follows.
    last: bool,
}

impl Live {
    /// The content of the page of a campaign whose run directory is `out`.
    pub(super) fn new(shared: &Arc<Shared>, out: &Path) -> Live {
        // A slope that cannot be drawn is no reason to have no page.
        let section = figures::section(&shared.campaign.model)
            .map(|figure| html::illustration(&figure))
            .unwrap_or_default();
        Live { shared: Arc::downgrade(shared), out: out.to_owned(), section, kept: Mutex::new(None) }
    }

    /// The slope as a figure, which does not change.
    pub(super) fn section(&self) -> &str {
        &self.section
    }

    /// What to show now; nothing if the coordinator has gone before anybody looked.
    pub(super) async fn view(&self) -> Option<Arc<View>> {
        // Whoever comes while a view is made waits for it here.
        let mut kept = self.kept.lock().await;
        if let Some(kept) = &*kept
            && (kept.last || kept.made.elapsed() < kept.good_for)
        {
            return Some(Arc::clone(&kept.view));
        }
        match self.shared.upgrade() {
            Some(shared) => self.make(&mut kept, shared, None).await,
            None => kept.as_ref().map(|kept| Arc::clone(&kept.view)),
        }
    }

    /// Makes the last view: the campaign has ended in `state`.
    pub(super) async fn end(&self, shared: &Arc<Shared>, state: State) {
        let mut kept = self.kept.lock().await;
        self.make(&mut kept, Arc::clone(shared), Some(state)).await;
    }

    async fn make(
        &self,
        kept: &mut Option<Kept>,
        shared: Arc<Shared>,
        ended: Option<State>,
    ) -> Option<Arc<View>> {
        let before = kept.as_ref().map(|kept| Arc::clone(&kept.view));
        let out = self.out.clone();
        let started = Instant::now();
        let made = tokio::task::spawn_blocking(move || {
            let snapshot = Snapshot::of(&shared, before.as_ref().map(|view| &view.snapshot), ended);
            let parts = parts::of(&snapshot, before.as_deref(), &out);
            Arc::new(View { snapshot, parts })
        });
        let view = made.await.ok()?;
        let good_for = FRESH.max(started.elapsed() * SHARE);
        *kept = Some(Kept { view: Arc::clone(&view), made: Instant::now(), good_for, last: ended.is_some() });
        Some(view)
    }
}
