//! What goes into the queue and what comes out of it.

use super::WorkerId;
use std::time::Duration;
use thiserror::Error;

/// Settings of the queue. None moves an outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Campaign seed: it chooses the audited realisations.
    pub seed: u64,
    /// Share of realisations run twice and compared.
    pub audit_fraction: f64,
    /// No index at or beyond this is leased.
    pub maximum_realisations: u64,
    /// Time between a worker's heartbeats.
    pub heartbeat: Duration,
    /// Heartbeats missed in a row that make a worker lost.
    pub missed_heartbeats: u32,
    /// Unexpected losses of one index that make it poison.
    pub losses_to_poison: u32,
    /// Leases beyond the prefix, as a multiple of all slots.
    pub look_ahead_per_slot: u64,
    /// A realisation that runs longer than this multiple of the 95th percentile may be repeated.
    pub straggler_factor: f64,
    /// A realisation whose step count has stood still for this long, or for `straggler_factor` times the 95th
    /// percentile if that is longer, hangs.
    pub shortest_hang: Duration,
}

impl Settings {
    /// The usual settings for a campaign.
    pub fn new(seed: u64, audit_fraction: f64, maximum_realisations: u64) -> Settings {
        Settings {
            seed,
            audit_fraction,
            maximum_realisations,
            heartbeat: Duration::from_secs(5),
            missed_heartbeats: 3,
            losses_to_poison: 3,
            look_ahead_per_slot: 4,
            straggler_factor: 2.0,
            // Laying out the points and drawing the fields takes seconds at most, also for large models.
            shortest_hang: Duration::from_secs(120),
        }
    }

    /// Time without a heartbeat after which a worker is lost.
    pub fn lost_after(&self) -> Duration {
        self.heartbeat * self.missed_heartbeats
    }
}

/// An outcome that is durable, as far as the queue is concerned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Done<'a> {
    /// Realisation index.
    pub index: u64,
    /// Digest of the outcome.
    pub digest: &'a str,
    /// Who computed it.
    pub worker: &'a str,
    /// In which attempt.
    pub attempt: u32,
    /// Wall time of the computation, s.
    pub wall_s: f64,
    /// Whether the index was given up instead.
    pub poison: bool,
}

/// The right to run one realisation; the attempt number is the fencing token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lease {
    /// Realisation index.
    pub index: u64,
    /// Attempt, from 1.
    pub attempt: u32,
}

/// A lease that a worker says it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Which.
    pub lease: Lease,
    /// Time steps taken so far.
    pub steps: u64,
    /// Simulated time so far, s.
    pub simulated_s: f64,
    /// Whether only the report is outstanding.
    pub reporting: bool,
}

/// A lease given out, and how it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Running {
    /// Who holds it.
    pub worker: WorkerId,
    /// When it was given out.
    pub since: Duration,
    /// Time steps at the last heartbeat.
    pub steps: u64,
    /// Simulated time at the last heartbeat, s.
    pub simulated_s: f64,
    /// When the step count last changed.
    pub(super) moved_at: Duration,
    /// Whether this re-runs a recorded index to compare digests.
    pub(super) audit: bool,
}

/// The answer to a worker that asks for a lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeaseAnswer {
    /// Run this; persist the attempt before saying so, unless it was [reserved](super::Queue::is_reserved).
    Assigned(Lease),
    /// Nothing to do now.
    Wait,
    /// The coordinator is stopping.
    Draining,
    /// The campaign is over, or the worker was set aside.
    Finished,
}

/// What a worker is told with its heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Go on.
    Continue,
    /// Finish what runs, take nothing new.
    Drain,
    /// Drop everything and leave.
    Stop,
}

/// What to do with a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportStep {
    /// Make it durable, then call [`stored`](super::Queue::stored).
    Store,
    /// The same index is being made durable right now: the worker shall ask again.
    Busy,
    /// Recorded before with the same digest.
    Duplicate,
    /// As [`ReportStep::Duplicate`], and it completes an audit: make that durable, then call
    /// [`agreed`](super::Queue::agreed).
    AuditAgrees,
    /// Recorded before with another digest: make it durable, then call
    /// [`contradicted`](super::Queue::contradicted).
    Conflict,
    /// Of no use: the campaign has ended before it, it was given up, or it was never asked for.
    NotWanted,
}

/// What happened by itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// A worker was given up; its leases are open again.
    WorkerLost {
        /// Its name.
        name: String,
    },
    /// A realisation takes no more steps; its worker is told to end it.
    Hung {
        /// Which.
        index: u64,
    },
    /// A worker was overruled; it gets no more leases, and what only it has computed is run again.
    SetAside {
        /// Its name.
        name: String,
        /// Recorded outcomes that are run again.
        doubtful: u64,
    },
    /// Another outcome of this index counts now.
    Corrected {
        /// Which.
        index: u64,
        /// Digest of the outcome that counts.
        digest: String,
    },
    /// This index took several workers down: record it as poison, then call [`stored`](super::Queue::stored).
    Poisoned {
        /// Which.
        index: u64,
    },
}

/// The worker is not known: it was given up, or the coordinator was restarted. It has to register again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("this worker is not registered (any more)")]
pub struct UnknownWorker;

/// What is known of an index from an earlier session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Attempts {
    /// Highest attempt number given out, or reserved.
    pub attempt: u32,
    /// Unexpected losses.
    pub losses: u32,
}

impl Attempts {
    /// The first attempt, and nothing lost.
    pub const FIRST: Attempts = Attempts { attempt: 1, losses: 0 };
}
