//! How a step's work is cut into parts that can run side by side.
//!
//! A chunk is a run of sorted blocks and the rows of nodes that its points may touch before the next sort. Chunks are
//! so high that two that are next but one to each other touch no node in common: what scatters to nodes takes every other chunk first
//! (one colour), then the rest (the other). A band is the rows of nodes that a chunk owns. The cut depends on the points only, and each
//! node gets its sums in the same order whatever runs side by side: threads move no bits.

use super::block::Block;
use super::grid::Grid;
use std::ops::Range;

/// Rows beyond that of a node nearest to a point that the point may touch: its own reach and one for its moves before
/// the next sort.
pub(super) const REACH: usize = 2;

/// Rows of nearest nodes between the first of a chunk and the first of the next: with one less, chunks of a colour
/// would share a row.
const CHUNK_ROWS: usize = 2 * REACH + 1;

/// A run of blocks and the rows of nodes that its points may touch.
#[derive(Debug, Clone)]
pub(super) struct Chunk {
    pub(super) blocks: Range<usize>,
    pub(super) rows: Range<usize>,
}

/// The parts of a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Plan {
    /// Every other chunk from the first, then the others.
    pub(super) colours: [Vec<Chunk>; 2],
    /// Rows of nodes; together all of them.
    pub(super) bands: Vec<Range<usize>>,
}

impl Plan {
    /// A plan with room for all chunks of the grid.
    pub(super) fn with_room(grid: &Grid) -> Plan {
        let most = grid.nodes[1] / CHUNK_ROWS + 1;
        Plan {
            colours: [Vec::with_capacity(most), Vec::with_capacity(most)],
            bands: Vec::with_capacity(most + 1),
        }
    }

    /// Cuts sorted blocks anew; `row` is the row of the node nearest to a point.
    pub(super) fn cut(&mut self, blocks: &[Block], rows: usize, row: impl Fn(&Block, usize) -> usize) {
        let Plan { colours, bands } = self;
        colours[0].clear();
        colours[1].clear();
        bands.clear();
        let (mut start, mut first_row, mut band_start, mut count) = (0, 0, 0, 0);
        for i in 0..=blocks.len() {
            let here = if i < blocks.len() { row(&blocks[i], 0) } else { usize::MAX };
            if i == start {
                first_row = here;
            } else if here >= first_row.saturating_add(CHUNK_ROWS) {
                let last_row = row(&blocks[i - 1], 7);
                let touched = first_row.saturating_sub(REACH)..(last_row + REACH + 1).min(rows);
                colours[count % 2].push(Chunk { blocks: start..i, rows: touched });
                let band_end = if i < blocks.len() { here } else { rows };
                bands.push(band_start..band_end);
                (start, first_row, band_start, count) = (i, here, band_end, count + 1);
            }
        }
    }
}
