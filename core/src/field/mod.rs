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
//! properties are rougher than asked; [`effective`] says by how much.

pub mod autocorrelation;
pub mod dense;
pub mod effective;
pub mod factor;
pub mod kronecker;
pub mod lattice;
mod noise;
pub mod sweep;
pub mod table;
mod transform;

use crate::campaign::{Autocorrelation, Field};
use crate::copula::{Copula, CopulaError, Sampler};
use crate::marginal::{MarginalError, Quantile};
use crate::seed::{self, Purpose};
use crate::site::Property;
use crate::spec::RandomProperty;
use kronecker::Kronecker;
use lattice::Lattice;
use noise::Noise;
use sweep::Sweeps;
use thiserror::Error;
use transform::Transform;

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
    /// Too long a side for a family that needs its factor.
    #[error(
        "a lattice of {places} cells along one axis is too long for {family:?} (at most {limit}); single-exponential \
         has no such limit"
    )]
    LongSide {
        /// Family.
        family: Autocorrelation,
        /// Cells along the axis.
        places: usize,
        /// Limit.
        limit: usize,
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
    /// A copula of another dimension.
    #[error("a copula of {dimension} dimensions cannot tie {properties} random properties together")]
    Dimension {
        /// The copula's dimension.
        dimension: usize,
        /// Number of random properties.
        properties: usize,
    },
    /// A copula that cannot be sampled.
    #[error(transparent)]
    Copula(#[from] CopulaError),
    /// A marginal that is no distribution.
    #[error("{property}: {source}")]
    Marginal {
        /// Property name.
        property: &'static str,
        /// Why.
        source: MarginalError,
    },
}

/// Everything about a campaign's fields that is the same in every realisation. Shared by threads.
#[derive(Debug, Clone)]
pub struct FieldPlan {
    lattice: Lattice,
    correlation: Correlation,
    properties: Vec<Property>,
    transform: Transform,
}

/// How white noise becomes a field.
#[derive(Debug, Clone)]
enum Correlation {
    Sweeps(Sweeps),
    Kronecker(Kronecker),
}

/// One realisation's properties at the material points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FieldSample {
    /// One vector a random property, in the campaign's order and in edge units (kPa, degrees, kN/m3). Shape: points.
    pub values: Vec<Vec<f64>>,
}

/// Buffers kept from one field to the next.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    /// A row of each property's latent field, or all its rows where Kronecker factors make them at once.
    fields: Vec<Vec<f64>>,
    /// The properties at a row's points.
    pieces: Vec<Vec<f64>>,
    row: Vec<f64>,
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
        let lattice = Lattice::new(x, y, spacing_m, field.rotation_rad)?;
        let quantile = |random: &RandomProperty| {
            let property = random.property.name();
            random.marginal.check().map_err(|source| FieldError::Marginal { property, source })?;
            Ok(Quantile::new(&random.marginal))
        };
        let sampler = Sampler::new(copula)?;
        if sampler.dimension() != random.len() {
            return Err(FieldError::Dimension { dimension: sampler.dimension(), properties: random.len() });
        }
        Ok(FieldPlan {
            correlation: Correlation::new(field, &lattice)?,
            lattice,
            properties: random.iter().map(|r| r.property).collect(),
            transform: Transform::new(
                sampler,
                &random.iter().map(quantile).collect::<Result<Vec<_>, FieldError>>()?,
            ),
        })
    }

    /// The fields of realisation `index` at the points.
    pub fn sample(&self, seed: u64, index: u64) -> FieldSample {
        let mut sample = FieldSample::default();
        self.sample_into(seed, index, &mut Scratch::default(), &mut sample);
        sample
    }

    /// As [`FieldPlan::sample`], into buffers kept from one realisation to the next.
    pub fn sample_into(&self, seed: u64, index: u64, scratch: &mut Scratch, sample: &mut FieldSample) {
        let mixing = self.transform.sampler().mixing(&mut seed::stream(seed, index, Purpose::CopulaMixing));
        let finish = |pieces: &mut [Vec<f64>], row: &mut Vec<f64>| self.transform.apply(pieces, mixing, row);
        self.fill(seed, index, scratch, &mut sample.values, finish);
    }

    /// Independent standard normal fields of realisation `index` at the points: one vector a property, in point order.
    pub fn latent(&self, seed: u64, index: u64) -> Vec<Vec<f64>> {
        let mut fields = Vec::new();
        self.fill(seed, index, &mut Scratch::default(), &mut fields, |_, _| {});
        fields
    }

    /// Largest nugget added to a correlation matrix, as a share of the variance (see [`factor::LARGEST_NUGGET`]).
    pub fn nugget(&self) -> f64 {
        match &self.correlation {
            Correlation::Sweeps(_) => 0.0,
            Correlation::Kronecker(factors) => factors.nugget(),
        }
    }

    /// The lattice.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Latent fields at the points, row by row of the lattice, so that a row is drawn, correlated and finished while it is
    /// in the fastest cache. `finish` is given the properties at a row's points, and a buffer.
    fn fill(
        &self,
        seed: u64,
        index: u64,
        scratch: &mut Scratch,
        values: &mut Vec<Vec<f64>>,
        finish: impl Fn(&mut [Vec<f64>], &mut Vec<f64>),
    ) {
        let Scratch { fields, pieces, row, transposed } = scratch;
        let count = self.properties.len();
        for buffers in [&mut *values, fields, pieces] {
            buffers.resize_with(count, Vec::new);
        }
        values.iter_mut().for_each(|values| values.resize(self.lattice.points(), 0.0));
        let mut noises: Vec<Noise> = self.properties.iter().map(|p| Noise::new(seed, index, *p)).collect();
        let Lattice { columns, rows, ref reach, .. } = self.lattice;
        for (field, noise) in fields.iter_mut().zip(&mut noises) {
            self.correlation.begin(field, transposed, &self.lattice, noise);
        }
        for number in 0..rows {
            let places = self.lattice.row(number);
            for ((field, noise), piece) in fields.iter_mut().zip(&mut noises).zip(pieces.iter_mut()) {
                let field = match &self.correlation {
                    Correlation::Sweeps(sweeps) => {
                        row.resize(columns, 0.0);
                        let (fresh, field) = (&mut row[..reach[number]], &mut field[..reach[number]]);
                        noise.fill(number * columns, fresh);
                        sweeps.row(number, fresh, field);
                        &*field
                    }
                    Correlation::Kronecker(_) => &field[number * columns..],
                };
                piece.clear();
                piece.extend(places.iter().map(|place| field[place.column as usize]));
            }
            finish(pieces, row);
            for (piece, values) in pieces.iter().zip(values.iter_mut()) {
                piece.iter().zip(places).for_each(|(value, place)| values[place.point as usize] = *value);
            }
        }
    }
}

