//! Smooth functions of one variable as piecewise polynomials: the same values as the direct functions, much sooner.
//!
//! On the way to a field a special function is wanted at tens of thousands of places, always the same one. Each piece
//! of its range holds the polynomial of degree 7 that interpolates it at the zeros of Chebyshev's T8. The error of that
//! polynomial is T8 times the eighth derivative somewhere in the piece: largest about where T8 is one, that is at the
//! ends and in the middle. There every piece is held against the function when the table is made. Where it is off by
//! more than [`TOLERANCE`], or where no piece is, the function itself is evaluated: near singularities, far out in
//! the tails, for parameters that bend it too much.
//!
//! Plain multiplications and additions, none of them fused: the bits are the same on every processor.

use crate::marginal::Quantile;
use crate::special::{StudentT, clamp_uniform, normal_cdf, normal_quantile};
use std::f64::consts::PI;

/// Largest error of a piece, as a share of the value or of the table's `least` value, whichever is larger.
pub const TOLERANCE: f64 = 1e-12;

/// Number of coefficients: a piece fills one cache line.
const TERMS: usize = 8;

/// A function that can be tabulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Function {
    /// Probability of a standard normal number, in the open interval.
    NormalCdf,
    /// Standard normal number of a probability.
    NormalQuantile,
    /// Value of a probability.
    Quantile(Quantile),
    /// Value of a standard normal number.
    OfNormal(Quantile),
    /// Value of a Student t number.
    OfStudentT(StudentT, Quantile),
}

impl Function {
    /// The function itself.
    pub fn at(&self, x: f64) -> f64 {
        match self {
            Function::NormalCdf => clamp_uniform(normal_cdf(x)),
            Function::NormalQuantile => normal_quantile(x),
            Function::Quantile(quantile) => quantile.at(x),
            Function::OfNormal(quantile) => between(quantile, x, normal_cdf),
            Function::OfStudentT(margin, quantile) => between(quantile, x, |x| margin.cdf(x)),
        }
    }
}

/// The value of a number from a distribution that is symmetrical about zero, right to rounding in both tails.
fn between(quantile: &Quantile, x: f64, cdf: impl Fn(f64) -> f64) -> f64 {
    quantile.between(clamp_uniform(cdf(x)), clamp_uniform(cdf(-x)))
}

/// Coefficients by rising powers of the place within the piece; the first is NaN where the piece fails.
type Piece = [f64; TERMS];

/// A function over the real line, in pieces of equal width around zero.
#[derive(Debug, Clone, PartialEq)]
pub struct LineTable {
    function: Function,
    pieces: Vec<Piece>,
}

/// Pieces of a unit length: a sixteenth is short enough for the normal distribution function out to 5.
const PIECES_PER_UNIT: f64 = 16.0;

/// Pieces on either side of the one around zero: out to 8.3, beyond which a normal probability is 2^-53.
const PIECES_PER_SIDE: i32 = 133;

/// Added to a number of up to 51 bits, leaves its nearest integer in the lowest bits.
const ROUNDER: f64 = 1.5 * (1_u64 << 52) as f64;

impl LineTable {
    /// Tabulates `function` with errors of [`TOLERANCE`] times the value or `least`, whichever is larger.
    pub fn new(function: Function, least: f64) -> LineTable {
        let nodes = Nodes::new();
        let half_width = 0.5 / PIECES_PER_UNIT;
        let piece = |k: i32| {
            let centre = f64::from(k) / PIECES_PER_UNIT;
            nodes.interpolate(|t| function.at(centre + half_width * t), 2.0, least)
        };
        LineTable { function, pieces: (-PIECES_PER_SIDE..=PIECES_PER_SIDE).map(piece).collect() }
    }

    /// The function at `x`.
    #[inline]
    pub fn at(&self, x: f64) -> f64 {
        let place = x * PIECES_PER_UNIT;
        let rounded = place + ROUNDER;
        // A place beyond the pieces, however far, gives a number beyond their count.
        let index = rounded.to_bits().wrapping_sub(ROUNDER.to_bits()).wrapping_add(PIECES_PER_SIDE as u64);
        let piece = self.pieces.get(index as usize);
        let value = piece.map_or(f64::NAN, |piece| polynomial(piece, place - (rounded - ROUNDER)));
        if value.is_nan() { self.directly(x) } else { value }
    }

    /// Replaces every number by the function of it.
    pub fn apply(&self, values: &mut [f64]) {
        values.iter_mut().for_each(|x| *x = self.at(*x));
    }

