//! What all calls share: the engine, what was seen, and the thread that makes things durable.
//!
//! What must happen once it has begun (storing an outcome, noting that it is stored) runs in a task of its own,
//! so that a client that hangs up in the middle leaves nothing half done.

use crate::engine::{Engine, poison};
use crate::events::What;
use crate::queue::Event;
use crate::seen::Seen;
use crate::status::{self, Status};
use crate::store::log::Entry;
use crate::writer::{Job, Writer};
use runout_core::campaign::Campaign;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// What all calls share.
#[derive(Debug)]
pub struct Shared {
    /// The campaign.
    pub campaign: Campaign,
    /// Digest of its spec.
    pub digest: String,
    /// The spec as it is sent.
    pub spec_json: String,
    /// What this machine computes: see [`runout_proto::identity::fingerprint`].
    pub fingerprint: String,
    engine: Mutex<Engine>,
    seen: Mutex<Seen>,
    /// Woken whenever a waiting worker might get another answer, or the campaign may be over.
    changed: Notify,
    writer: Writer,
    started: Instant,
    /// Longest time that running realisations get once the campaign is cancelled.
    pub grace: Duration,
    cancelled: AtomicBool,
}

impl Shared {
    /// What all calls share, at the start.
    pub fn new(
        campaign: Campaign,
        spec_json: String,
        digest: String,
        fingerprint: String,
        engine: Engine,
        writer: Writer,
        grace: Duration,
    ) -> Shared {
        let seen = Mutex::new(Seen::new(campaign.model.sample.measure));
        Shared {
            campaign,
            digest,
            spec_json,
            fingerprint,
            engine: Mutex::new(engine),
            seen,
            changed: Notify::new(),
            writer,
            started: Instant::now(),
            grace,
            cancelled: AtomicBool::new(false),
        }
    }

    /// Whether an operator has cancelled the campaign.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// An operator cancels the campaign.
    pub fn cancel(&self) {
        if !self.cancelled.swap(true, Ordering::Relaxed) {
            tracing::info!("cancelled by an operator");
        }
        self.changed.notify_waiters();
    }

    /// The engine, locked: never across an await.
    pub fn engine(&self) -> MutexGuard<'_, Engine> {
        self.engine.lock().expect("nobody panics with the engine locked")
    }

    /// What was seen, for the live page; never locked while the engine is asked for.
    pub fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().expect("nobody panics with it locked")
    }

    /// Time since the start: the queue's `now`.
    pub fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// Woken after every change that may matter to somebody who waits.
    pub fn changed(&self) -> &Notify {
        &self.changed
    }

    /// The thread that makes things durable.
    pub fn writer(&self) -> &Writer {
        &self.writer
    }

    /// Where the campaign stands.
    pub fn status(&self) -> Status {
        status::of_engine(&self.campaign, &self.digest, &self.engine(), self.now())
    }

    /// Deals with what happened by itself.
    pub fn handle(self: &Arc<Self>, events: Vec<Event>) {
        for event in events {
            self.seen().happened(&event);
            match event {
                Event::WorkerLost { name } => {
                    tracing::warn!(worker = name, "worker {name} is lost");
                    self.writer.note(What::WorkerLost { worker: name });
                }
                Event::Hung { index } => {
                    tracing::warn!(
                        index,
                        "realisation {index} takes no more steps: its worker is told to end it"
                    );
                }
                Event::SetAside { name, doubtful } => tracing::error!(
                    worker = name,
                    "worker {name} computes other bits than others and is set aside; {doubtful} of its outcomes are run \
                     again"
                ),
                Event::Corrected { index, .. } => {
                    tracing::warn!(
                        index,
                        "realisation {index}: the outcome recorded first was wrong; another counts now"
                    );
                }
                Event::Poisoned { index } => {
                    tracing::error!(
                        index,
                        "realisation {index} took several workers down: recorded as poison"
                    );
                    self.writer.note(What::Poisoned { index });
                    let shared = Arc::clone(self);
                    tokio::spawn(async move { shared.store(poison(index)).await });
                }
            }
        }
        self.changed.notify_waiters();
    }

    /// Makes first attempts durable ahead, where it is time to.
    pub(crate) fn reserve(self: &Arc<Self>) {
        let indices = self.engine().reserve();
        if indices.is_empty() {
            return;
        }
        let shared = Arc::clone(self);
        tokio::spawn(async move {
            // Where the store has failed the coordinator ends, and says why.
            if shared.writer.write(Job::Reservation(indices.clone())).await.is_ok() {
                shared.engine().reserved(indices);
            }
        });
    }

    /// Makes an entry durable and tells the engine.
    pub(crate) async fn store(self: Arc<Self>, entry: Entry) -> Result<(), tonic::Status> {
        self.writer.write(Job::Entry(Box::new(entry.clone()))).await?;
        let events = self.engine().stored(&entry);
        self.writer.note(What::from(&entry));
        if let Entry::Outcome(record) = &entry {
            let (index, attempt, worker) = (record.outcome.index, record.attempt, &record.worker);
            tracing::debug!(worker, index, attempt, "realisation {index} is recorded");
            self.seen().recorded(record);
        }
        self.handle(events);
        Ok(())
    }
}
