//! Ranks, pseudo-observations and correlation coefficients.

use crate::campaign::Recipe;

/// Ranks from 1, ties broken by row order (the paper's).
pub(super) fn ordinal(sample: &[f64]) -> Vec<f64> {
    let mut ranks = vec![0.0; sample.len()];
    for (place, row) in order(sample).into_iter().enumerate() {
        ranks[row] = (place + 1) as f64;
    }
    ranks
}

/// Ranks from 1, ties sharing the mean of theirs.
pub(super) fn average(sample: &[f64]) -> Vec<f64> {
    let order = order(sample);
    let mut ranks = vec![0.0; sample.len()];
    let mut start = 0;
    while start < order.len() {
        let value = sample[order[start]];
        let end = start + order[start..].iter().take_while(|&&row| sample[row] == value).count();
        // Ranks start + 1 to end.
        let shared = 0.5 * (start + 1 + end) as f64;
        order[start..end].iter().for_each(|&row| ranks[row] = shared);
        start = end;
    }
    ranks
}

/// Pseudo-observations rank / (n + 1) (the paper, Eqs. 10 to 12), one vector a property.
pub(super) fn pseudo_observations(columns: &[&[f64]], recipe: Recipe) -> Vec<Vec<f64>> {
    let ranks = match recipe {
        Recipe::Paper => ordinal,
        Recipe::Likelihood => average,
    };
    let scaled = |column: &&[f64]| {
        let cells = (column.len() + 1) as f64;
        ranks(column).into_iter().map(|rank| rank / cells).collect()
    };
    columns.iter().map(scaled).collect()
}

/// Rows in rising order of their values; equal values stay in row order.
fn order(sample: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..sample.len()).collect();
    order.sort_by(|&a, &b| sample[a].total_cmp(&sample[b]));
    order
}

/// Kendall's tau_b: concordant minus discordant pairs over the geometric mean of the pairs untied in either sample.
/// Zero if a sample has no spread.
pub(super) fn kendall_tau(x: &[f64], y: &[f64]) -> f64 {
    let (mut sum, mut untied_x, mut untied_y) = (0_i64, 0_i64, 0_i64);
    let sign = |a: f64, b: f64| i64::from(a > b) - i64::from(a < b);
    for i in 0..x.len() {
        for j in 0..i {
            let (sx, sy) = (sign(x[i], x[j]), sign(y[i], y[j]));
            sum += sx * sy;
            untied_x += sx * sx;
            untied_y += sy * sy;
        }
    }
    let scale = libm::sqrt(untied_x as f64 * untied_y as f64);
    if scale > 0.0 { sum as f64 / scale } else { 0.0 }
}

/// Pearson's correlation; zero if a sample has no spread.
pub(super) fn pearson(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (a, b) in x.iter().zip(y) {
        let (a, b) = (a - mean_x, b - mean_y);
        xx += a * a;
        yy += b * b;
        xy += a * b;
    }
    let scale = libm::sqrt(xx * yy);
    if scale > 0.0 { xy / scale } else { 0.0 }
}

/// Spearman's rho: Pearson's correlation of the average ranks.
pub fn spearman(x: &[f64], y: &[f64]) -> f64 {
    pearson(&average(x), &average(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_are_ranked_by_either_rule() {
        let sample = [3.0, 1.0, 3.0, 2.0, 3.0];
        assert_eq!(ordinal(&sample), [3.0, 1.0, 4.0, 2.0, 5.0]);
        assert_eq!(average(&sample), [4.0, 1.0, 4.0, 2.0, 4.0]);
    }

    /// Four pairs: 3 untied in x of 3, with one tie in y: tau_b = 2 / sqrt(3 * 2).
    #[test]
    fn tau_counts_ties() {
        assert!((kendall_tau(&[1.0, 2.0, 3.0], &[1.0, 2.0, 2.0]) - 2.0 / libm::sqrt(6.0)).abs() < 1e-15);
        assert_eq!(kendall_tau(&[1.0, 1.0], &[1.0, 2.0]), 0.0);
        assert_eq!(spearman(&[1.0, 5.0, 9.0], &[3.0, 2.0, 1.0]), -1.0);
    }
}
