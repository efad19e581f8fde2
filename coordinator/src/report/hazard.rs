//! Depths and speeds along the ground in front of the toe, over the profiles of replayed samples: quantiles given failure,
//! with intervals that rest on no distribution.

use crate::replays::profile::{Profile, Stations};
use runout_core::estimate::interval::{self, Interval};

/// Quantiles of one quantity, a number a column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quantiles {
    /// Median.
    pub median: Vec<f64>,
    /// Interval of the median; absent with too few profiles.
    pub median_interval: Option<Vec<Interval>>,
    /// Exceeded in one of ten.
    pub one_in_ten: Vec<f64>,
    /// The largest.
    pub largest: Vec<f64>,
}

/// The profiles together.
#[derive(Debug, Clone, PartialEq)]
pub struct Hazard {
    /// Middles of the columns, m from the toe.
    pub x_m: Vec<f64>,
    /// Profiles.
    pub profiles: usize,
    /// Depth of the soil above the original ground, m.
    pub depth_m: Quantiles,
    /// Highest speed, m/s.
    pub speed_m_s: Quantiles,
}

/// Puts profiles together; none without any.
pub fn hazard(stations: &Stations, profiles: &[&Profile], confidence: f64) -> Option<Hazard> {
    (!profiles.is_empty()).then(|| Hazard {
        x_m: (0..stations.count).map(|column| stations.x_m(column)).collect(),
        profiles: profiles.len(),
        depth_m: quantiles(profiles, |p| &p.depth_m, confidence),
        speed_m_s: quantiles(profiles, |p| &p.speed_m_s, confidence),
    })
}

fn quantiles(profiles: &[&Profile], of: impl Fn(&Profile) -> &Vec<f64>, confidence: f64) -> Quantiles {
    let n = profiles.len();
    let places = interval_places(n, 0.5, confidence);
    let mut found = Quantiles { median_interval: places.map(|_| Vec::new()), ..Quantiles::default() };
    for column in 0..of(profiles[0]).len() {
        let mut sorted: Vec<f64> = profiles.iter().map(|profile| of(profile)[column]).collect();
        sorted.sort_by(f64::total_cmp);
        found.median.push(quantile(&sorted, 0.5));
        found.one_in_ten.push(quantile(&sorted, 0.9));
        found.largest.push(sorted[n - 1]);
        if let (Some(intervals), Some((low, high))) = (&mut found.median_interval, places) {
            intervals.push([sorted[low], sorted[high]]);
        }
    }
    found
}

/// The smallest of the sorted values that at most a share 1 - p of them exceeds.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    sorted[((p * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len()) - 1]
}

/// Places (from 0) of the order statistics of `n` values between which the quantile at level `p` lies with at least this
/// confidence (David & Nagaraja 2003, Section 7.1); none with too few values.
///
/// The k-th smallest is a lower end if k - 1 values below the quantile would be few enough, which is so exactly if the
/// Clopper-Pearson upper bound of k - 1 in n is at most p; the upper end likewise.
fn interval_places(n: usize, p: f64, confidence: f64) -> Option<(usize, usize)> {
    let bounds = |hits: usize| interval::probability(hits as u64, n as u64, confidence);
    let low = (0..n).take_while(|k| bounds(*k).is_some_and(|[_, high]| high <= p)).last()?;
    let high = (1..=n).find(|k| bounds(*k).is_some_and(|[low, _]| low >= p))?;
    Some((low, high - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Textbook places for the median at 95 %: 6 values: 1st and 6th; 20 values: 6th and 15th; 5 values are too few.
    #[test]
    fn the_medians_interval_lies_between_the_textbook_order_statistics() {
        assert_eq!(interval_places(5, 0.5, 0.95), None);
        assert_eq!(interval_places(6, 0.5, 0.95), Some((0, 5)));
        assert_eq!(interval_places(20, 0.5, 0.95), Some((5, 14)));
    }

    #[test]
    fn quantiles_are_those_of_each_column() {
        let profile = |depth: f64| Profile { depth_m: vec![depth, 0.0], speed_m_s: vec![2.0 * depth, 1.0] };
        let profiles: Vec<Profile> = (1..=10).map(|k| profile(f64::from(k))).collect();
        let all: Vec<&Profile> = profiles.iter().collect();
        let depth = quantiles(&all, |p| &p.depth_m, 0.95);
        assert_eq!((&depth.median[..], &depth.one_in_ten[..]), (&[5.0, 0.0][..], &[9.0, 0.0][..]));
        assert_eq!(depth.largest, [10.0, 0.0]);
        assert_eq!(quantiles(&all, |p| &p.speed_m_s, 0.95).median, [10.0, 1.0]);
    }
}
