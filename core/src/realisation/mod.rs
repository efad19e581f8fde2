//! The whole way from (spec, index) to an outcome.
//!
//! A realisation has two stages. The in-situ state comes from a gravity stage, which brings the elastic, drained slope
//! to equilibrium under its total weight with local damping, or from K0. Where the unit weight is not random it is the
//! same in every realisation and kept; where it is, a shorter stage settles each realisation from that of the mean
//! weights. The failure stage starts from its stresses at rest: pore pressure p0 is set, effective stress is total stress
//! plus p0, the realisation's strengths apply, obstacles stand, and displacements count from here.

mod analysis;
mod insitu;
mod probe;
mod progress;
mod properties;
mod record;
mod setup;
#[cfg(test)]
mod tests;
mod trial;

pub use analysis::{Snapshot, Source};
pub use probe::probe;
pub use progress::{Cancelled, Progress};
pub use properties::PointProperties;
pub use trial::Trial;

use crate::field::{FieldError, FieldPlan};
use crate::gimp::{Grid, Kernel, Threads};
use crate::outcome::Outcome;
use crate::points::{self, Points};
use crate::slope::{self, layers};
use crate::spec::Spec;
use insitu::InSitu;
use std::sync::{Arc, OnceLock};
use thiserror::Error;

/// Most material points of one realisation: about 2 GB of state.
pub const LARGEST_POINT_COUNT: u64 = 1_000_000;

/// Most grid nodes of one realisation: about 3 GB.
pub const LARGEST_NODE_COUNT: u64 = 8_000_000;

/// A spec that cannot be prepared for realisations.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PrepareError {
    /// The model needs more material points than the limit.
    #[error("the slope needs up to {points} material points; at most {limit} are supported")]
    TooLarge {
        /// Points needed.
        points: u64,
        /// Limit.
        limit: u64,
    },
    /// The grid needs more nodes than the limit.
    #[error("the slope needs {nodes} grid nodes; at most {limit} are supported")]
    GridTooLarge {
        /// Nodes needed.
        nodes: u64,
        /// Limit.
        limit: u64,
    },
    /// The geometry holds no material point.
    #[error("the slope holds no material point")]
    Empty,
    /// The random fields cannot be planned.
    #[error(transparent)]
    Field(#[from] FieldError),
}

/// Everything that is the same in every realisation of a spec, computed once and shared by threads.
#[derive(Debug)]
pub struct Prepared {
    spec: Spec,
    kernel: Kernel,
    threads: Threads,
    grid: Grid,
    points: Points,
    /// Place of each point's material among the model's.
    materials: Vec<u16>,
    /// Absent if nothing is random.
    fields: Option<FieldPlan>,
    /// In-situ state of the mean unit weights, once some realisation has computed it.
    in_situ: OnceLock<Arc<InSitu>>,
}

impl Prepared {
    /// Prepares a spec: lays out grid and points and plans the random fields. `kernel` moves no outcome; one that
    /// this processor cannot run is replaced by the fastest that it can.
    ///
    /// # Errors
    /// A geometry without points or with too many, or fields that cannot be planned.
    pub fn new(spec: Spec, kernel: Kernel) -> Result<Prepared, PrepareError> {
        let model = &spec.model;
        let bound = points::upper_bound(&model.slope, &model.mesh);
        if bound > LARGEST_POINT_COUNT as f64 {
            return Err(PrepareError::TooLarge { points: bound as u64, limit: LARGEST_POINT_COUNT });
        }
        let grid = slope::grid(&model.slope, &model.mesh);
        let nodes = grid.nodes[0] as f64 * grid.nodes[1] as f64;
        if nodes > LARGEST_NODE_COUNT as f64 {
            return Err(PrepareError::GridTooLarge { nodes: nodes as u64, limit: LARGEST_NODE_COUNT });
        }
        let points = points::fill(&model.slope, &model.mesh);
        if points.is_empty() {
            return Err(PrepareError::Empty);
        }
        let fields = if spec.random.is_empty() {
            None
        } else {
            Some(FieldPlan::new(
                &model.field,
                &spec.random,
                &spec.copula,
                points.spacing_m,
                &points.x,
                &points.y,
            )?)
        };
        let materials = layers::materials(&spec.model.layers, &points);
        Ok(Prepared {
            kernel,
            threads: Threads::default(),
            grid,
            points,
            materials,
            fields,
            in_situ: OnceLock::new(),
            spec,
        })
    }

    /// The same, each analysis shared by these threads; they move no outcome.
    pub fn with_threads(self, threads: Threads) -> Prepared {
        Prepared { threads, ..self }
    }

    /// The spec.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// Number of material points.
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// Where the material points start, in point order.
    pub fn layout(&self) -> &Points {
        &self.points
    }

    /// Place of each point's material among [`crate::campaign::Model::materials`], in point order.
    pub fn materials(&self) -> &[u16] {
        &self.materials
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Runs realisation `index` from its random field to rest.
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` was asked to stop.
    pub fn realise(&self, index: u64, progress: &Progress) -> Result<Outcome, Cancelled> {
        self.analyse(Source::Index(index), f64::INFINITY, &mut |_| {}, progress)
    }

    /// Runs the slope with every random property at its marginal mean; the outcome's index is 0.
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` was asked to stop.
    pub fn deterministic(&self, progress: &Progress) -> Result<Outcome, Cancelled> {
        self.analyse(Source::Deterministic, f64::INFINITY, &mut |_| {}, progress)
    }
}
