//! Two-sided confidence intervals of a mean, a standard deviation and a probability.

use super::moments::Moments;
use super::quantiles::{beta_quantile, student_t_two_sided};
use crate::special::normal_quantile;

/// An interval [low, high].
pub type Interval = [f64; 2];

/// Student's interval of the mean: mean -+ t(n - 1) s / sqrt(n). Absent below two values.
///
/// Exact for normal samples; for skewed ones its coverage approaches the level as n grows (central limit theorem).
pub fn mean(moments: &Moments, confidence: f64) -> Option<Interval> {
    let n = moments.count() as f64;
    let (centre, sd) = (moments.mean()?, moments.sd()?);
    let half = student_t_two_sided(confidence, n - 1.0) * sd / n.sqrt();
    Some([centre - half, centre + half])
}

/// Interval of the standard deviation that holds for any distribution with a fourth moment. Absent below four
/// values or without spread.
///
/// Var(s^2) = sigma^4 (kappa - (n - 3)/(n - 1)) / n for any parent of kurtosis kappa; the delta method carries it to
/// ln s, so that the interval is s exp(-+ z sqrt(kappa - (n - 3)/(n - 1)) / (2 sqrt(n))). This is the large-sample
/// form of Bonett (2006, Computational Statistics & Data Analysis 50, 775-782) with the sample's kurtosis, which is too
/// low in small samples of heavy tails: the interval is then too narrow.
/// The logarithm keeps the interval positive and nearly symmetric in coverage; the chi-square interval is not used
/// because it holds for normal samples only and runout distances are not normal.
pub fn sd(moments: &Moments, confidence: f64) -> Option<Interval> {
    if moments.count() < 4 {
        return None;
    }
    let n = moments.count() as f64;
    let (sd, kurtosis) = (moments.sd()?, moments.kurtosis()?);
    // Two equal halves have kurtosis 1, the least there is; rounding must not make the root imaginary.
    let spread = (kurtosis - (n - 3.0) / (n - 1.0)).max(0.0).sqrt();
    let ratio = libm::exp(two_sided_z(confidence) * spread / (2.0 * n.sqrt()));
    Some([sd / ratio, sd * ratio])
}

/// Clopper & Pearson's (1934) interval of a probability after `hits` in `trials`: never below the level in coverage,
/// whatever the probability. Absent without trials.
pub fn probability(hits: u64, trials: u64, confidence: f64) -> Option<Interval> {
    if trials == 0 || hits > trials {
        return None;
    }
    let (k, n) = (hits as f64, trials as f64);
    let tail = 0.5 * (1.0 - confidence);
    let low = if hits == 0 { 0.0 } else { beta_quantile(tail, k, n - k + 1.0) };
    let high = if hits == trials { 1.0 } else { beta_quantile(1.0 - tail, k + 1.0, n - k) };
    Some([low, high])
}

/// Half the width of an interval.
pub fn half_width(interval: Interval) -> f64 {
    0.5 * (interval[1] - interval[0])
}

/// The z with P(|Z| < z) = `confidence` for a standard normal Z.
pub fn two_sided_z(confidence: f64) -> f64 {
    normal_quantile(0.5 + 0.5 * confidence)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_hit_in_a_thousand_is_known_badly() {
        // The interval of a 0.1 % exceedance read off 1000 samples: 0.0025 % to 0.556 %.
        let [low, high] = probability(1, 1000, 0.95).unwrap();
        assert!((low - 0.000_025_3).abs() < 5e-8, "{low}");
        assert!((high - 0.005_558_9).abs() < 5e-7, "{high}");
    }

    #[test]
    fn no_hit_and_all_hits_have_closed_forms() {
        let [low, high] = probability(0, 100, 0.95).unwrap();
        assert_eq!(low, 0.0);
        assert!((high - (1.0 - libm::pow(0.025, 0.01))).abs() < 1e-13);
        let [low, high] = probability(100, 100, 0.95).unwrap();
        assert!((low - libm::pow(0.025, 0.01)).abs() < 1e-13);
        assert_eq!(high, 1.0);
        assert_eq!(probability(0, 0, 0.95), None);
    }

    #[test]
    fn the_mean_of_a_small_sample_has_the_textbook_interval() {
        // Mean 3, s = 1.5811388, t(4) = 2.776445, half-width 1.963244.
        let [low, high] = mean(&Moments::of(&[1.0, 2.0, 3.0, 4.0, 5.0]), 0.95).unwrap();
        assert!((low - 1.036_757).abs() < 1e-6 && (high - 4.963_243).abs() < 1e-6, "{low} {high}");
    }

    #[test]
    fn no_spread_gives_no_interval_of_the_spread() {
        assert_eq!(sd(&Moments::of(&[2.0; 10]), 0.95), None);
        assert!(sd(&Moments::of(&[1.0, 2.0, 1.0, 2.0]), 0.95).is_some_and(|i| i[0].is_finite()));
    }
}