impl Correlation {
    fn new(field: &Field, lattice: &Lattice) -> Result<Correlation, FieldError> {
        let Lattice { columns, rows, spacing_m, .. } = *lattice;
        Ok(match field.autocorrelation {
            Autocorrelation::SingleExponential => Correlation::Sweeps(Sweeps::new(field, spacing_m, columns)),
            _ => Correlation::Kronecker(Kronecker::new(field, spacing_m, columns, rows)?),
        })
    }

    /// Makes room in `field` for a row, or for the whole field where it is made at once, and makes it.
    fn begin(&self, field: &mut Vec<f64>, transposed: &mut Vec<f64>, lattice: &Lattice, noise: &mut Noise) {
        match self {
            Correlation::Sweeps(_) => field.resize(lattice.columns, 0.0),
            Correlation::Kronecker(factors) => {
                field.resize(lattice.size(), 0.0);
                for (number, row) in field.chunks_exact_mut(lattice.columns).enumerate() {
                    noise.fill(number * lattice.columns, &mut row[..lattice.reach[number]]);
                }
                factors.correlate_with(field, transposed, &lattice.reach);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::marginal::{Family, Marginal};

    /// A triangle leaves out what lies right of it in the upper rows; its bounding rectangle does not.
    #[test]
    fn cells_that_no_point_depends_on_leave_no_trace() {
        let rectangle: Vec<(usize, usize)> = (0..20).flat_map(|row| (0..30).map(move |c| (c, row))).collect();
        let triangle: Vec<usize> = (0..600).filter(|i| rectangle[*i].0 + rectangle[*i].1 < 30).collect();
        let random = [RandomProperty {
            property: Property::Cohesion,
            marginal: Marginal { family: Family::Lognormal, p: 2.0, q: 0.3 },
        }];
        for autocorrelation in [Autocorrelation::SingleExponential, Autocorrelation::BinaryNoise] {
            let field =
                Field { autocorrelation, scale_horizontal_m: 2.0, scale_vertical_m: 1.0, rotation_rad: 0.0 };
            let sample = |places: &[(usize, usize)]| {
                let (x, y): (Vec<f64>, Vec<f64>) =
                    places.iter().map(|p| (0.2 * p.0 as f64, 0.2 * p.1 as f64)).unzip();
                let copula = Copula::Independent { dimension: 1 };
                FieldPlan::new(&field, &random, &copula, 0.2, &x, &y)
                    .unwrap()
                    .sample(5, 6)
                    .values
                    .swap_remove(0)
            };
            let all = sample(&rectangle);
            let some = sample(&triangle.iter().map(|i| rectangle[*i]).collect::<Vec<_>>());
            assert!(triangle.iter().zip(&some).all(|(i, value)| all[*i] == *value), "{autocorrelation:?}");
        }
    }
}
