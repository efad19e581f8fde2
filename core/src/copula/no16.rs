//! Nelsen's Archimedean family 4.2.16, theta >= 0, generator (theta / t + 1)(1 - t) (Nelsen 2006, Table 4.1).
//!
//! Theta = 0 is perfect negative dependence; Kendall's tau never reaches 1/3.

/// S = u + v - 1 - theta (1/u + 1/v - 1).
fn shift(theta: f64, u: f64, v: f64) -> f64 {
    u + v - 1.0 - theta * (1.0 / u + 1.0 / v - 1.0)
}

/// The positive root x of x^2 - s x - theta = 0, without cancellation.
#[inline]
fn positive_root(s: f64, theta: f64) -> f64 {
    let d = f64::sqrt(s * s + 4.0 * theta);
    // One division for both cases, so that many places can be worked on at once.
    let (top, bottom) = if s < 0.0 { (2.0 * theta, d - s) } else { (0.5 * (s + d), 1.0) };
    top / bottom
}

/// 2 theta (1 + theta / u^2)(1 + theta / v^2) / D^3 with D^2 = S^2 + 4 theta, in logarithms because the factors
/// overflow in the lower tail.
pub(super) fn log_density(theta: f64, u: f64, v: f64) -> f64 {
    if theta == 0.0 {
        // All probability lies on the antidiagonal.
        return f64::NEG_INFINITY;
    }
    let s = shift(theta, u, v);
    let factors = libm::log1p(theta / (u * u)) + libm::log1p(theta / (v * v));
    libm::log(2.0 * theta) + factors - 1.5 * libm::log(s * s + 4.0 * theta)
}

pub(super) fn cdf(theta: f64, u: f64, v: f64) -> f64 {
    positive_root(shift(theta, u, v), theta).min(u.min(v))
}

/// h = (1 + theta / u^2)(1 + S / D) / 2.
pub(super) fn conditional(theta: f64, u: f64, v: f64) -> f64 {
    let s = shift(theta, u, v);
    let d = f64::sqrt(s * s + 4.0 * theta);
    // 1 + S / D = 4 theta / (D (D - S)), which does not cancel for negative S.
    let share = if s < 0.0 { 4.0 * theta / (d * (d - s)) } else { 1.0 + s / d };
    (0.5 * (1.0 + theta / (u * u)) * share).min(1.0)
}

/// Closed form: g = w u^2 / (u^2 + theta) is (1 + S / D) / 2, which gives S and with it v.
#[inline]
pub(super) fn conditional_quantile(theta: f64, u: f64, w: f64) -> f64 {
    let square = u * u;
    // sqrt(theta) (2g - 1) / sqrt(g (1 - g)), both sides times u^2 + theta.
    let spread = f64::sqrt(w * square * (square * (1.0 - w) + theta));
    let s = f64::sqrt(theta) * (square * (2.0 * w - 1.0) - theta) / spread;
    let a = s - u + 1.0 + theta * (1.0 - u) / u;
    // Where u is near the precision and w near one, the terms of `a` cancel and the root may end above one.
    positive_root(a, theta).min(1.0)
}

/// tau = 4 theta - 1 - 4 sqrt(theta)(theta - 1) atan(1 / sqrt(theta)) - 4 theta ln(1 + 1 / theta), in [-1, 1/3).
pub(super) fn kendall_tau(theta: f64) -> f64 {
    if theta == 0.0 {
        return -1.0;
    }
    if theta > 50.0 {
        // The terms above cancel; their expansion in 1 / theta, of which twelve terms leave 1e-20.
        let term = |m: i32| {
            let m = f64::from(m);
            4.0 * (1.0 / (2.0 * m + 1.0) + 1.0 / (2.0 * m + 3.0) - 1.0 / (m + 1.0))
        };
        return (0..12).rev().fold(0.0, |sum, m| term(m) - sum / theta) - 1.0;
    }
    let root = f64::sqrt(theta);
    4.0 * theta
        - 1.0
        - 4.0 * root * (theta - 1.0) * libm::atan(1.0 / root)
        - 4.0 * theta * libm::log1p(1.0 / theta)
}
