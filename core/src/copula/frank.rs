//! Frank copula, theta real, theta = 0 being independence (Nelsen 2006, family 4.2.5).
//!
//! Negative theta is written in s = -theta with growing exponentials, positive theta with decaying ones: then no
//! difference cancels, and no reflection is needed.

use crate::special::debye1;

/// Below this theta the copula differs from independence by less than rounding.
const INDEPENDENT: f64 = 1e-15;

pub(super) fn log_density(theta: f64, u: f64, v: f64) -> f64 {
    if theta.abs() < INDEPENDENT {
        return 0.0;
    }
    if theta < 0.0 {
        // s (e^s - 1) e^{s(u+v)} / (e^s - 1 + (e^{su} - 1)(e^{sv} - 1))^2, both sides over e^{2s}.
        let s = -theta;
        let grown = -libm::expm1(-s);
        let bracket = grown + libm::expm1(s * u) * (libm::expm1(s * v) * libm::exp(-s));
        return libm::log(s * grown) + s * (u + v - 1.0) - 2.0 * libm::log(bracket);
    }
    let top = libm::log(-theta * libm::expm1(-theta)) - theta * (u + v);
    top - 2.0 * libm::log(bracket(theta, u, v))
}

/// 1 - e^{-t} - (1 - e^{-tu})(1 - e^{-tv}) for t > 0, as a sum of positive terms.
fn bracket(t: f64, u: f64, v: f64) -> f64 {
    let decay = |x: f64| -libm::expm1(-t * x);
    libm::exp(-t * u) * decay(v) + libm::exp(-t * v) * decay(1.0 - v)
}

pub(super) fn cdf(theta: f64, u: f64, v: f64) -> f64 {
    if theta.abs() < INDEPENDENT {
        return u * v;
    }
    // In this order nothing overflows before the limit on theta.
    let product = libm::expm1(-theta * u) * (libm::expm1(-theta * v) / libm::expm1(-theta));
    if theta > 0.0 && product < -0.5 {
        return -(libm::log(bracket(theta, u, v)) - libm::log(-libm::expm1(-theta))) / theta;
    }
    -libm::log1p(product) / theta
}

pub(super) fn conditional(theta: f64, u: f64, v: f64) -> f64 {
    if theta.abs() < INDEPENDENT {
        return v;
    }
    if theta < 0.0 {
        // e^{su} (e^{sv} - 1) / (e^s - 1 + (e^{su} - 1)(e^{sv} - 1)), both sides over e^s.
        let s = -theta;
        let grown = libm::expm1(s * v);
        let bracket = -libm::expm1(-s) + libm::expm1(s * u) * (grown * libm::exp(-s));
        return (libm::exp(s * (u - 1.0)) * grown / bracket).min(1.0);
    }
    (-libm::exp(-theta * u) * libm::expm1(-theta * v) / bracket(theta, u, v)).min(1.0)
}

#[inline]
pub(super) fn conditional_quantile(theta: f64, u: f64, w: f64) -> f64 {
    if theta.abs() < INDEPENDENT {
        return w;
    }
    // One minus or plus a share: v = -ln(1 + w (e^{-t} - 1) / (w + (1 - w) e^{-tu})) / t.
    let decayed = libm::exp(-theta * u);
    let bottom = w + (1.0 - w) * decayed;
    let change = w * libm::expm1(-theta) / bottom;
    if change < -0.5 {
        let left = (1.0 - w) * decayed + w * libm::exp(-theta);
        return libm::log(bottom / left) / theta;
    }
    -libm::log1p(change) / theta
}

/// tau = 1 - 4 (1 - D1(theta)) / theta, odd in theta.
pub(super) fn kendall_tau(theta: f64) -> f64 {
    // The series in Bernoulli numbers, 4 B_2k theta^(2k-1) / ((2k+1) (2k)!): below 1/2 seven terms leave 1e-16.
    const SERIES: [f64; 7] = [
        1.0 / 9.0,
        -1.0 / 900.0,
        1.0 / 52_920.0,
        -1.0 / 2_721_600.0,
        1.0 / 131_725_440.0,
        -691.0 / 4_249_941_696_000.0,
        1.0 / 280_215_936_000.0,
    ];
    if theta.abs() < 0.5 {
        let square = theta * theta;
        return theta * SERIES.iter().rev().fold(0.0, |sum, c| sum * square + c);
    }
    let size = theta.abs();
    (1.0 - 4.0 / size * (1.0 - debye1(size))).copysign(theta)
}
