//! Running mean and central moments, one value at a time, in the order given.
//!
//! Welford's recurrence (1962) extended to the fourth central moment (Pébay 2008, Eqs. 1.1 to 1.6 with one new
//! value). The same values in the same order give the same bits.

use serde::{Deserialize, Serialize};

/// Count, mean and sums of central powers of the values so far.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Moments {
    count: u64,
    mean: f64,
    sum2: f64,
    sum3: f64,
    sum4: f64,
}

impl Moments {
    /// Adds a value; the caller sees to it that it is finite.
    pub fn push(&mut self, value: f64) {
        let before = self.count as f64;
        self.count += 1;
        let n = self.count as f64;
        let delta = value - self.mean;
        let step = delta / n;
        let step2 = step * step;
        let term = delta * step * before;
        self.mean += step;
        self.sum4 +=
            term * step2 * (n * n - 3.0 * n + 3.0) + 6.0 * step2 * self.sum2 - 4.0 * step * self.sum3;
        self.sum3 += term * step * (n - 2.0) - 3.0 * step * self.sum2;
        self.sum2 += term;
    }

    /// Moments of `values` in their order.
    pub fn of(values: &[f64]) -> Moments {
        let mut moments = Moments::default();
        values.iter().for_each(|&v| moments.push(v));
        moments
    }

    /// How many values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean; absent without values.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then_some(self.mean)
    }

    /// Unbiased variance, divisor n - 1; absent below two values.
    pub fn variance(&self) -> Option<f64> {
        (self.count > 1).then(|| self.sum2 / (self.count - 1) as f64)
    }

    /// Variance with divisor n, as the paper defines S_n^2 beside its Eq. 23; absent without values.
    pub fn population_variance(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum2 / self.count as f64)
    }

    /// Standard deviation from [`Moments::variance`].
    pub fn sd(&self) -> Option<f64> {
        self.variance().map(f64::sqrt)
    }

    /// Kurtosis m4 / m2^2 (3 for a normal distribution); absent below two values or without spread.
    pub fn kurtosis(&self) -> Option<f64> {
        (self.count > 1 && self.sum2 > 0.0).then(|| self.count as f64 * self.sum4 / (self.sum2 * self.sum2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recurrence_agrees_with_two_passes() {
        let values: Vec<f64> = (0..200).map(|i| 5.0 + f64::from(i * i % 37) * 0.31).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let sum = |power: i32| -> f64 {
            values.iter().map(|v| (0..power).fold(1.0, |product, _| product * (v - mean))).sum()
        };
        let moments = Moments::of(&values);
        // 200 additions, each of relative error 1e-16, of like terms: 1e-12 leaves two digits.
        assert!((moments.mean().unwrap() - mean).abs() < 1e-12);
        assert!((moments.variance().unwrap() / (sum(2) / (n - 1.0)) - 1.0).abs() < 1e-12);
        assert!((moments.population_variance().unwrap() / (sum(2) / n) - 1.0).abs() < 1e-12);
        assert!((moments.kurtosis().unwrap() / (n * sum(4) / (sum(2) * sum(2))) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_undefined_is_absent() {
        assert_eq!(Moments::default().mean(), None);
        let one = Moments::of(&[2.0]);
        assert_eq!((one.mean(), one.variance(), one.kurtosis()), (Some(2.0), None, None));
        assert_eq!(one.population_variance(), Some(0.0));
        assert_eq!(Moments::of(&[2.0, 2.0]).kurtosis(), None);
    }
}
