//! How far from the toe the ground is reached, and how far behind the crest it is lost: counted over every realisation
//! that is a sample or stable, from the measures in the outcomes.
//!
//! A place in front of the toe is reached if the slope fails and the contiguous front goes beyond it (`toe_advance_m`), one
//! behind the crest's edge is lost if the slope fails and the ground there moved more than the threshold
//! (`crest_retreat_m`). A stable slope reaches nothing: that its toe bulges by millimetres is no slide.

use runout_core::estimate::interval::{self, Interval};
use runout_core::outcome::{Measures, Outcome, OutcomeKind};

/// The probabilities, whether a slope fails or not.
#[derive(Debug, Clone, Default)]
pub struct Reach {
    /// Advances of the front, m, rising; one a realisation that is a sample or stable.
    advances_m: Vec<f64>,
    /// Retreats of the crest, m, rising.
    retreats_m: Vec<f64>,
    confidence: f64,
}

/// A probability with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probability {
    /// Realisations in which it came true.
    pub hits: u64,
    /// Their share.
    pub share: f64,
    /// Its Clopper-Pearson interval.
    pub interval: Interval,
}

/// Counts `outcomes`; failed analyses are left out.
pub fn reach(outcomes: &[Outcome], confidence: f64) -> Reach {
    let decided = |of: fn(&Measures) -> f64| -> Vec<f64> {
        let kept = outcomes.iter().filter(|o| o.outcome != OutcomeKind::Failed);
        kept.filter_map(|o| {
            o.measures.as_ref().map(|m| if o.outcome == OutcomeKind::Runout { of(m) } else { 0.0 })
        })
        .collect()
    };
    let sorted = |mut values: Vec<f64>| {
        values.retain(|v| v.is_finite());
        values.sort_by(f64::total_cmp);
        values
    };
    Reach {
        advances_m: sorted(decided(|m| m.toe_advance_m)),
        retreats_m: sorted(decided(|m| m.crest_retreat_m)),
        confidence,
    }
}

impl Reach {
    /// The probability that the front goes beyond `distance_m` in front of the toe; absent without realisations.
    pub fn in_front(&self, distance_m: f64) -> Option<Probability> {
        self.beyond(&self.advances_m, distance_m)
    }

    /// The probability that the ground is lost at `distance_m` behind the crest's edge.
    pub fn behind(&self, distance_m: f64) -> Option<Probability> {
        self.beyond(&self.retreats_m, distance_m)
    }

    fn beyond(&self, sorted: &[f64], distance_m: f64) -> Option<Probability> {
        let hits = sorted.len() - sorted.partition_point(|value| *value <= distance_m);
        probability(hits as u64, sorted.len() as u64, self.confidence)
    }

    /// The probability of what came true in so many of these realisations; absent without realisations.
    pub fn probability(&self, hits: u64) -> Option<Probability> {
        probability(hits, self.advances_m.len() as u64, self.confidence)
    }

    /// The farthest advance, m; 0 without realisations.
    pub fn farthest_m(&self) -> f64 {
        self.advances_m.last().copied().unwrap_or(0.0)
    }

    /// The largest retreat, m; 0 without realisations.
    pub fn largest_retreat_m(&self) -> f64 {
        self.retreats_m.last().copied().unwrap_or(0.0)
    }
}

fn probability(hits: u64, trials: u64, confidence: f64) -> Option<Probability> {
    let interval = interval::probability(hits, trials, confidence)?;
    Some(Probability { hits, share: hits as f64 / trials as f64, interval })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Advances 0, 0, 1, 2, 2 m, counted by hand; at a front's own place the ground is not reached.
    #[test]
    fn probabilities_fall_with_distance_and_are_those_counted_by_hand() {
        let reach =
            Reach { advances_m: vec![0.0, 0.0, 1.0, 2.0, 2.0], retreats_m: vec![0.0; 5], confidence: 0.95 };
        let hits = |x| reach.in_front(x).expect("there are realisations").hits;
        assert_eq!([0.0, 0.5, 1.0, 1.9, 2.0, 7.0].map(hits), [3, 3, 2, 2, 0, 0]);
        assert_eq!(reach.in_front(0.0).unwrap().share, 0.6);
        assert_eq!(reach.behind(0.0).unwrap().hits, 0);
        assert_eq!(Reach::default().in_front(0.0), None);
    }
}
