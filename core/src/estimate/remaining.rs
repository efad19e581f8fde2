//! How many samples a stopping rule is likely to need, for progress displays. A guess: no decision uses it.

use super::moments::Moments;
use super::rule;
use crate::campaign::StopRule;

/// Fewest samples from which a guess is made (a confession: a standard deviation from 20 samples is known to
/// about 16 %, a guess from fewer jumps about).
pub const FEWEST_SAMPLES: u64 = 20;

/// Growth of the sample number from one point of the scan of the paper's rule to the next.
const SCAN_GROWTH: f64 = 1.02;

/// Most deviations that the share is read off, taken evenly from the samples (a confession: it is then known to half a
/// per cent, and the guess costs a millisecond also after a million samples).
const MOST_DEVIATIONS: usize = 10_000;

/// Where the scan gives up.
const MOST_SAMPLES: f64 = 1e9;

/// The number of samples, counted from the campaign's start, at which `rule` is likely to hold; absent below
/// [`FEWEST_SAMPLES`], without spread, or when no number within reach will do.
pub(super) fn samples_needed(
    rule: &StopRule,
    samples_m: &[f64],
    moments: &Moments,
    hits: &[u64],
) -> Option<f64> {
    if moments.count() < FEWEST_SAMPLES {
        return None;
    }
    match rule {
        StopRule::Paper { tolerance, relative, patience } => {
            paper_median(*tolerance, *relative, *patience, samples_m, moments)
        }
        StopRule::Interval { .. } => interval_number(rule, moments, hits),
    }
}

/// Widths shrink as 1 / sqrt(n), so that the number needed is n (width now / width asked)^2, the worst of all parts.
fn interval_number(rule: &StopRule, moments: &Moments, hits: &[u64]) -> Option<f64> {
    let StopRule::Interval { confidence, mean_half_width, sd_half_width, exceedance } = rule else {
        return None;
    };
    let mut worst = 0.0_f64;
    if let Some(most) = mean_half_width {
        worst = worst.max(rule::mean_half_width(moments, *confidence)? / most);
    }
    if let Some(most) = sd_half_width {
        worst = worst.max(rule::sd_half_width(moments, *confidence)? / most);
    }
    for (target, &hits) in exceedance.iter().zip(hits) {
        let now = rule::exceedance_half_width(hits, moments.count(), *confidence)?;
        worst = worst.max(now / target.half_width);
    }
    Some(moments.count() as f64 * worst * worst)
}

/// Median number of samples at which the paper's rule fires for the first time.
///
/// At sample n the conditions leave the deviations d = X - mean with |d| < e n and |d^2 - s^2| < e n; `p(n)` is the
/// share of the samples so far that lie there. A run of k such samples ends at n with probability about
/// p^k (1 - p), so that the median is where the sum of these reaches ln 2.
fn paper_median(
    tolerance: f64,
    relative: bool,
    patience: u64,
    samples_m: &[f64],
    moments: &Moments,
) -> Option<f64> {
    let (mean, variance) = (moments.mean()?, moments.population_variance()?);
    let (of_mean, of_variance) = rule::paper_tolerances(tolerance, relative, mean, variance);
    let every = samples_m.len().div_ceil(MOST_DEVIATIONS).max(1);
    let mut deviations: Vec<f64> = samples_m.iter().step_by(every).map(|x| (x - mean).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    let share = |n: f64| {
        let low = (variance - of_variance * n).max(0.0).sqrt();
        let high = (variance + of_variance * n).sqrt().min(of_mean * n);
        let below = |limit: f64| deviations.partition_point(|d| *d < limit);
        below(high).saturating_sub(below(low)) as f64 / deviations.len() as f64
    };

    let mut hazard = 0.0;
    let mut n = moments.count() as f64;
    while n < MOST_SAMPLES {
        let next = (n * SCAN_GROWTH).max(n + 1.0);
        let p = share(0.5 * (n + next));
        let run = libm::pow(p, patience as f64);
        // Where every sample meets the conditions, the run is complete after `patience` more samples.
        if p >= 1.0 {
            return Some(n + patience as f64);
        }
        hazard += run * (if patience > 1 { 1.0 - p } else { 1.0 }) * (next - n);
        if hazard >= std::f64::consts::LN_2 {
            return Some(next);
        }
        n = next;
    }
    None
}
