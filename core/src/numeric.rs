//! Root finding, minimisation and quadrature for the fit. Deterministic: no host math, fixed order of evaluation.

use std::f64::consts::FRAC_PI_2;

/// Integral of `f` from `a` to `b` by the double-exponential rule (Takahasi and Mori 1974).
///
/// Near machine precision for integrands that are analytic inside; singularities at the ends do no harm.
pub(crate) fn integrate(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    // A step of 1/24 and a range of 3.2 leave an error near 1e-15 for smooth integrands.
    let rule = EndRule::new(24);
    (b - a) * rule.points.iter().map(|&(x, weight)| weight * f(a + (b - a) * x)).sum::<f64>()
}

/// Nodes in (0, 1) and weights of the double-exponential rule.
#[derive(Debug)]
pub(crate) struct EndRule {
    /// Node and weight.
    pub(crate) points: Vec<(f64, f64)>,
}

impl EndRule {
    /// `steps` per unit of the transformed variable.
    pub(crate) fn new(steps: i32) -> EndRule {
        // Beyond 3.2 the weights are below 1e-16 of the largest.
        let last = steps * 16 / 5;
        let step = 1.0 / f64::from(steps);
        let point = |k: i32| {
            let t = f64::from(k) * step;
            let s = FRAC_PI_2 * libm::sinh(t);
            let cosh = libm::cosh(s);
            // (1 + tanh s) / 2 without cancellation at the lower end.
            let node = 1.0 / (1.0 + libm::exp(-2.0 * s));
            (node, 0.5 * step * FRAC_PI_2 * libm::cosh(t) / (cosh * cosh))
        };
        EndRule { points: (-last..=last).map(point).collect() }
    }
}

/// Root of `f` between `a` and `b`, where it changes sign: Chandrupatla (1997), to the last bits.
///
/// Returns `None` if the signs at the ends are equal or a value is not a number.
pub(crate) fn root(a: f64, b: f64, f: impl Fn(f64) -> f64) -> Option<f64> {
    // Bisection alone needs 64 steps for any bracket within a factor of 1e3; this leaves a wide margin.
    const MOST_STEPS: usize = 300;
    let (mut a, mut b) = (a, b);
    let (mut fa, mut fb) = (f(a), f(b));
    if fa == 0.0 {
        return Some(a);
    }
    if fb == 0.0 {
        return Some(b);
    }
    if fa.is_nan() || fb.is_nan() || (fa > 0.0) == (fb > 0.0) {
        return None;
    }
    let mut share = 0.5;
    for _ in 0..MOST_STEPS {
        let x = a + share * (b - a);
        let fx = f(x);
        if fx.is_nan() {
            return None;
        }
        let (c, fc);
        if (fx > 0.0) == (fa > 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let best = if fa.abs() < fb.abs() { a } else { b };
        let least = f64::EPSILON * best.abs().max(f64::MIN_POSITIVE) / (b - a).abs();
        if fx == 0.0 || least > 0.5 {
            return Some(if fx == 0.0 { x } else { best });
        }
        let xi = (a - b) / (c - b);
        let phi = (fa - fb) / (fc - fb);
        share = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        };
        share = share.clamp(least, 1.0 - least);
    }
    Some(if fa.abs() < fb.abs() { a } else { b })
}

/// A minimum found on an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Minimum {
    /// Where.
    pub(crate) x: f64,
    /// The function there.
    pub(crate) value: f64,
    /// Whether it stands at an end of the interval, so that the function may go on falling beyond.
    pub(crate) at_end: bool,
}

/// Least value of `f` on [a, b]: the best of `cells` + 1 equidistant points, refined by golden sections and parabolas
/// (Brent 1973) between its neighbours. Values that are not numbers count as infinite.
pub(crate) fn minimise(a: f64, b: f64, cells: usize, f: impl Fn(f64) -> f64) -> Minimum {
    let f = |x: f64| Some(f(x)).filter(|y| !y.is_nan()).unwrap_or(f64::INFINITY);
    let at = |k: usize| a + (b - a) * k as f64 / cells as f64;
    let (mut best, mut least) = (0, f(a));
    for k in 1..=cells {
        let value = f(at(k));
        if value < least {
            (best, least) = (k, value);
        }
    }
    let (x, value) = brent(at(best.saturating_sub(1)), at((best + 1).min(cells)), &f);
    let margin = 1e-3 * (b - a) / cells as f64;
    let (x, value) = if value <= least { (x, value) } else { (at(best), least) };
    Minimum { x, value, at_end: x < a + margin || x > b - margin }
}

