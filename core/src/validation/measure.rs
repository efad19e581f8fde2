//! What the cases measure on points and on time series.

/// Mean of `values` over the points of each row of cells, from below, by the points' elevation `start_y` at the
/// start.
///
/// The points' own stresses are a staircase (linear shape functions have constant gradients within a cell), while
/// their mean over a cell converges with the second power of its size: the cell means are what is compared.
pub(super) fn row_means(start_y: &[f64], values: &[f64], rows: usize, h: f64) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); rows];
    for (y, value) in start_y.iter().zip(values) {
        let sum = &mut sums[((y / h) as usize).min(rows - 1)];
        *sum = (sum.0 + value, sum.1 + 1.0);
    }
    sums.iter().map(|(sum, count)| sum / count).collect()
}

/// Elevation of the middle of each row of cells.
pub(super) fn row_centres(rows: usize, h: f64) -> Vec<f64> {
    (0..rows).map(|row| (row as f64 + 0.5) * h).collect()
}

/// Root mean square.
pub(super) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / count).sqrt()
}

/// Mean.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Observed order of convergence of two errors, the second at half the cell size.
pub(super) fn order(coarse: f64, fine: f64) -> f64 {
    libm::log2((coarse / fine).abs())
}

/// Times at which a series passes zero, interpolated linearly between its samples.
pub(super) fn zero_crossings(series: &[[f64; 2]]) -> Vec<f64> {
    series
        .windows(2)
        .filter(|pair| pair[0][1] * pair[1][1] < 0.0)
        .map(|pair| {
            let ([t0, v0], [t1, v1]) = (pair[0], pair[1]);
            t0 + (t1 - t0) * v0 / (v0 - v1)
        })
        .collect()
}

/// Period of an oscillation about zero: twice the mean time between crossings.
pub(super) fn period(series: &[[f64; 2]]) -> f64 {
    let crossings = zero_crossings(series);
    let (Some(first), Some(last)) = (crossings.first(), crossings.last()) else { return f64::NAN };
    2.0 * (last - first) / (crossings.len() - 1) as f64
}

/// About `most` samples of `series` up to abscissa `end`.
pub(super) fn every(series: &[[f64; 2]], end: f64, most: usize) -> Vec<[f64; 2]> {
    let until = series.partition_point(|s| s[0] <= end);
    series[..until].iter().step_by((until / most).max(1)).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn period_of_a_triangle_wave() {
        let wave: Vec<[f64; 2]> = (0..9).map(|k| [f64::from(k), [1.0, -1.0][(k / 2 % 2) as usize]]).collect();
        assert_eq!(zero_crossings(&wave), [1.5, 3.5, 5.5, 7.5]);
        assert_eq!(period(&wave), 4.0);
    }

    #[test]
    fn rows_and_orders() {
        assert_eq!(row_means(&[0.1, 0.4, 0.6], &[1.0, 3.0, 5.0], 2, 0.5), [2.0, 5.0]);
        assert_eq!(order(4.0, 1.0), 2.0);
        assert_eq!(rms([3.0, -3.0]), 3.0);
    }
}
