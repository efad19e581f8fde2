//! Which realisations the report runs again: the slides it shows, and a random choice of samples for the profile along the
//! ground.

use rand::Rng;
use runout_core::seed::{self, Purpose};

/// A sample that is shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Pick {
    /// What it stands for: `median`, `90th percentile` ...
    pub label: String,
    /// Index of the realisation.
    pub index: u64,
    /// Its runout, m.
    pub runout_m: f64,
}

/// The shown samples and the shares of samples that do not go beyond them.
const SHOWN: [(&str, f64); 4] =
    [("median", 0.5), ("90th percentile", 0.9), ("99th percentile", 0.99), ("longest", 1.0)];

/// The median sample, those of the 90th and 99th percentile and the longest: order statistics, so that each is a slide that
/// happened. With few samples some are the same one.
pub fn picks(indices: &[u64], samples_m: &[f64]) -> Vec<Pick> {
    let mut order: Vec<usize> = (0..samples_m.len()).collect();
    order.sort_by(|a, b| samples_m[*a].total_cmp(&samples_m[*b]));
    let mut picks: Vec<Pick> = Vec::new();
    for (label, share) in SHOWN {
        let place = (share * order.len() as f64).ceil().max(1.0) as usize;
        let Some(&sample) = order.get(place - 1) else { continue };
        match picks.iter_mut().find(|pick| pick.index == indices[sample]) {
            Some(pick) => pick.label = format!("{} and {label}", pick.label),
            None => picks.push(Pick {
                label: label.to_owned(),
                index: indices[sample],
                runout_m: samples_m[sample],
            }),
        }
    }
    picks
}

/// At most `count` of the indices at random, each with equal chance: those that come first in an order that the seed
/// shuffles, so that a larger choice holds the smaller one. In rising order.
pub fn chosen(indices: &[u64], count: usize, campaign_seed: u64, purpose: Purpose) -> Vec<u64> {
    let key = |index: u64| seed::stream(campaign_seed, index, purpose).next_u64();
    let mut keyed: Vec<(u64, u64)> = indices.iter().map(|index| (key(*index), *index)).collect();
    keyed.sort_unstable();
    let mut chosen: Vec<u64> = keyed.into_iter().take(count).map(|(_, index)| index).collect();
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picks_are_order_statistics_and_equal_ones_are_one() {
        let samples: Vec<f64> = (0..200).map(|i| f64::from((i * 7) % 200)).collect();
        let indices: Vec<u64> = (0..200).map(|i| 3 * i).collect();
        let runouts: Vec<f64> = picks(&indices, &samples).iter().map(|p| p.runout_m).collect();
        assert_eq!(runouts, [99.0, 179.0, 197.0, 199.0]);
        assert!(picks(&indices, &samples).iter().all(|p| samples[p.index as usize / 3] == p.runout_m));
        let few = picks(&[4, 9], &[2.0, 1.0]);
        assert_eq!(few.len(), 2);
        assert_eq!(
            (few[1].label.as_str(), few[1].index),
            ("90th percentile and 99th percentile and longest", 4)
        );
        assert!(picks(&[], &[]).is_empty());
    }

    #[test]
    fn larger_choices_hold_smaller_ones() {
        let indices: Vec<u64> = (0..100).collect();
        let choice = |count| chosen(&indices, count, 7, Purpose::ReportReplays);
        let (few, more) = (choice(5), choice(20));
        assert_eq!((few.len(), more.len()), (5, 20));
        assert!(few.iter().all(|index| more.contains(index)));
        assert_eq!(choice(1000), indices);
        assert_ne!(chosen(&indices, 5, 8, Purpose::ReportReplays), few);
    }
}
