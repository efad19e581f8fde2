//! The exceedance curve of the runout distance: the share of samples beyond each distance, with intervals.
//!
//! Conditional on failure: P(runout > d | the slope failed), from the samples alone. Unconditional: P(runout > d)
//! over samples and stable realisations, a stable one being beyond no distance at or above the threshold. Failed
//! analyses are in neither.

use super::interval::{self, Interval};
use super::quantiles::beta_quantile;
use serde::Serialize;

/// One step of the curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Distance, m: one of the samples.
    pub distance_m: f64,
    /// Samples strictly beyond it.
    pub beyond: u64,
    /// Share of the samples beyond it.
    pub conditional: f64,
    /// Pointwise Clopper-Pearson interval of that share.
    pub conditional_interval: Interval,
    /// Share of samples and stable realisations beyond it.
    pub unconditional: f64,
    /// Pointwise Clopper-Pearson interval of that share.
    pub unconditional_interval: Interval,
}

/// The empirical exceedance curve of `samples_m` with `stable` realisations beside them, one point a distinct sample in
/// increasing order. Pointwise: one point's interval holds at the level, not the whole curve at once.
pub fn curve(samples_m: &[f64], stable: u64, confidence: f64) -> Vec<Point> {
    let mut sorted: Vec<f64> = samples_m.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let samples = sorted.len() as u64;
    let decided = samples + stable;
    let mut points = Vec::new();
    for (place, &distance_m) in sorted.iter().enumerate() {
        if sorted.get(place + 1) == Some(&distance_m) {
            continue;
        }
        let beyond = samples - 1 - place as u64;
        let intervals = (
            interval::probability(beyond, samples, confidence),
            interval::probability(beyond, decided, confidence),
        );
        if let (Some(conditional_interval), Some(unconditional_interval)) = intervals {
            points.push(Point {
                distance_m,
                beyond,
                conditional: beyond as f64 / samples as f64,
                conditional_interval,
                unconditional: beyond as f64 / decided as f64,
                unconditional_interval,
            });
        }
    }
    points
}

/// The empirical distance that is exceeded with a given probability, with distribution-free bounds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EmpiricalDistance {
    /// Exceedance probability asked for (conditional on failure).
    pub probability: f64,
    /// The order statistic at it, m; absent where fewer than 1 / probability samples exist.
    pub distance_m: Option<f64>,
    /// Two-sided interval from order statistics, m; absent where the samples are too few.
    pub interval_m: Option<Interval>,
    /// One-sided upper confidence bound from order statistics, m; absent where the samples are too few.
    pub upper_bound_m: Option<f64>,
    /// Samples that such an upper bound needs at least.
    pub samples_needed: u64,
}

impl EmpiricalDistance {
    /// The distance with its interval, m: what the samples settle by themselves; absent where they are too few for either.
    pub fn settled_m(&self) -> Option<(f64, Interval)> {
        self.distance_m.zip(self.interval_m)
    }
}

/// The distance exceeded with `probability`, from order statistics alone.
///
/// The j-th smallest of n samples is an upper bound of the quantile at level 1 - probability with confidence
/// P(Binomial(n, 1 - probability) < j) (David & Nagaraja 2003, Section 7.1). The largest sample serves as soon as
/// (1 - probability)^n <= 1 - confidence.
pub fn empirical_distance(samples_m: &[f64], probability: f64, confidence: f64) -> EmpiricalDistance {
    let mut sorted: Vec<f64> = samples_m.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let samples_needed = (libm::log1p(-confidence) / libm::log1p(-probability)).ceil() as u64;
    // The smallest sample with at most n * probability samples beyond it.
    let allowed = (n as f64 * probability).floor() as usize;
    EmpiricalDistance {
        probability,
        distance_m: (allowed >= 1).then(|| sorted[n - 1 - allowed.min(n - 1)]),
        interval_m: interval_places(n, 1.0 - probability, confidence)
            .map(|(low, high)| [sorted[low], sorted[high]]),
        upper_bound_m: upper_place(n, probability, confidence).map(|place| sorted[place]),
        samples_needed,
    }
}

/// Place (from 0) of the smallest order statistic that bounds the quantile from above: the smallest j for which the
/// chance that at least j of n samples lie below the quantile is at most 1 - confidence. That chance is
/// I_{1-p}(j, n - j + 1), so that it is small enough exactly if the matching beta quantile is above 1 - p.
fn upper_place(n: usize, probability: f64, confidence: f64) -> Option<usize> {
    let bounds =
        |j: usize| beta_quantile(1.0 - confidence, j as f64, (n - j + 1) as f64) >= 1.0 - probability;
    let place = first(n + 1, |j| j > 0 && bounds(j));
    (place <= n).then(|| place - 1)
}

/// Places (from 0) of the order statistics of `n` values between which the quantile at level `p` lies with at least this
/// confidence (David & Nagaraja 2003, Section 7.1); none with too few values.
///
/// The k-th smallest is a lower end if k - 1 values below the quantile would be few enough, which is so exactly if the
/// Clopper-Pearson upper bound of k - 1 in n is at most p; the upper end likewise. Both bounds rise with k.
pub fn interval_places(n: usize, p: f64, confidence: f64) -> Option<(usize, usize)> {
    let bounds = |hits: usize| interval::probability(hits as u64, n as u64, confidence);
    let low = first(n, |k| bounds(k).is_none_or(|[_, high]| high > p)).checked_sub(1)?;
    let high = first(n + 1, |k| bounds(k).is_some_and(|[low, _]| low >= p));
    (1..=n).contains(&high).then(|| (low, high - 1))
}

/// The first of 0, 1, ... that `holds`, which holds for all that follow; `end` if none below it does.
fn first(end: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut from, mut to) = (0, end);
    while from < to {
        let middle = from + (to - from) / 2;
        if holds(middle) { to = middle } else { from = middle + 1 }
    }
    from
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Textbook places for the median at 95 %: 6 values: 1st and 6th; 20 values: 6th and 15th; 5 values are too few. By the
    /// binomial distribution (R: qbinom) the 90 % quantile of 100 values lies between the 84th and the 96th.
    #[test]
    fn intervals_lie_between_the_textbook_order_statistics() {
        assert_eq!(interval_places(0, 0.5, 0.95), None);
        assert_eq!(interval_places(5, 0.5, 0.95), None);
        assert_eq!(interval_places(6, 0.5, 0.95), Some((0, 5)));
        assert_eq!(interval_places(20, 0.5, 0.95), Some((5, 14)));
        assert_eq!(interval_places(35, 0.9, 0.95), None);
        assert_eq!(interval_places(100, 0.9, 0.95), Some((83, 95)));
    }

    /// A hundred values 1 to 100: ten are beyond 90, and the quantile lies between the 84th and the 96th.
    #[test]
    fn a_distance_read_off_the_samples_has_the_interval_of_its_order_statistics() {
        let samples: Vec<f64> = (1..=100).map(f64::from).collect();
        let found = empirical_distance(&samples, 0.1, 0.95);
        assert_eq!((found.distance_m, found.interval_m), (Some(90.0), Some([84.0, 96.0])));
        assert_eq!(empirical_distance(&samples, 0.01, 0.95).interval_m, None);
    }
}
