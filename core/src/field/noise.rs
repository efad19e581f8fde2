//! White noise: standard normal numbers by inversion, one draw a cell, so that the noise of a cell depends on nothing
//! but its stream and its place in the lattice.

use super::table::{Function, UnitTable};
use crate::seed::{self, Purpose};
use crate::site::Property;
use crate::special::uniform_of_bits;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::Rng;
use std::sync::LazyLock;

/// The normal quantile, once a process; in the middle to 1e-12 of a standard deviation.
static NORMAL: LazyLock<UnitTable> = LazyLock::new(|| UnitTable::new(Function::NormalQuantile, 1.0));

/// The table of standard normal numbers by their probability.
pub(super) fn normal() -> &'static UnitTable {
    &NORMAL
}

/// Words of the generator a draw.
const WORDS_PER_DRAW: u128 = 2;
const BYTES_PER_DRAW: usize = 8;

/// Draws taken from the generator at once: what it makes at once.
const DRAWS_AT_ONCE: usize = 32;

/// The noise of one property.
pub(super) struct Noise {
    stream: ChaCha12Rng,
    normal: &'static UnitTable,
    /// Draws before the next one.
    drawn: usize,
}

impl Noise {
    /// For realisation `index`, from a stream named by the property's place among all properties: a property more or less
    /// in the campaign leaves the noise of the others as it is.
    pub(super) fn new(seed: u64, index: u64, property: Property) -> Noise {
        let stream = seed::stream(seed, index, Purpose::LatentField(property as u32));
        Noise { stream, normal: normal(), drawn: 0 }
    }

    /// The noise of successive cells from number `first` on.
    pub(super) fn fill(&mut self, first: usize, values: &mut [f64]) {
        if first != self.drawn {
            self.stream.set_word_pos(first as u128 * WORDS_PER_DRAW);
        }
        let mut bytes = [0; BYTES_PER_DRAW * DRAWS_AT_ONCE];
        for values in values.chunks_mut(DRAWS_AT_ONCE) {
            let bytes = &mut bytes[..BYTES_PER_DRAW * values.len()];
            self.stream.fill_bytes(bytes);
            let (draws, _) = bytes.as_chunks();
            for (value, draw) in values.iter_mut().zip(draws) {
                *value = self.normal.at(uniform_of_bits(u64::from_le_bytes(*draw)));
            }
        }
        self.drawn = first + values.len();
    }
}