    #[cold]
    fn directly(&self, x: f64) -> f64 {
        self.function.at(x)
    }
}

/// A function of a probability, in pieces that shrink towards zero and one: sixteen an octave of the distance from the
/// nearer end.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitTable {
    function: Function,
    /// Outward from the smallest distance, that from zero and that from one in turn.
    pieces: Vec<Piece>,
}

/// Bits of the mantissa that number the pieces of an octave.
const PIECE_BITS: u32 = 4;
const PIECES_PER_OCTAVE: u64 = 1 << PIECE_BITS;

/// Octaves from a distance of a half inwards; nearer to an end, once in 500 times, the function is evaluated.
const OCTAVES: u64 = 9;

const MANTISSA_BITS: u32 = 52;
const PLACE_BITS: u32 = MANTISSA_BITS - PIECE_BITS;
const PLACE_MASK: u64 = (1 << PLACE_BITS) - 1;
/// Half the width of a piece whose octave begins at one.
const HALF_PLACE: f64 = 0.5 / PIECES_PER_OCTAVE as f64;
/// Least distance from an end that has a piece, 2^-(OCTAVES + 1).
const LEAST_DISTANCE: f64 = 0.5 / (1_u64 << OCTAVES) as f64;

impl UnitTable {
    /// Tabulates `function` with errors of [`TOLERANCE`] times the value or `least`, whichever is larger.
    pub fn new(function: Function, least: f64) -> UnitTable {
        let nodes = Nodes::new();
        let piece = |index: u64| {
            let octave = LEAST_DISTANCE * (1_u64 << (index / 2 / PIECES_PER_OCTAVE)) as f64;
            let start = 1.0 + (index / 2 % PIECES_PER_OCTAVE) as f64 / PIECES_PER_OCTAVE as f64;
            let probability = |t: f64| {
                let distance = octave * (start + HALF_PLACE * (1.0 + t));
                if index.is_multiple_of(2) { distance } else { 1.0 - distance }
            };
            nodes.interpolate(|t| function.at(probability(t)), 1.0 / HALF_PLACE, least)
        };
        UnitTable { function, pieces: (0..2 * OCTAVES * PIECES_PER_OCTAVE).map(piece).collect() }
    }

    /// The function at the probability `p`, in the open interval.
    #[inline]
    pub fn at(&self, p: f64) -> f64 {
        let distance = p.min(1.0 - p).to_bits();
        let rank = (distance >> PLACE_BITS).wrapping_sub(LEAST_DISTANCE.to_bits() >> PLACE_BITS);
        let piece = self.pieces.get(rank.wrapping_mul(2).wrapping_add(u64::from(p > 0.5)) as usize);
        let place = f64::from_bits((distance & PLACE_MASK) | 1.0_f64.to_bits()) - (1.0 + HALF_PLACE);
        let value = piece.map_or(f64::NAN, |piece| polynomial(piece, place));
        if value.is_nan() { self.directly(p) } else { value }
    }

    /// Replaces every probability by the function of it.
    pub fn apply(&self, probabilities: &mut [f64]) {
        probabilities.iter_mut().for_each(|p| *p = self.at(*p));
    }

    #[cold]
    fn directly(&self, p: f64) -> f64 {
        self.function.at(p)
    }
}

/// In pairs and pairs of pairs (Estrin), which a processor can work on side by side.
#[inline]
fn polynomial(c: &Piece, s: f64) -> f64 {
    let square = s * s;
    let low = (c[0] + c[1] * s) + (c[2] + c[3] * s) * square;
    let high = (c[4] + c[5] * s) + (c[6] + c[7] * s) * square;
    low + high * (square * square)
}

/// What interpolation needs that is the same for every piece.
struct Nodes {
    /// Zeros of T8.
    at: [f64; TERMS],
    /// Weight of each value in each coefficient of the Chebyshev series, by the polynomials' orthogonality at the zeros.
    weights: [[f64; TERMS]; TERMS],
}

impl Nodes {
    fn new() -> Nodes {
        let angle = |k: usize| (k as f64 + 0.5) * PI / TERMS as f64;
        let weight = |j: usize, k: usize| {
            libm::cos(j as f64 * angle(k)) * if j == 0 { 1.0 } else { 2.0 } / TERMS as f64
        };
        Nodes {
            at: std::array::from_fn(|k| libm::cos(angle(k))),
            weights: std::array::from_fn(|j| std::array::from_fn(|k| weight(j, k))),
        }
    }

