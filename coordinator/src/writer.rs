//! The thread that makes things durable: it gathers what waits and commits it in one go (group commit).
//!
//! The first failure is final: nothing is acknowledged any more, and the coordinator ends and says why.

use crate::events::{Events, What};
use crate::queue::Attempts;
use crate::status::tally::Keeper;
use crate::store::Store;
use crate::store::log::Entry;
use std::ops::Range;
use std::thread::{self, JoinHandle};
use tokio::sync::{mpsc, oneshot, watch};

/// Calls that may wait for a commit; further ones wait for room.
const QUEUE: usize = 4096;
/// Most jobs in one commit. It takes two syncs of the disk, of some milliseconds each, however many it holds: with a
/// thousand workers all that wait shall go in one.
const GROUP: usize = 1024;

/// Something to make durable.
#[derive(Debug)]
pub enum Job {
    /// An entry of the outcome log.
    Entry(Box<Entry>),
    /// The attempts of an index.
    Attempts(u64, Attempts),
    /// First attempts, before they are given out.
    Reservation(Range<u64>),
}

type Waiting = (Job, oneshot::Sender<()>);

/// A handle to the thread.
#[derive(Debug)]
pub struct Writer {
    jobs: mpsc::Sender<Waiting>,
    events: Events,
    failure: watch::Receiver<Option<String>>,
}

impl Writer {
    /// Starts the thread. It ends, with the store closed, when all handles are gone.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn start(store: Store) -> std::io::Result<(Writer, JoinHandle<()>)> {
        Writer::start_keeping(store, None)
    }

    /// As [`Writer::start`], with estimates cached beside a log that becomes long.
    ///
    /// # Errors
    /// As [`Writer::start`].
    pub fn start_keeping(store: Store, keeper: Option<Keeper>) -> std::io::Result<(Writer, JoinHandle<()>)> {
        let events = Events::open(store.folder());
        let (jobs, waiting) = mpsc::channel(QUEUE);
        let (failed, failure) = watch::channel(None);
        let thread = thread::Builder::new()
            .name("store".to_owned())
            .spawn(move || write_until_done(store, keeper, waiting, &failed))?;
        Ok((Writer { jobs, events, failure }, thread))
    }

    /// Makes `job` durable.
    ///
    /// # Errors
    /// The store has failed: UNAVAILABLE, so that a worker keeps its outcome and tries again later.
    pub async fn write(&self, job: Job) -> Result<(), tonic::Status> {
        let failed = || tonic::Status::unavailable("the coordinator cannot store anything and is stopping");
        let (done, wait) = oneshot::channel();
        self.jobs.send((job, done)).await.map_err(|_| failed())?;
        wait.await.map_err(|_| failed())
    }

    /// Notes in `events.log` that something has happened; that is neither synced nor waited for.
    pub fn note(&self, what: What) {
        self.events.note(what);
    }

    /// Becomes some message when the store has failed.
    pub fn failure(&self) -> watch::Receiver<Option<String>> {
        self.failure.clone()
    }
}

fn write_until_done(
    mut store: Store,
    mut keeper: Option<Keeper>,
    mut waiting: mpsc::Receiver<Waiting>,
    failed: &watch::Sender<Option<String>>,
) {
    let mut group: Vec<Waiting> = Vec::with_capacity(GROUP);
    while waiting.blocking_recv_many(&mut group, GROUP) > 0 {
        let mut entries = Vec::new();
        let mut attempts = Vec::new();
        let mut done = Vec::new();
        for (job, sender) in group.drain(..) {
            match job {
                Job::Entry(entry) => entries.push(*entry),
                Job::Attempts(index, given) => attempts.push((index, given)),
                Job::Reservation(indices) => attempts.extend(indices.map(|index| (index, Attempts::FIRST))),
            }
            done.push(sender);
        }
        if let Err(error) = store.commit(&entries, &attempts) {
            failed.send_replace(Some(error.to_string()));
            return;
        }
        for sender in done {
            // A caller that has gone needs no answer.
            let _ = sender.send(());
        }
        if let Some(keeper) = &mut keeper {
            keeper.committed(store.folder(), &entries, store.end());
        }
    }
    if let Some(keeper) = &mut keeper {
        keeper.close(store.folder(), store.end());
    }
}
