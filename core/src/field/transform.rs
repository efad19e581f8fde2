//! From independent normal fields to soil properties: copula and marginals in one pass, by tables.
//!
//! Where each property follows from one number of its cell (independent, Gaussian and Student t copulas) nobody needs
//! the uniform in between: the number is looked up as the value. The other families condition the second property's
//! uniform on the first's; both uniforms are looked up, and the second's value from the conditioned one.

use super::table::{Function, LineTable, UnitTable};
use crate::copula::Sampler;
use crate::marginal::Quantile;

/// Share of the median below which a property's table may be off by [`super::table::TOLERANCE`] of that instead of the
/// value itself: truncated families lose their digits there by subtraction anyway.
const LEAST_SHARE: f64 = 1e-3;

/// Copula and marginals, prepared.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Transform {
    sampler: Sampler,
    /// Of each property that follows from its number alone: the value of the number.
    values: Vec<LineTable>,
    conditional: Option<Conditional>,
}

/// What a second property needs that depends on the first.
#[derive(Debug, Clone, PartialEq)]
struct Conditional {
    probability: LineTable,
    value: UnitTable,
}

impl Transform {
    /// For the properties with these quantile functions, as many as the sampler's dimension.
    pub(super) fn new(sampler: Sampler, quantiles: &[Quantile]) -> Transform {
        let least = |quantile: &Quantile| LEAST_SHARE * quantile.at(0.5);
        let table = |quantile: &Quantile| {
            let function = match sampler.student_t() {
                Some(margin) => Function::OfStudentT(margin, *quantile),
                None => Function::OfNormal(*quantile),
            };
            LineTable::new(function, least(quantile))
        };
        match quantiles {
            [first, second] if sampler.conditions() => {
                let conditional = Conditional {
                    probability: LineTable::new(Function::NormalCdf, 0.0),
                    value: UnitTable::new(Function::Quantile(*second), least(second)),
                };
                Transform { values: vec![table(first)], conditional: Some(conditional), sampler }
            }
            _ => Transform { values: quantiles.iter().map(table).collect(), conditional: None, sampler },
        }
    }

    /// The copula.
    pub(super) fn sampler(&self) -> &Sampler {
        &self.sampler
    }

    /// Turns independent standard normals into properties, in place; `fields[j][i]` is property `j` in cell `i`. `scratch`
    /// is overwritten.
    pub(super) fn apply(&self, fields: &mut [Vec<f64>], mixing: f64, scratch: &mut Vec<f64>) {
        self.sampler.correlate(fields, mixing);
        if let (Some(conditional), [first, second]) = (&self.conditional, &mut fields[..]) {
            let u = scratch;
            u.clone_from(first);
            conditional.probability.apply(u);
            conditional.probability.apply(second);
            self.sampler.condition(u, second);
            conditional.value.apply(second);
        }
        fields.iter_mut().zip(&self.values).for_each(|(field, table)| table.apply(field));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::copula::Copula;
    use crate::marginal::{Family, Marginal};
    use crate::seed::{self, Purpose};
    use crate::special::standard_normal;

    /// The direct way, uniforms by [`Sampler::uniforms`] and values by [`Quantile::apply`], gives the same values. Either
    /// way a uniform is known to 1e-16 of one only, at four standard deviations 3e-12 of what it lacks to one.
    #[test]
    fn properties_are_those_of_uniforms_and_quantiles() {
        let pair = vec![vec![1.0, -0.67], vec![-0.67, 1.0]];
        let copulas = [
            Copula::Independent { dimension: 2 },
            Copula::Gaussian { correlation: pair.clone() },
            Copula::StudentT { correlation: pair, degrees_of_freedom: 5.0 },
            Copula::No16 { theta: 0.017_395_307_2 },
            Copula::Plackett { theta: 0.105_528_25 },
            Copula::Frank { theta: -5.170_310_443 },
        ];
        let quantiles = [(Family::TruncNormal, 11.412, 6.1915), (Family::Weibull, 29.37, 5.75)]
            .map(|(family, p, q)| Quantile::new(&Marginal::new(family, p, q).unwrap()));
        let mut stream = seed::stream(3, 4, Purpose::LatentField(0));
        let mut normals = || -> Vec<f64> { (0..50_000).map(|_| standard_normal(&mut stream)).collect() };
        let latent = [normals(), normals()];
        for copula in copulas {
            let sampler = Sampler::new(&copula).unwrap();
            let mixing = if sampler.student_t().is_some() { 1.3 } else { 1.0 };
            let mut wanted = latent.clone();
            let [first, second] = &mut wanted;
            sampler.uniforms(&mut [first, second], mixing);
            wanted.iter_mut().zip(&quantiles).for_each(|(field, quantile)| quantile.apply(field));
            let mut found = latent.clone();
            Transform::new(sampler, &quantiles).apply(&mut found, mixing, &mut Vec::new());
            for j in 0..2 {
                let least = LEAST_SHARE * quantiles[j].at(0.5);
                let error = |(a, b): (&f64, &f64)| (a - b).abs() / b.abs().max(least);
                let worst = found[j].iter().zip(&wanted[j]).map(error).fold(0.0, f64::max);
                assert!(worst < 1e-11, "{copula:?}, property {j}: {worst:e}");
            }
        }
    }
}
