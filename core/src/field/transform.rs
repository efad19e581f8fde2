//! From independent normal fields to soil properties: copula and marginals in one pass, by tables.
//!
//! Where each property follows from one number of its cell (independent, Gaussian and Student t copulas) nobody needs
//! the uniform in between: the number is looked up as the value. The other families condition the second property's
//! uniform on the first's; both uniforms are looked up, and the second's value from the conditioned one.

use super::table::{Function, LineTable, UnitTable};
use crate::copula::Sampler;
use crate::marginal::Quantile;

/// Cells worked on together, so that every property's piece stays in the fastest cache.
const BLOCK: usize = 512;

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

    /// Turns independent standard normals into properties, in place; `fields[j][i]` is property `j` in cell `i`.
    pub(super) fn apply(&self, fields: &mut [Vec<f64>], mixing: f64) {
        let cells = fields.first().map_or(0, Vec::len);
        for start in (0..cells).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(cells);
            let mut pieces: Vec<&mut [f64]> = fields.iter_mut().map(|f| &mut f[block.clone()]).collect();
            self.sampler.correlate(&mut pieces, mixing);
            if let (Some(conditional), [first, second]) = (&self.conditional, &mut pieces[..]) {
                let mut buffer = [0.0; BLOCK];
                let u = &mut buffer[..first.len()];
                u.copy_from_slice(first);
                conditional.probability.apply(u);
                conditional.probability.apply(second);
                self.sampler.condition(u, second);
                conditional.value.apply(second);
            }
            pieces.iter_mut().zip(&self.values).for_each(|(piece, table)| table.apply(piece));
        }
    }
}
