//! What estimates look at of an outcome: a tenth of its memory.

use crate::store::wire::Gist;
use runout_core::outcome::{Measures, Outcome, OutcomeKind, Reason};

/// What estimates rest on.
#[derive(Debug, Clone, Copy)]
pub struct Essence {
    /// What became of the realisation.
    pub kind: OutcomeKind,
    /// Why its analysis ended.
    pub reason: Reason,
    /// Whether its balance of energy drifted beyond the limit.
    pub energy_drifted: bool,
    /// Largest displacement, its 99.9 % quantile, and the advance of the toe, m.
    pub distances_m: Option<[f64; 3]>,
}

impl Essence {
    /// Of an outcome.
    pub fn of(outcome: &Outcome) -> Essence {
        let Outcome { outcome: kind, reason, energy_drifted, measures, .. } = outcome;
        Essence::new(*kind, *reason, *energy_drifted, measures.as_ref())
    }

    /// Of an outcome read from a log.
    pub fn of_gist(record: &Gist) -> Essence {
        Essence::new(record.outcome, record.reason, record.energy_drifted, record.measures.as_ref())
    }

    fn new(kind: OutcomeKind, reason: Reason, energy_drifted: bool, measures: Option<&Measures>) -> Essence {
        let distances = |m: &Measures| [m.max_displacement_m, m.displacement_q999_m, m.toe_advance_m];
        Essence { kind, reason, energy_drifted, distances_m: measures.map(distances) }
    }

    /// An outcome of this index that estimates cannot tell from the whole one; what they do not look at is zero or absent.
    pub fn outcome(self, index: u64) -> Outcome {
        let measures = |[max_displacement_m, displacement_q999_m, toe_advance_m]: [f64; 3]| Measures {
            max_displacement_m,
            displacement_q999_m,
            toe_advance_m,
            ..Measures::default()
        };
        Outcome {
            energy_drifted: self.energy_drifted,
            ..Outcome::bare(index, self.kind, self.reason, self.distances_m.map(measures))
        }
    }
}
