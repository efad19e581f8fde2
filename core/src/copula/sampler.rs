//! From independent standard normal fields to dependent uniform fields, cell by cell and in place.
//!
//! The first property keeps its driving field; each further one is conditioned on those before it. A Student t
//! copula needs a chi-square mixing variable. It is one per realisation, not a field of its own: then any two cells
//! of any two properties are jointly Student t, the whole field is a multivariate t field, and the autocorrelation
//! of the normal fields carries over. A mixing field would need an autocorrelation of its own, about which site
//! data say nothing, and would roughen the properties. The price is that one realisation's cells share their
//! extremes.

use super::{Copula, CopulaError, frank, matrix, no16, plackett};
use crate::special::{StudentT, chi_square, clamp_uniform, normal_cdf};
use rand_chacha::rand_core::Rng;

/// A copula prepared for fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampler {
    dimension: usize,
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Independent,
    /// Lower factor of the correlation matrix.
    Gaussian(Vec<Vec<f64>>),
    StudentT {
        factor: Vec<Vec<f64>>,
        degrees_of_freedom: f64,
        margin: StudentT,
    },
    Plackett(f64),
    Frank(f64),
    No16(f64),
}

impl Sampler {
    /// Prepares a copula.
    ///
    /// # Errors
    /// Parameters outside the family's range.
    pub fn new(copula: &Copula) -> Result<Sampler, CopulaError> {
        copula.check()?;
        let factor = |correlation: &[Vec<f64>]| matrix::cholesky(correlation).ok_or(CopulaError::Correlation);
        let kind = match copula {
            Copula::Independent { .. } => Kind::Independent,
            Copula::Gaussian { correlation } => Kind::Gaussian(factor(correlation)?),
            Copula::StudentT { correlation, degrees_of_freedom } => Kind::StudentT {
                factor: factor(correlation)?,
                degrees_of_freedom: *degrees_of_freedom,
                margin: StudentT::new(*degrees_of_freedom),
            },
            Copula::Plackett { theta } => Kind::Plackett(*theta),
            Copula::Frank { theta } => Kind::Frank(*theta),
            Copula::No16 { theta } => Kind::No16(*theta),
        };
        Ok(Sampler { dimension: copula.dimension(), kind })
    }

    /// Number of properties.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The realisation's mixing factor sqrt(nu / chi-square(nu)); 1, with nothing drawn, for all but Student t.
    ///
    /// `rng` is the realisation's stream of [`crate::seed::Purpose::CopulaMixing`].
    pub fn mixing(&self, rng: &mut impl Rng) -> f64 {
        match &self.kind {
            Kind::StudentT { degrees_of_freedom, .. } => {
                libm::sqrt(degrees_of_freedom / chi_square(*degrees_of_freedom, rng))
            }
            _ => 1.0,
        }
    }

    /// Turns independent standard normals into dependent uniforms in [2^-53, 1 - 2^-53], in place.
    ///
    /// `fields[j][i]` is property `j` in cell `i`; all fields have the same length. `mixing` is [`Sampler::mixing`]'s
    /// factor for this realisation.
    ///
    /// # Panics
    /// If the number of fields is not the copula's dimension, or their lengths differ.
    pub fn uniforms(&self, fields: &mut [&mut [f64]], mixing: f64) {
        assert_eq!(fields.len(), self.dimension, "one field per property");
        let cells = fields[0].len();
        assert!(fields.iter().all(|f| f.len() == cells), "fields of equal length");
        self.correlate(fields, mixing);
        for field in fields.iter_mut() {
            match self.student_t() {
                Some(margin) => field.iter_mut().for_each(|x| *x = clamp_uniform(margin.cdf(*x))),
                None => field.iter_mut().for_each(|x| *x = clamp_uniform(normal_cdf(*x))),
            }
        }
        if let [first, second] = fields {
            self.condition(first, second);
        }
    }

    /// The distribution of each correlated number of a Student t copula; `None` for the others, where it is normal.
    pub(crate) fn student_t(&self) -> Option<StudentT> {
        match &self.kind {
            Kind::StudentT { margin, .. } => Some(*margin),
            _ => None,
        }
    }

    /// Whether the second property's uniforms need [`Sampler::condition`].
    pub(crate) fn conditions(&self) -> bool {
        matches!(self.kind, Kind::Plackett(_) | Kind::Frank(_) | Kind::No16(_))
    }

    /// Correlates independent standard normals and mixes them, for the elliptical families; leaves them as they are for
    /// the others.
    pub(crate) fn correlate<F: AsRef<[f64]> + AsMut<[f64]>>(&self, fields: &mut [F], mixing: f64) {
        match &self.kind {
            Kind::Gaussian(factor) => multiply(factor, fields, 1.0),
            Kind::StudentT { factor, .. } => multiply(factor, fields, mixing),
            _ => {}
        }
    }

    /// Replaces uniforms w of the second property by the v with h(v | u) = w, for the families that need it.
    pub(crate) fn condition(&self, u: &[f64], w: &mut [f64]) {
        match self.kind {
            Kind::Plackett(theta) => each(u, w, |u, w| plackett::conditional_quantile(theta, u, w)),
            Kind::Frank(theta) => each(u, w, |u, w| frank::conditional_quantile(theta, u, w)),
            Kind::No16(theta) => each(u, w, |u, w| no16::conditional_quantile(theta, u, w)),
            _ => {}
        }
    }
}

/// Multiplies the normals of each cell by the lower factor and by `scale`, last property first.
fn multiply<F: AsRef<[f64]> + AsMut<[f64]>>(factor: &[Vec<f64>], fields: &mut [F], scale: f64) {
    for (i, row) in factor.iter().enumerate().rev() {
        let (before, rest) = fields.split_at_mut(i);
        let own = rest[0].as_mut();
        let diagonal = scale * row[i];
        own.iter_mut().for_each(|z| *z *= diagonal);
        for (weight, earlier) in row.iter().zip(before.iter()) {
            let weight = scale * weight;
            own.iter_mut().zip(earlier.as_ref()).for_each(|(z, e)| *z += weight * e);
        }
    }
}

#[inline]
fn each(u: &[f64], w: &mut [f64], conditional_quantile: impl Fn(f64, f64) -> f64) {
    w.iter_mut().zip(u).for_each(|(w, u)| *w = clamp_uniform(conditional_quantile(*u, *w)));
}