/// Brent's method without derivatives (Brent 1973, `localmin`).
fn brent(a: f64, b: f64, f: &impl Fn(f64) -> f64) -> (f64, f64) {
    // The square root of the precision: a minimum cannot be placed more closely by its values.
    const RELATIVE: f64 = 3e-9;
    const GOLDEN: f64 = 0.381_966_011_250_105_1;
    let (mut a, mut b) = (a, b);
    let mut x = a + GOLDEN * (b - a);
    let (mut w, mut v) = (x, x);
    let mut fx = f(x);
    let (mut fw, mut fv) = (fx, fx);
    let (mut d, mut e) = (0.0_f64, 0.0_f64);
    for _ in 0..200 {
        let middle = 0.5 * (a + b);
        let tolerance = RELATIVE * x.abs() + 1e-12;
        if (x - middle).abs() <= 2.0 * tolerance - 0.5 * (b - a) {
            break;
        }
        let (mut p, mut q, mut r) = (0.0, 0.0, 0.0);
        if e.abs() > tolerance {
            r = (x - w) * (fx - fv);
            q = (x - v) * (fx - fw);
            p = (x - v) * q - (x - w) * r;
            q = 2.0 * (q - r);
            if q > 0.0 {
                p = -p;
            }
            q = q.abs();
            r = e;
            e = d;
        }
        if p.abs() < (0.5 * q * r).abs() && p > q * (a - x) && p < q * (b - x) {
            d = p / q;
            let u = x + d;
            if u - a < 2.0 * tolerance || b - u < 2.0 * tolerance {
                d = if x < middle { tolerance } else { -tolerance };
            }
        } else {
            e = if x < middle { b - x } else { a - x };
            d = GOLDEN * e;
        }
        let u = x + if d.abs() >= tolerance { d } else { tolerance.copysign(d) };
        let fu = f(u);
        if fu <= fx {
            if u < x {
                b = x
            } else {
                a = x
            }
            (v, fv) = (w, fw);
            (w, fw) = (x, fx);
            (x, fx) = (u, fu);
        } else {
            if u < x {
                a = u
            } else {
                b = u
            }
            if fu <= fw || w == x {
                (v, fv) = (w, fw);
                (w, fw) = (u, fu);
            } else if fu <= fv || v == x || v == w {
                (v, fv) = (u, fu);
            }
        }
    }
    (x, fx)
}

/// Least value of `f` near `start` by the simplex method (Nelder and Mead 1965), restarted once from its own result.
pub(crate) fn minimise_simplex(start: &[f64], step: f64, f: impl Fn(&[f64]) -> f64) -> (Vec<f64>, f64) {
    let f = |x: &[f64]| Some(f(x)).filter(|y| !y.is_nan()).unwrap_or(f64::INFINITY);
    let first = simplex(start, step, &f);
    simplex(&first.0, 0.1 * step, &f)
}

fn simplex(start: &[f64], step: f64, f: &impl Fn(&[f64]) -> f64) -> (Vec<f64>, f64) {
    const MOST_STEPS: usize = 4000;
    // Size of the simplex at which its values no longer differ: the square root of the precision.
    const SMALLEST: f64 = 1e-9;
    let n = start.len();
    let mut corners: Vec<(f64, Vec<f64>)> = (0..=n)
        .map(|k| {
            let mut x = start.to_vec();
            if k > 0 {
                x[k - 1] += step;
            }
            (f(&x), x)
        })
        .collect();
    for _ in 0..MOST_STEPS {
        corners.sort_by(|l, r| l.0.total_cmp(&r.0));
        let size = (0..n).map(|j| (corners[n].1[j] - corners[0].1[j]).abs()).fold(0.0, f64::max);
        if size < SMALLEST {
            break;
        }
        let centre: Vec<f64> =
            (0..n).map(|j| corners[..n].iter().map(|c| c.1[j]).sum::<f64>() / n as f64).collect();
        let worst = corners[n].1.clone();
        let along = |share: f64| {
            let x: Vec<f64> = (0..n).map(|j| centre[j] + share * (worst[j] - centre[j])).collect();
            (f(&x), x)
        };
        let reflected = along(-1.0);
        let candidate = if reflected.0 < corners[0].0 {
            let expanded = along(-2.0);
            if expanded.0 < reflected.0 { expanded } else { reflected }
        } else if reflected.0 < corners[n - 1].0 {
            reflected
        } else {
            along(if reflected.0 < corners[n].0 { -0.5 } else { 0.5 })
        };
        if candidate.0 < corners[n].0 {
            corners[n] = candidate;
        } else {
            let best = corners[0].1.clone();
            for corner in &mut corners[1..] {
                for (x, b) in corner.1.iter_mut().zip(&best) {
                    *x = b + 0.5 * (*x - b);
                }
                corner.0 = f(&corner.1);
            }
        }
    }
    corners.sort_by(|l, r| l.0.total_cmp(&r.0));
    let (value, x) = corners.swap_remove(0);
    (x, value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_is_exact_to_rounding() {
        assert!((integrate(0.0, 2.0, libm::exp) - libm::expm1(2.0)).abs() < 1e-14);
        // A logarithmic singularity at the end.
        assert!((integrate(0.0, 1.0, |x| -libm::log(x)) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn roots_are_found_to_the_last_bits() {
        let x = root(0.0, 2.0, |x| x * x - 2.0).unwrap();
        assert!((x - std::f64::consts::SQRT_2).abs() < 4e-16);
        assert_eq!(root(0.0, 1.0, |x| x + 1.0), None);
        assert_eq!(root(0.0, 1.0, |_| f64::NAN), None);
    }

    /// A minimum's place is known to the square root of the precision, about 1.5e-8 of its scale.
    #[test]
    fn minima_are_found_to_the_square_root_of_precision() {
        let found = minimise(-3.0, 5.0, 10, |x| libm::cosh(x - 1.2));
        assert!((found.x - 1.2).abs() < 3e-8 && !found.at_end);
        assert!(minimise(0.0, 1.0, 10, |x| x).at_end);
        let rosenbrock = |x: &[f64]| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            a * a + 100.0 * b * b
        };
        let (x, _) = minimise_simplex(&[-1.2, 1.0], 0.5, rosenbrock);
        assert!((x[0] - 1.0).abs() < 1e-7 && (x[1] - 1.0).abs() < 2e-7, "{x:?}");
    }
}
