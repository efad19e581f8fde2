//! What slots and heartbeat share: the registration, the leases held with their progress, and whether to go on.

use crate::client::{Client, ClientError, Registration};
use runout_core::realisation::Progress;
use runout_proto::v1::{LeaseProgress, LeaseRef};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use tokio::sync::{Notify, watch};

/// Whether to go on. Only ever raised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mode {
    /// Lease, compute, report.
    Working,
    /// Finish and report what runs, lease nothing new.
    Draining,
    /// Drop everything.
    Stopping,
}

/// A lease held.
#[derive(Debug, Default)]
pub struct Held {
    /// Where its computation stands.
    pub progress: Progress,
    /// Whether only its report is outstanding.
    pub reporting: AtomicBool,
    cancelled: Notify,
}

impl Held {
    /// Asks the computation to end.
    fn cancel(&self) {
        self.progress.cancel();
        self.cancelled.notify_one();
    }

    /// Waits until the computation has been asked to end. For one waiter.
    pub async fn cancelled(&self) {
        self.cancelled.notified().await;
    }
}

/// What slots and heartbeat share.
#[derive(Debug)]
pub struct Board {
    registration: Mutex<Registration>,
    renewing: tokio::sync::Mutex<()>,
    held: Mutex<BTreeMap<(u64, u32), Arc<Held>>>,
    mode: watch::Sender<Mode>,
    failure: Mutex<Option<ClientError>>,
}

impl Board {
    /// A board for a fresh registration.
    pub fn new(registration: Registration) -> Board {
        Board {
            registration: Mutex::new(registration),
            renewing: tokio::sync::Mutex::new(()),
            held: Mutex::default(),
            mode: watch::Sender::new(Mode::Working),
            failure: Mutex::default(),
        }
    }

    /// The registration.
    pub fn registration(&self) -> Registration {
        locked(&self.registration).clone()
    }

    /// Registers again, unless somebody else has done so since `old` was used.
    ///
    /// # Errors
    /// The coordinator stays away, refuses, or has another campaign now.
    pub async fn renew(&self, client: &Client, old: u64) -> Result<(), ClientError> {
        let _one_at_a_time = self.renewing.lock().await;
        let before = self.registration();
        if before.worker_id != old {
            return Ok(());
        }
        tracing::info!("registering again: the coordinator does not know this worker (any more)");
        let registration = client.register(self.leases()).await?;
        if registration.digest != before.digest {
            return Err(ClientError::OtherCampaign);
        }
        *locked(&self.registration) = registration;
        Ok(())
    }

    /// Notes a lease.
    pub fn take(&self, lease: LeaseRef) -> Arc<Held> {
        let held = Arc::new(Held::default());
        locked(&self.held).insert((lease.index, lease.attempt), Arc::clone(&held));
        held
    }

    /// Forgets a lease.
    pub fn drop_lease(&self, lease: LeaseRef) {
        locked(&self.held).remove(&(lease.index, lease.attempt));
    }

    /// The leases held.
    pub fn leases(&self) -> Vec<LeaseRef> {
        locked(&self.held).keys().map(|&(index, attempt)| LeaseRef { index, attempt }).collect()
    }

    /// The leases held, with their progress.
    pub fn progress(&self) -> Vec<LeaseProgress> {
        locked(&self.held)
            .iter()
            .map(|(&(index, attempt), held)| LeaseProgress {
                lease: Some(LeaseRef { index, attempt }),
                steps: held.progress.steps(),
                simulated_s: held.progress.simulated_s(),
                reporting: held.reporting.load(Ordering::Relaxed),
            })
            .collect()
    }

    /// Ends the computation of a lease.
    pub fn cancel(&self, lease: LeaseRef) {
        if let Some(held) = locked(&self.held).get(&(lease.index, lease.attempt)) {
            held.cancel();
        }
    }

    /// Raises the mode; stopping also ends every computation.
    pub fn raise(&self, mode: Mode) {
        self.mode.send_if_modified(|current| {
            let raised = mode > *current;
            *current = mode.max(*current);
            raised
        });
        if mode == Mode::Stopping {
            for held in locked(&self.held).values() {
                held.cancel();
            }
        }
    }

    /// Whether to go on, and a way to hear of changes.
    pub fn mode(&self) -> watch::Receiver<Mode> {
        self.mode.subscribe()
    }

    /// Stops because of an error; the first one is kept.
    pub fn fail(&self, error: ClientError) {
        locked(&self.failure).get_or_insert(error);
        self.raise(Mode::Stopping);
    }

    /// The error that stopped the worker.
    pub fn failure(&self) -> Option<ClientError> {
        locked(&self.failure).take()
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().expect("nobody panics with it locked")
}

/// Waits until the mode is at least `mode`.
pub async fn reached(receiver: &mut watch::Receiver<Mode>, mode: Mode) {
    // The sender lives in the board, which outlives its users; if it is gone there is nothing to wait for.
    let _ = receiver.wait_for(|current| *current >= mode).await;
}
