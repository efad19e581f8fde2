//! Leases given out, found by realisation and by worker: with a thousand workers no call looks at all of them.

use super::{Lease, Running, WorkerId};
use std::collections::{BTreeMap, BTreeSet};

#[derive(Debug, Default)]
pub(super) struct Leases {
    by_lease: BTreeMap<Lease, Running>,
    by_worker: BTreeSet<(WorkerId, Lease)>,
}

impl Leases {
    pub(super) fn insert(&mut self, lease: Lease, running: Running) {
        self.remove(lease);
        self.by_worker.insert((running.worker, lease));
        self.by_lease.insert(lease, running);
    }

    pub(super) fn remove(&mut self, lease: Lease) {
        if let Some(running) = self.by_lease.remove(&lease) {
            self.by_worker.remove(&(running.worker, lease));
        }
    }

    /// In index order.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Lease, &Running)> {
        self.by_lease.iter().map(|(lease, running)| (*lease, running))
    }

    /// A lease, if this worker holds it.
    pub(super) fn held(&self, by: WorkerId, lease: Lease) -> Option<&Running> {
        self.by_lease.get(&lease).filter(|running| running.worker == by)
    }

    /// As [`Leases::held`]; whose it is must not be changed.
    pub(super) fn held_mut(&mut self, by: WorkerId, lease: Lease) -> Option<&mut Running> {
        self.by_lease.get_mut(&lease).filter(|running| running.worker == by)
    }

    /// How many leases of an index are given out.
    pub(super) fn count_of(&self, index: u64) -> usize {
        self.by_lease.range(Lease { index, attempt: 0 }..=Lease { index, attempt: u32::MAX }).count()
    }

    /// In index order.
    pub(super) fn of_worker(&self, id: WorkerId) -> impl Iterator<Item = Lease> {
        let (first, last) = (Lease { index: 0, attempt: 0 }, Lease { index: u64::MAX, attempt: u32::MAX });
        self.by_worker.range((id, first)..=(id, last)).map(|(_, lease)| *lease)
    }
}
