//! The registered workers.

use super::UnknownWorker;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Names a registration of a worker; differs between coordinator processes.
pub type WorkerId = u64;

/// A registered worker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Worker {
    /// Its name, for people.
    pub name: String,
    /// Realisations it runs at a time.
    pub slots: u32,
    /// When it was last heard of.
    pub heard: Duration,
    /// Whether it was overruled (see [`crate::rulings`]): it gets no more leases.
    pub set_aside: bool,
    /// Outcomes recorded from it in this session.
    pub done: u64,
    /// Whether it knows that the campaign is over or the coordinator stops.
    pub(super) told: bool,
}

#[derive(Debug)]
pub(super) struct Workers {
    session: u32,
    registered: u32,
    by_id: BTreeMap<WorkerId, Worker>,
    /// A name may be taken again before its former bearer is given up.
    by_name: BTreeMap<String, BTreeSet<WorkerId>>,
    slots: u64,
}

impl Workers {
    pub(super) fn new(session: u32) -> Workers {
        Workers { session, registered: 0, by_id: BTreeMap::new(), by_name: BTreeMap::new(), slots: 0 }
    }

    pub(super) fn add(&mut self, name: &str, slots: u32, set_aside: bool, now: Duration) -> WorkerId {
        self.registered += 1;
        let id = u64::from(self.session) << 32 | u64::from(self.registered);
        let worker = Worker { name: name.to_owned(), slots, heard: now, set_aside, done: 0, told: false };
        self.by_id.insert(id, worker);
        self.by_name.entry(name.to_owned()).or_default().insert(id);
        self.slots += u64::from(slots);
        id
    }

    pub(super) fn heard(&mut self, id: WorkerId, now: Duration) -> Result<&mut Worker, UnknownWorker> {
        let worker = self.by_id.get_mut(&id).ok_or(UnknownWorker)?;
        worker.heard = worker.heard.max(now);
        Ok(worker)
    }

    /// Sets aside exactly the workers of these names; returns the ids of those.
    pub(super) fn set_aside(&mut self, names: &BTreeSet<String>) -> Vec<WorkerId> {
        for worker in self.by_id.values_mut() {
            worker.set_aside = names.contains(&worker.name);
        }
        self.iter().filter(|(_, worker)| worker.set_aside).map(|(id, _)| id).collect()
    }

    pub(super) fn count_done(&mut self, name: &str) {
        let first = self.by_name.get(name).and_then(|ids| ids.first());
        if let Some(worker) = first.and_then(|id| self.by_id.get_mut(id)) {
            worker.done += 1;
        }
    }

    pub(super) fn remove(&mut self, id: WorkerId) -> Option<Worker> {
        let worker = self.by_id.remove(&id)?;
        self.slots -= u64::from(worker.slots);
        if let Some(ids) = self.by_name.get_mut(&worker.name) {
            ids.remove(&id);
            if ids.is_empty() {
                self.by_name.remove(&worker.name);
            }
        }
        Some(worker)
    }

    pub(super) fn get(&self, id: WorkerId) -> Option<&Worker> {
        self.by_id.get(&id)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (WorkerId, &Worker)> {
        self.by_id.iter().map(|(id, worker)| (*id, worker))
    }

    /// All slots together, at least one.
    pub(super) fn slots(&self) -> u64 {
        self.slots.max(1)
    }
}
