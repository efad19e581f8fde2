//! Plackett copula, theta > 0, theta = 1 being independence (Plackett 1965; Nelsen 2006, section 3.3).
//!
//! The paper's inverse of the conditional distribution lacks the term theta (1 - 2a) in its c. All forms here are
//! rationalised, so that they need no series at theta = 1 and lose nothing where theta is small.

use crate::numeric::EndRule;

/// Square root of B^2 - 4 theta (theta - 1) u v with B = 1 + (theta - 1)(u + v), as a sum of positive terms.
#[inline]
fn discriminant_root(theta: f64, u: f64, v: f64) -> f64 {
    let e = theta - 1.0;
    let same = u * v + (1.0 - u) * (1.0 - v);
    f64::sqrt(if e >= 0.0 {
        1.0 + 2.0 * e * (1.0 - same) + e * e * (u - v) * (u - v)
    } else {
        theta * theta - 2.0 * e * theta * same + e * e * (u + v - 1.0) * (u + v - 1.0)
    })
}

pub(super) fn log_density(theta: f64, u: f64, v: f64) -> f64 {
    let same = u * v + (1.0 - u) * (1.0 - v);
    libm::log(theta * (same + theta * (1.0 - same))) - 3.0 * libm::log(discriminant_root(theta, u, v))
}

pub(super) fn cdf(theta: f64, u: f64, v: f64) -> f64 {
    let b = 1.0 + (theta - 1.0) * (u + v);
    let root = discriminant_root(theta, u, v);
    if b >= 0.0 { 2.0 * theta * u * v / (b + root) } else { 0.5 * (b - root) / (theta - 1.0) }
}

pub(super) fn conditional(theta: f64, u: f64, v: f64) -> f64 {
    let n = 1.0 + (theta - 1.0) * u - (theta + 1.0) * v;
    let root = discriminant_root(theta, u, v);
    if n > 0.0 { 2.0 * theta * v * (1.0 - v) / (root * (root + n)) } else { 0.5 * (1.0 - n / root) }
}

/// The root of b v^2 - c v + a (1 + (theta - 1) u)^2 = 0 on the side of w (Johnson 1987, Multivariate Statistical
/// Simulation; rationalised).
#[inline]
pub(super) fn conditional_quantile(theta: f64, u: f64, w: f64) -> f64 {
    let a = w * (1.0 - w);
    let e = theta - 1.0;
    let b = theta + a * e * e;
    let c = 2.0 * a * (u * theta * theta + 1.0 - u) + theta * (1.0 - 2.0 * a);
    let d = f64::sqrt(theta * (theta + 4.0 * a * u * (1.0 - u) * e * e));
    let side = (1.0 - 2.0 * w) * d;
    let edge = 1.0 - u + theta * u;
    // One division for both cases, so that many places can be worked on at once.
    let (top, bottom) = if w < 0.5 { (2.0 * a * edge * edge, c + side) } else { (0.5 * (c - side), b) };
    top / bottom
}

/// tau = 4 E[C(U, V)] - 1 by quadrature over u and w, with v from the inverse of the conditional distribution: in
/// these coordinates the integrand is smooth inside at any theta.
pub(super) fn kendall_tau(theta: f64) -> f64 {
    // Sixteen steps per unit leave about 1e-13 for theta in [1e-3, 1e3].
    let rule = EndRule::new(16).points;
    let inner = |u: f64| {
        let term = |&(w, weight): &(f64, f64)| weight * cdf(theta, u, conditional_quantile(theta, u, w));
        rule.iter().map(term).sum::<f64>()
    };
    4.0 * rule.iter().map(|&(u, weight)| weight * inner(u)).sum::<f64>() - 1.0
}
