//! Cross-correlated random fields at the material points (the paper, Section 2.3, steps 1 to 3).
//!
//! 1. White noise: one normal number a lattice cell and property ([`lattice`]), from a stream of the property's own.
//! 2. Autocorrelation ([`autocorrelation`]): by autoregressive sweeps ([`sweep`]) for the single-exponential family, by
//!    Kronecker factors ([`kronecker`]) for the others. Both equal dense Cholesky ([`dense`]), draw for draw.
//! 3. At the cells that carry points: the copula makes the independent normal fields dependent uniforms, and each
//!    marginal's quantile makes those the property, in its edge unit (kPa, degrees, kN/m3).
//!
//! The value at a cell is a point value: it is not averaged over the cell. A field belongs to its lattice; the same
//! realisation at another spacing is another draw. A coarser view of a realisation can be had by sampling a plan of
//! the fine points and averaging its values over the coarse points' areas; the plan itself does no averaging, and
//! there is no refinement of a sampled field.
//!
//! All properties share one autocorrelation function, as in the paper. Where the copula is not Gaussian the later
//! properties are rougher than asked; `effective` says by how much.

pub mod autocorrelation;
pub mod dense;
pub mod factor;
pub mod kronecker;
pub mod lattice;
pub mod sweep;

use crate::campaign::{Autocorrelation, Field};
use crate::copula::Copula;
use crate::seed::{self, Purpose};
use crate::site::Property;
use crate::spec::RandomProperty;
use crate::special::normal_quantile;
use kronecker::Kronecker;
use lattice::Lattice;
use rand_chacha::rand_core::Rng;
use sweep::Sweeps;
use thiserror::Error;

/// A field that cannot be planned.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FieldError {
    /// No points, or unequal numbers of coordinates.
    #[error("a field needs points with as many x as y: {x} and {y} were given")]
    Points {
        /// Number of x coordinates.
        x: usize,
        /// Number of y coordinates.
        y: usize,
    },
    /// A number that is not in its range.
    #[error("{name} = {value} is not allowed in a random field")]
    Value {
        /// What it is.
        name: &'static str,
        /// The value.
        value: f64,
    },
    /// A point off the lattice, or two on one place.
    #[error("point {point} at ({x_m}, {y_m}) m does not stand alone on a lattice of {spacing_m} m")]
    OffLattice {
        /// Which point.
        point: usize,
        /// Its x, m.
        x_m: f64,
        /// Its y, m.
        y_m: f64,
        /// Side of a cell, m.
        spacing_m: f64,
    },
    /// Too many cells.
    #[error("the points' bounding rectangle has {cells} cells; at most {limit} are supported")]
    TooLarge {
        /// Cells needed.
        cells: f64,
        /// Limit.
        limit: u64,
    },
    /// A correlation matrix that no small nugget makes positive definite.
    #[error(
        "the {family:?} correlation matrix at {spacing_m} m with a scale of {scale_m} m is singular even with a \
         nugget of {nugget}"
    )]
    Singular {
        /// Family.
        family: Autocorrelation,
        /// Scale of fluctuation, m.
        scale_m: f64,
        /// Side of a cell, m.
        spacing_m: f64,
        /// Largest nugget tried.
        nugget: f64,
    },
}

/// Everything about a campaign's fields that is the same in every realisation. Shared by threads.
#[derive(Debug, Clone)]
pub struct FieldPlan {
    lattice: Lattice,
    correlation: Correlation,
    properties: Vec<Property>,
}

/// How white noise becomes a field.
#[derive(Debug, Clone)]
enum Correlation {
    Sweeps(Sweeps),
    Kronecker(Kronecker),
}

/// Buffers of lattice size, kept from one field to the next.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    cells: Vec<f64>,
    transposed: Vec<f64>,
}

impl FieldPlan {
    /// Plans the fields of the `random` properties at material points `x`, `y` (m, shape: points) that stand
    /// `spacing_m` apart. `copula` has one dimension a property, in the same order.
    ///
    /// # Errors
    /// Points that are no lattice (see [`Lattice::new`]), scales that are not positive, a copula of another dimension,
    /// or a correlation matrix that cannot be factorised.
    pub fn new(
        field: &Field,
        random: &[RandomProperty],
        copula: &Copula,
        spacing_m: f64,
        x: &[f64],
        y: &[f64],
    ) -> Result<FieldPlan, FieldError> {
        for (name, value) in
            [("scale_horizontal_m", field.scale_horizontal_m), ("scale_vertical_m", field.scale_vertical_m)]
        {
            if value.is_nan() || value <= 0.0 {
                return Err(FieldError::Value { name, value });
            }
        }
        let _ = copula;
        let lattice = Lattice::new(x, y, spacing_m, field.rotation_rad)?;
        let correlation = match field.autocorrelation {
            Autocorrelation::SingleExponential => {
                Correlation::Sweeps(Sweeps::new(field, lattice.spacing_m, lattice.columns))
            }
            _ => Correlation::Kronecker(Kronecker::new(
                field,
                lattice.spacing_m,
                lattice.columns,
                lattice.rows,
            )?),
        };
        Ok(FieldPlan { lattice, correlation, properties: random.iter().map(|r| r.property).collect() })
    }

    /// Independent standard normal fields of realisation `index` at the points: one vector a property, in point order.
    pub fn latent(&self, seed: u64, index: u64) -> Vec<Vec<f64>> {
        let mut scratch = Scratch::default();
        let at_points = |j: usize| {
            self.fill_latent(seed, index, j, &mut scratch);
            self.lattice.cells.iter().map(|&cell| scratch.cells[cell]).collect()
        };
        (0..self.properties.len()).map(at_points).collect()
    }

    /// The lattice.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The latent field of the `j`-th random property on the whole lattice, into `scratch.cells`.
    fn fill_latent(&self, seed: u64, index: u64, j: usize, scratch: &mut Scratch) {
        fill_white_noise(seed, index, self.properties[j], self.lattice.size(), &mut scratch.cells);
        match &self.correlation {
            Correlation::Sweeps(sweeps) => sweeps.correlate(&mut scratch.cells),
            Correlation::Kronecker(factors) => factors.correlate(&mut scratch.cells, &mut scratch.transposed),
        }
    }
}

/// One standard normal number a cell, in lattice order, by inversion: the same bits give the same noise whatever the
/// other properties are.
fn fill_white_noise(seed: u64, index: u64, property: Property, cells: usize, noise: &mut Vec<f64>) {
    // 52 bits and a half: uniforms in the middle of 2^52 equal parts of (0, 1), so that neither 0 nor 1 occurs.
    const PART: f64 = 1.0 / (1_u64 << 52) as f64;
    let mut stream = seed::stream(seed, index, Purpose::LatentField(property as u32));
    noise.clear();
    noise.extend((0..cells).map(|_| normal_quantile(((stream.next_u64() >> 12) as f64 + 0.5) * PART)));
}