    /// The piece for the values of a function of t in [-1, 1], by powers of t / `per_place`; NaN where it is too far off.
    fn interpolate(&self, value: impl Fn(f64) -> f64, per_place: f64, least: f64) -> Piece {
        let values = self.at.map(&value);
        let coefficient = |weights: &[f64; TERMS]| weights.iter().zip(&values).map(|(w, v)| w * v).sum();
        // What does not vary is kept exactly: a field without variation has the bits of homogeneous ground.
        let constant = values.iter().all(|v| *v == values[0]);
        let mut piece = if constant {
            [values[0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        } else {
            powers(&self.weights.each_ref().map(coefficient))
        };
        let mut scale = 1.0;
        for coefficient in &mut piece {
            *coefficient *= scale;
            // A power of two: exact.
            scale *= per_place;
        }
        let near = |t: f64| {
            let wanted = value(t);
            (polynomial(&piece, t / per_place) - wanted).abs() <= TOLERANCE * wanted.abs().max(least)
        };
        if [-1.0, 0.0, 1.0].into_iter().all(near) { piece } else { [f64::NAN; TERMS] }
    }
}

/// A Chebyshev series by powers, with T_n = 2 t T_(n-1) - T_(n-2).
fn powers(series: &[f64; TERMS]) -> Piece {
    let mut sum = [0.0; TERMS];
    let (mut before, mut last) = ([0.0; TERMS], [0.0; TERMS]);
    // T_(-1) = T_1 = t and T_0 = 1 start the recurrence.
    before[1] = 1.0;
    last[0] = 1.0;
    for weight in series {
        sum.iter_mut().zip(&last).for_each(|(sum, c)| *sum += weight * c);
        let mut next = before.map(|c| -c);
        for n in 1..TERMS {
            next[n] += 2.0 * last[n - 1];
        }
        (before, last) = (last, next);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::marginal::{Family, Marginal};
    use crate::seed::{self, Purpose};
    use crate::special::{open_uniform, standard_normal};

    /// Places a function is looked at: far more than there are pieces.
    const PLACES: usize = 100_000;

    /// The paper's fits and a soil of little spread.
    const USUAL: [(Family, f64, f64); 5] = [
        (Family::TruncNormal, 11.412, 6.1915),
        (Family::TruncNormal, 27.0, 1.0),
        (Family::Lognormal, 2.83, 0.08),
        (Family::TruncGumbel, 7.13572, 0.15228),
        (Family::Weibull, 29.37, 5.75),
    ];

    /// Distributions that bend more than any soil's.
    const UNUSUAL: [(Family, f64, f64); 3] =
        [(Family::Lognormal, 2.3, 2.5), (Family::TruncGumbel, -2.0, 1.0), (Family::Weibull, 6.0, 0.3)];

    /// Quantile function and least value of interest.
    fn prepared((family, p, q): (Family, f64, f64)) -> (Quantile, f64) {
        let quantile = Quantile::new(&Marginal::new(family, p, q).unwrap());
        (quantile, 1e-3 * quantile.at(0.5))
    }

    /// Largest error over all places as a share of the value or of `least`.
    fn worst(function: Function, least: f64, pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
        pairs.fold(0.0_f64, |worst, (x, found)| {
            let wanted = function.at(x);
            worst.max((found - wanted).abs() / wanted.abs().max(least))
        })
    }

    fn worst_on_line(function: Function, least: f64, places: &[f64]) -> f64 {
        let table = LineTable::new(function, least);
        worst(function, least, places.iter().map(|&x| (x, table.at(x))))
    }

    fn worst_on_unit(function: Function, least: f64, places: &[f64]) -> f64 {
        let table = UnitTable::new(function, least);
        worst(function, least, places.iter().map(|&p| (p, table.at(p))))
    }

    /// Normal numbers as fields have them, and as many spread evenly over [-9, 9].
    fn numbers() -> Vec<f64> {
        let mut stream = seed::stream(1, 2, Purpose::LatentField(0));
        let normal: Vec<f64> = (0..PLACES).map(|_| standard_normal(&mut stream)).collect();
        normal.into_iter().chain((0..PLACES).map(|k| 18.0 * k as f64 / PLACES as f64 - 9.0)).collect()
    }

    /// Uniform numbers, and as many down to 2^-53 from either end, evenly by octaves.
    fn probabilities() -> Vec<f64> {
        let mut stream = seed::stream(1, 2, Purpose::LatentField(1));
        let tail = |k: usize| libm::exp2(-1.0 - 52.0 * k as f64 / PLACES as f64);
        (0..PLACES)
            .map(|_| open_uniform(&mut stream))
            .chain((0..PLACES).map(tail))
            .chain((0..PLACES).map(|k| 1.0 - tail(k)))
            .collect()
    }

    /// Between the places where pieces are checked the error is no larger, but for rounding and the change of the eighth
    /// derivative within a piece: twice the tolerance is allowed.
    #[test]
    fn tables_are_the_functions_within_their_tolerance() {
        let (numbers, probabilities) = (numbers(), probabilities());
        assert!(worst_on_line(Function::NormalCdf, 0.0, &numbers) < 2.0 * TOLERANCE);
        assert!(worst_on_unit(Function::NormalQuantile, 1.0, &probabilities) < 2.0 * TOLERANCE);
        for (quantile, least) in USUAL.into_iter().chain(UNUSUAL).map(prepared) {
            let of_student_t = Function::OfStudentT(StudentT::new(3.0), quantile);
            let errors = [
                worst_on_line(Function::OfNormal(quantile), least, &numbers),
                worst_on_line(of_student_t, least, &numbers),
                worst_on_unit(Function::Quantile(quantile), least, &probabilities),
            ];
            assert!(errors.iter().all(|e| *e < 2.0 * TOLERANCE), "{quantile:?}: {errors:?}");
        }
    }

    /// At the numbers that fields are made of, the paper's fits are right to far less than the tolerance: 1e-13.
    #[test]
    fn fields_are_made_of_nearly_exact_values() {
        let central = |x: &f64| x.abs() < 3.0;
        let numbers: Vec<f64> = numbers().into_iter().filter(central).collect();
        let probabilities: Vec<f64> =
            probabilities().into_iter().filter(|p| (1e-3..0.999).contains(p)).collect();
        assert!(worst_on_line(Function::NormalCdf, 0.0, &numbers) < 1e-14);
        assert!(worst_on_unit(Function::NormalQuantile, 1.0, &probabilities) < 1e-14);
        for (quantile, _) in USUAL.map(prepared) {
            assert!(worst_on_line(Function::OfNormal(quantile), 0.0, &numbers) < 1e-13, "{quantile:?}");
            assert!(worst_on_unit(Function::Quantile(quantile), 0.0, &probabilities) < 1e-13, "{quantile:?}");
        }
    }

    /// Most of the range has pieces that hold, or fields would be slow.
    #[test]
    fn few_places_are_evaluated_directly() {
        let fails = |pieces: &[Piece]| pieces.iter().filter(|p| p[0].is_nan()).count();
        for (quantile, least) in USUAL.into_iter().chain(UNUSUAL).map(prepared) {
            let line = LineTable::new(Function::OfNormal(quantile), least);
            // From -4 to 4.
            assert_eq!(fails(&line.pieces[69..198]), 0, "line {quantile:?}");
            assert_eq!(fails(&UnitTable::new(Function::Quantile(quantile), least).pieces), 0, "{quantile:?}");
        }
        assert_eq!(fails(&LineTable::new(Function::NormalCdf, 0.0).pieces[53..214]), 0);
        assert_eq!(fails(&UnitTable::new(Function::NormalQuantile, 1.0).pieces), 0);
    }

    /// Far below zero the direct functions are differences of numbers near 30 and 20, known to some 1e-14 only, more than
    /// a table may be off: pieces fail, or are right to that.
    #[test]
    fn a_function_that_loses_its_digits_is_no_worse_in_a_table() {
        for case in [(Family::TruncNormal, -30.0, 1.0), (Family::TruncGumbel, -20.0, 1.0)] {
            let (quantile, least) = prepared(case);
            let table = LineTable::new(Function::OfNormal(quantile), least);
            for x in numbers() {
                let (found, wanted) = (table.at(x), table.function.at(x));
                let allowed = 2.0 * TOLERANCE * wanted.max(least) + 3e-14;
                assert!((found - wanted).abs() < allowed, "{case:?} at {x}: {found}, {wanted}");
            }
        }
    }

    #[test]
    fn what_has_no_piece_is_evaluated() {
        let line = LineTable::new(Function::NormalCdf, 0.0);
        for x in [-1e300, -40.0, -8.4, 8.4, 40.0, 1e300, f64::INFINITY] {
            assert_eq!(line.at(x), Function::NormalCdf.at(x), "{x}");
        }
        let unit = UnitTable::new(Function::NormalQuantile, 1.0);
        for p in [1e-300, 1e-16, 1e-6, 0.5, 1.0 - 1e-6, 1.0 - 1e-16] {
            assert_eq!(unit.at(p), normal_quantile(p), "{p}");
        }
    }
}
