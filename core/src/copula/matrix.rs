//! Cholesky factors of small correlation matrices, in plain arithmetic and fixed order.

/// The lower factor L of a symmetric positive definite matrix, A = L L^T; `None` if it is not positive definite.
pub(crate) fn cholesky(a: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = a.len();
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = a[i][j] - sum;
            if i == j {
                // Below this the matrix is singular to rounding.
                if !(rest.is_finite() && rest > 1e-13) {
                    return None;
                }
                l[i][i] = libm::sqrt(rest);
            } else {
                l[i][j] = rest / l[j][j];
            }
        }
    }
    Some(l)
}

/// Squared length of L^-1 x, that is x^T A^-1 x, for the lower factor `l` of A.
pub(super) fn squared_length(l: &[Vec<f64>], x: &[f64]) -> f64 {
    let mut solved = [0.0; super::MOST_PROPERTIES];
    let mut total = 0.0;
    for (i, row) in l.iter().enumerate() {
        let sum: f64 = (0..i).map(|k| row[k] * solved[k]).sum();
        solved[i] = (x[i] - sum) / row[i];
        total += solved[i] * solved[i];
    }
    total
}

/// Logarithm of the determinant of A from its lower factor.
pub(super) fn log_determinant(l: &[Vec<f64>]) -> f64 {
    2.0 * l.iter().enumerate().map(|(i, row)| libm::log(row[i])).sum::<f64>()
}
