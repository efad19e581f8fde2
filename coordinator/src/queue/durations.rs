//! Recent wall times of realisations: the 95th percentile says what is late, the mean how long the rest takes.

use std::collections::VecDeque;
use std::time::Duration;

/// How many recent wall times are kept.
const KEPT: usize = 256;
/// Fewer than this say nothing about a percentile. Two slots look no more than 7 realisations past a straggler at the start.
const FEWEST: usize = 5;

#[derive(Debug, Default)]
pub(super) struct Durations {
    recent_s: VecDeque<f64>,
}

impl Durations {
    pub(super) fn push(&mut self, wall_s: f64) {
        if self.recent_s.len() == KEPT {
            self.recent_s.pop_front();
        }
        self.recent_s.push_back(wall_s);
    }

    pub(super) fn percentile_95(&self) -> Option<Duration> {
        if self.recent_s.len() < FEWEST {
            return None;
        }
        let mut sorted: Vec<f64> = self.recent_s.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        let rank = (sorted.len() * 95).div_ceil(100) - 1;
        Duration::try_from_secs_f64(sorted[rank]).ok()
    }

    pub(super) fn mean_s(&self) -> Option<f64> {
        let count = self.recent_s.len();
        (count > 0).then(|| self.recent_s.iter().sum::<f64>() / count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_percentile_is_of_the_recent_ones() {
        let mut durations = Durations::default();
        (1..=FEWEST - 1).for_each(|s| durations.push(s as f64));
        assert_eq!(durations.percentile_95(), None);
        (0..KEPT).for_each(|_| durations.push(1000.0));
        (1..=100).for_each(|s| durations.push(f64::from(s)));
        // Of 256, the 244th smallest is among the 156 old ones of 1000 s.
        assert_eq!(durations.percentile_95(), Some(Duration::from_secs(1000)));
        (0..KEPT).for_each(|s| durations.push(s as f64));
        assert_eq!(durations.percentile_95(), Some(Duration::from_secs(243)));
    }
}
