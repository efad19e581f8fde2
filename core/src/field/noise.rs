//! White noise: standard normal numbers by inversion, one draw a cell, so that the noise of a cell depends on nothing
//! but its stream and its place in the lattice.

use super::table::{Function, UnitTable};
use crate::special::uniform_of_bits;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::Rng;
use std::sync::LazyLock;

/// The normal quantile, once a process; in the middle to 1e-12 of a standard deviation.
static NORMAL: LazyLock<UnitTable> = LazyLock::new(|| UnitTable::new(Function::NormalQuantile, 1.0));

/// Words of the generator a draw.
const WORDS_PER_DRAW: u128 = 2;

/// The noise of one property.
pub(super) struct Noise {
    stream: ChaCha12Rng,
    normal: &'static UnitTable,
    /// Draws before the next one.
    drawn: usize,
}

impl Noise {
    /// Noise from this stream, which must be at its start.
    pub(super) fn new(stream: ChaCha12Rng) -> Noise {
        Noise { stream, normal: &NORMAL, drawn: 0 }
    }

    /// The noise of successive cells from number `first` on.
    pub(super) fn fill(&mut self, first: usize, values: &mut [f64]) {
        if first != self.drawn {
            self.stream.set_word_pos(first as u128 * WORDS_PER_DRAW);
        }
        for value in values.iter_mut() {
            *value = self.normal.at(uniform_of_bits(self.stream.next_u64()));
        }
        self.drawn = first + values.len();
    }
}
