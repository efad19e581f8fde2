//! Quantiles of one distribution at many places: what does not depend on the place is worked out once.

use super::{Family, Marginal, lognormal, trunc_gumbel, trunc_normal, weibull};

/// A marginal's quantile function, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantile(Kind);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    TruncNormal(trunc_normal::Prepared),
    Lognormal { p: f64, q: f64 },
    TruncGumbel(trunc_gumbel::Prepared),
    Weibull { p: f64, inverse_shape: f64 },
}

impl Quantile {
    /// Prepares the quantile function of a distribution.
    pub fn new(marginal: &Marginal) -> Quantile {
        let Marginal { family, p, q } = *marginal;
        Quantile(match family {
            Family::TruncNormal => Kind::TruncNormal(trunc_normal::Prepared::new(p, q)),
            Family::Lognormal => Kind::Lognormal { p, q },
            Family::TruncGumbel => Kind::TruncGumbel(trunc_gumbel::Prepared::new(p, q)),
            Family::Weibull => Kind::Weibull { p, inverse_shape: 1.0 / q },
        })
    }

    /// The quantile of `u` in the open interval (0, 1).
    #[inline]
    pub fn at(&self, u: f64) -> f64 {
        self.between(u, 1.0 - u)
    }

    /// The quantile that lies above the probability `below` and under the probability `above`: both are given, since near
    /// one end the difference of the other from one has lost its digits.
    #[inline]
    pub fn between(&self, below: f64, above: f64) -> f64 {
        match &self.0 {
            Kind::TruncNormal(prepared) => prepared.quantile(below, above),
            Kind::Lognormal { p, q } => lognormal::quantile(*p, *q, below, above),
            Kind::TruncGumbel(prepared) => prepared.quantile(below, above),
            Kind::Weibull { p, inverse_shape } => weibull::quantile(*p, *inverse_shape, below, above),
        }
    }

    /// Replaces every uniform by its quantile.
    pub fn apply(&self, uniforms: &mut [f64]) {
        uniforms.iter_mut().for_each(|u| *u = self.at(*u));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::special::SMALLEST_UNIFORM;
    use proptest::prelude::*;

    const CASES: [(Family, f64, f64); 9] = [
        (Family::TruncNormal, 11.412, 6.1915),
        (Family::TruncNormal, 27.0, 1.0),
        (Family::TruncNormal, -30.0, 1.0),
        (Family::Lognormal, 2.3, 0.5),
        (Family::TruncGumbel, 7.13572, 0.15228),
        (Family::TruncGumbel, -20.0, 1.0),
        (Family::TruncGumbel, 16.27, 0.8849),
        (Family::Weibull, 6.0, 2.3),
        (Family::Weibull, 17.55, 14.29),
    ];

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The way back is exact to a few ulp; but 30 standard deviations below zero x is a difference of numbers
        /// near 30, whose ulp of 4e-15 times a density of 30 is 1e-13, and a few of those.
        #[test]
        fn cdf_and_quantile_are_inverse(case in 0_usize..9, u in SMALLEST_UNIFORM..(1.0 - SMALLEST_UNIFORM)) {
            let (family, p, q) = CASES[case];
            let marginal = Marginal::new(family, p, q).unwrap();
            let x = marginal.quantile(u);
            prop_assert!(x.is_finite() && x >= 0.0);
            let back = marginal.cdf(x);
            prop_assert!((back - u).abs() < 1e-12, "{} at {u}: {back}", family.name());
        }
    }

    /// The density is the derivative of the distribution function: its integral between two quantiles is their
    /// difference, to the quadrature's 1e-13 or so.
    #[test]
    fn density_integrates_to_probability() {
        for (family, p, q) in CASES {
            let marginal = Marginal::new(family, p, q).unwrap();
            let (low, high) = (marginal.quantile(0.1), marginal.quantile(0.9));
            let probability = crate::numeric::integrate(low, high, |x| marginal.density(x));
            assert!((probability - 0.8).abs() < 1e-12, "{}: {probability}", family.name());
        }
    }

    /// Monotone up to rounding: two ulp of the value's scale.
    #[test]
    fn quantiles_are_finite_and_monotone_to_both_ends() {
        for (family, p, q) in CASES {
            let quantile = Quantile::new(&Marginal::new(family, p, q).unwrap());
            let mut last = -1.0;
            let ends = [SMALLEST_UNIFORM, 1e-14, 1e-9, 1e-6];
            let inner = (1..1000).map(|k| f64::from(k) * 1e-3);
            let places = ends.into_iter().chain(inner).chain(ends.into_iter().rev().map(|e| 1.0 - e));
            for u in places {
                let x = quantile.at(u);
                assert!(x.is_finite() && x >= 0.0 && x >= last, "{} at {u}: {x} after {last}", family.name());
                last = x;
            }
        }
    }

    #[test]
    fn a_slice_gives_the_same_bits_as_single_values() {
        for (family, p, q) in CASES {
            let quantile = Quantile::new(&Marginal::new(family, p, q).unwrap());
            let mut slice = [1e-12, 0.3, 0.5, 0.999];
            let single = slice.map(|u| quantile.at(u));
            quantile.apply(&mut slice);
            assert_eq!(slice, single);
        }
    }
}
