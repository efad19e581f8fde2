//! Strength that decays exponentially with plastic strain (see [`crate::gimp::Softening`]).
//!
//! Each point carries x, what is left of the difference between peak and residual strength: 1 at first, times
//! exp(-r d eps) in a step with the equivalent plastic strain d eps. The strengths of a step follow from x at its start.

use super::{Elastic, Strength};
use crate::gimp::block::{Block, Extra};
use crate::gimp::lanes::Lanes;

/// Taylor coefficients of sin(a)/a in powers of a^2, highest first: to 1e-18 for a up to 1.4 rad (80 degrees).
const SINE: [f64; 11] = [
    1.0 / 51_090_942_171_709_440_000.0,
    -1.0 / 121_645_100_408_832_000.0,
    1.0 / 355_687_428_096_000.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    -1.0 / 5_040.0,
    1.0 / 120.0,
    -1.0 / 6.0,
    1.0,
];

/// Taylor coefficients of cos(a) in powers of a^2, highest first.
const COSINE: [f64; 11] = [
    1.0 / 2_432_902_008_176_640_000.0,
    -1.0 / 6_402_373_705_728_000.0,
    1.0 / 20_922_789_888_000.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    -1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    -1.0 / 720.0,
    1.0 / 24.0,
    -1.0 / 2.0,
    1.0,
];

/// Sine and cosine of angles from 0 to 80 degrees, rad.
#[inline(always)]
fn sine_cosine<S: Lanes>(angle: S) -> (S, S) {
    let square = angle * angle;
    let (mut sine, mut cosine) = (S::splat(SINE[0]), S::splat(COSINE[0]));
    for (&s, &c) in SINE[1..].iter().zip(&COSINE[1..]) {
        sine = sine.mul_add(square, S::splat(s));
        cosine = cosine.mul_add(square, S::splat(c));
    }
    (sine * angle, cosine)
}

/// Elastic constants and strength of eight points at what is left of their peak strength.
#[inline(always)]
pub(in crate::gimp) fn softened<S: Lanes>(block: &Block, extra: &Extra) -> (Elastic<S>, Strength<S>) {
    let one = S::splat(1.0);
    let left = S::load(&extra.peak_left);
    let present = |peak: S, residual: S| peak * (one - residual).mul_add(left, residual);
    let cohesion = present(S::load(&extra.cohesion), S::load(&extra.residual_cohesion));
    let friction = present(S::load(&extra.friction_angle), S::load(&extra.residual_friction_angle));
    let dilation = present(S::load(&extra.dilation_angle), S::load(&extra.residual_dilation_angle));
    let (sin_phi, cos_phi) = sine_cosine(friction);
    let (sin_psi, _) = sine_cosine(dilation);
    let with_friction = sin_phi.gt(S::splat(0.0));
    let apex = S::select(with_friction, cohesion * cos_phi / sin_phi, S::splat(f64::INFINITY));
    let strength = Strength {
        sin_phi,
        two_c_cos_phi: (cohesion + cohesion) * cos_phi,
        apex,
        tension: S::load(&extra.tension_cutoff).min(apex),
    };
    (Elastic { bulk: S::load(&block.bulk), shear: S::load(&block.shear), sin_psi }, strength)
}

/// What is left after a step with the equivalent plastic strain `plastic`: times exp(-a), a = rate x strain, with 1/exp(a)
/// from the first seven terms of its series. That never grows or changes sign; for a below 0.1, far more than a step
/// brings, it is right to 2e-11.
#[inline(always)]
pub(in crate::gimp) fn decay<S: Lanes>(left: S, rate: S, plastic: S) -> S {
    let one = S::splat(1.0);
    let a = rate * plastic;
    let mut sum = one;
    for n in [6.0, 5.0, 4.0, 3.0, 2.0, 1.0] {
        sum = (a * S::splat(1.0 / n)).mul_add(sum, one);
    }
    left / sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gimp::lanes::{Baseline, V8};

    fn first(lanes: Baseline) -> f64 {
        let mut v = V8::ZERO;
        lanes.store(&mut v);
        v.0[0]
    }

    /// Sine and cosine to two units in the last place of 1.
    #[test]
    fn sines_are_those_of_the_library() {
        for degrees in 0..=80 {
            let angle = f64::from(degrees).to_radians();
            let (sine, cosine) = sine_cosine(Baseline::splat(angle));
            assert!((first(sine) - libm::sin(angle)).abs() < 4.5e-16, "sin {degrees}");
            assert!((first(cosine) - libm::cos(angle)).abs() < 4.5e-16, "cos {degrees}");
        }
    }

    /// Many small steps of plastic strain take the strength along the exponential, whatever their size.
    #[test]
    fn the_decay_is_exponential_and_does_not_depend_on_the_step() {
        for steps in [100, 1000, 10_000] {
            let mut left = Baseline::splat(1.0);
            for _ in 0..steps {
                left = decay(left, Baseline::splat(5.0), Baseline::splat(0.4 / f64::from(steps)));
            }
            let error = first(left) / libm::exp(-2.0) - 1.0;
            assert!(error.abs() < 1e-10, "{steps} steps: {error}");
        }
    }

    /// Peak, residual and half-way strengths follow c = c_r + (c_p - c_r) x, and the same for the angles.
    #[test]
    fn strength_goes_from_peak_to_residual() {
        let degrees = |d: f64| V8([d.to_radians(); 8]);
        let (block, mut extra) = (Block::EMPTY, Extra::EMPTY);
        extra.cohesion = V8([20e3; 8]);
        extra.friction_angle = degrees(30.0);
        extra.dilation_angle = degrees(10.0);
        extra.residual_cohesion = V8([0.1; 8]);
        extra.residual_friction_angle = V8([0.6; 8]);
        extra.residual_dilation_angle = V8([0.0; 8]);
        extra.tension_cutoff = V8([8e3; 8]);
        for (left, c, phi, psi) in [(1.0, 20e3, 30.0, 10.0), (0.5, 11e3, 24.0, 5.0), (0.0, 2e3, 18.0, 0.0)] {
            extra.peak_left = V8([left; 8]);
            let (elastic, strength) = softened::<Baseline>(&block, &extra);
            let (sin, cos) = libm::sincos(f64::to_radians(phi));
            let close = |found: Baseline, expected: f64| {
                assert!((first(found) - expected).abs() <= 1e-14 * expected.abs().max(1.0), "{expected}");
            };
            close(strength.sin_phi, sin);
            close(strength.two_c_cos_phi, 2.0 * c * cos);
            close(strength.apex, c * cos / sin);
            close(strength.tension, f64::min(8e3, c * cos / sin));
            close(elastic.sin_psi, libm::sin(f64::to_radians(psi)));
        }
    }
}
