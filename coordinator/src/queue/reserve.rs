//! First attempts that are durable before anybody asks for them, so that a lease need not wait for the disk.
//!
//! What an earlier session had reserved counts as given out: nobody knows any more whether it was.

use super::{Lease, Queue};
use std::collections::BTreeSet;
use std::ops::Range;

/// Reservations, as multiples of all slots: each slot finds one while the next ones are being made durable.
const ROUNDS: u64 = 3;

/// Indices with a durable first attempt.
#[derive(Debug, Default)]
pub(super) struct Reserved {
    /// Everything that was never leased and is below has been asked for.
    asked: u64,
    durable: BTreeSet<u64>,
}

impl Reserved {
    /// An index that is done needs no reservation.
    pub(super) fn forget(&mut self, index: u64) {
        self.durable.remove(&index);
    }
}

impl Queue {
    /// Indices whose first attempts shall be made durable now; then call [`Queue::reserved`]. Empty while there are
    /// enough: they are asked for by the round, so that many go in one commit.
    pub fn reserve(&mut self) -> Range<u64> {
        let slots = self.workers.slots();
        let from = self.reserved.asked.max(self.next);
        let limit = self.fresh_limit().min(self.next.saturating_add(ROUNDS * slots));
        if self.finished || self.draining || limit <= from || from - self.next >= slots {
            return 0..0;
        }
        self.reserved.asked = limit;
        from..limit
    }

    /// The first attempts of these are durable now.
    pub fn reserved(&mut self, indices: Range<u64>) {
        self.reserved.durable.extend(indices.filter(|index| !self.recorded.contains_key(index)));
    }

    /// Whether the attempt of this lease was made durable ahead.
    pub fn is_reserved(&self, lease: Lease) -> bool {
        lease.attempt == 1 && self.reserved.durable.contains(&lease.index)
    }
}
