//! Warnings that strangers can cause: so many a second, so that nobody fills the disk with them.

use crate::limits;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A source of warnings.
#[derive(Debug)]
pub struct Notes {
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    since: Option<Instant>,
    said: u32,
    unsaid: u64,
}

impl Notes {
    /// A source that has said nothing yet.
    pub const fn new() -> Notes {
        Notes { state: Mutex::new(State { since: None, said: 0, unsaid: 0 }) }
    }

    /// Says it, or counts it.
    pub fn say(&self, text: &str) {
        match self.count(Instant::now()) {
            None => {}
            Some(0) => tracing::warn!("{text}"),
            Some(unsaid) => tracing::warn!("{text} ({unsaid} like it were not said)"),
        }
    }

    /// Whether to say one more; with how many were not said since the last.
    fn count(&self, now: Instant) -> Option<u64> {
        let mut state = self.state.lock().expect("nobody panics with it locked");
        if state.since.is_none_or(|since| now.saturating_duration_since(since) >= Duration::from_secs(1)) {
            (state.since, state.said) = (Some(now), 0);
        }
        if state.said == limits::NOTES_PER_SECOND {
            state.unsaid += 1;
            return None;
        }
        state.said += 1;
        Some(std::mem::take(&mut state.unsaid))
    }
}

impl Default for Notes {
    fn default() -> Notes {
        Notes::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_counted_and_not_said() {
        let notes = Notes::new();
        let now = Instant::now();
        let said = (0..1000).filter(|_| notes.count(now).is_some()).count();
        assert_eq!(said, limits::NOTES_PER_SECOND as usize);
        assert_eq!(notes.count(now + Duration::from_secs(1)), Some(980));
        assert_eq!(notes.count(now + Duration::from_secs(1)), Some(0));
    }
}
