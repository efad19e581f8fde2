//! When a worker leaves by itself: before a time limit that it was told of, or when it has had nothing to do for long.

use crate::board::Board;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A realisation counts as one that can be finished if this multiple of the longest one so far is left. Wall times of
/// one campaign differ by about this much between realisations; one that takes longer still is given back.
const RESERVE_FACTOR: f64 = 1.5;
/// Time between two looks at whether there is something to do.
const LOOK_AGAIN: Duration = Duration::from_secs(1);

/// The limits of a worker's stay.
#[derive(Debug)]
pub struct Leave {
    started: Instant,
    limit: Option<Duration>,
    idle_limit: Option<Duration>,
    grace: Duration,
    worked: Mutex<Worked>,
}

#[derive(Debug)]
struct Worked {
    last: Instant,
    longest: Duration,
}

impl Leave {
    /// A stay that begins now: gone after `limit`, the last `grace` of which running realisations get to finish; or
    /// after `idle_limit` without one.
    pub fn new(limit: Option<Duration>, idle_limit: Option<Duration>, grace: Duration) -> Leave {
        let started = Instant::now();
        let worked = Mutex::new(Worked { last: started, longest: Duration::ZERO });
        Leave { started, limit, idle_limit, grace, worked }
    }

    /// Notes that a slot has run something for `wall`.
    pub fn note(&self, wall: Duration) {
        let mut worked = self.worked.lock().expect("nobody panics with it locked");
        worked.last = Instant::now();
        worked.longest = worked.longest.max(wall);
    }

    /// Whether a realisation begun now would probably not be finished before the limit. False as long as none has
    /// been run: how long one takes is not known then.
    pub fn is_too_late(&self) -> bool {
        let longest = self.worked.lock().expect("nobody panics with it locked").longest;
        self.left().is_some_and(|left| left < longest.mul_f64(RESERVE_FACTOR))
    }

    /// Waits until running realisations must come to their end, or until nothing has run for long; for ever if
    /// neither was asked for. Says which it was.
    pub async fn due(&self, board: &Board) -> &'static str {
        loop {
            if self.left().is_some_and(|left| left <= self.grace) {
                return "the time limit is near";
            }
            if self.idle_limit.is_some_and(|limit| self.idle(board) >= limit) {
                return "there has been nothing to do for long";
            }
            let wait = [self.left().map(|left| left - self.grace), self.idle_limit].into_iter().flatten();
            tokio::time::sleep(wait.fold(LOOK_AGAIN, Duration::min)).await;
        }
    }

    fn left(&self) -> Option<Duration> {
        self.limit.map(|limit| limit.saturating_sub(self.started.elapsed()))
    }

    fn idle(&self, board: &Board) -> Duration {
        let mut worked = self.worked.lock().expect("nobody panics with it locked");
        if !board.leases().is_empty() {
            worked.last = Instant::now();
        }
        worked.last.elapsed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_realisation_that_would_outlast_the_limit_is_not_begun() {
        let leave = Leave::new(Some(Duration::from_secs(100)), None, Duration::from_secs(10));
        assert!(!leave.is_too_late());
        leave.note(Duration::from_secs(60));
        assert!(!leave.is_too_late());
        leave.note(Duration::from_secs(70));
        leave.note(Duration::from_secs(1));
        assert!(leave.is_too_late());
    }

    #[test]
    fn without_a_limit_it_is_never_too_late() {
        let leave = Leave::new(None, None, Duration::from_secs(10));
        leave.note(Duration::from_secs(1_000_000));
        assert!(!leave.is_too_late());
    }
}
