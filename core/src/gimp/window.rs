//! Parts of points and nodes that a part of a step may change.

use super::block::{Block, Extra};
use super::contact::Contact;
use super::lanes::V8;
use super::nodes::Nodes;
use std::ops::Range;

/// Blocks in a row.
pub(super) struct Points<'a> {
    /// Place of the first among all.
    pub(super) first: usize,
    pub(super) blocks: &'a mut [Block],
    /// As many, or none if the step needs none.
    pub(super) extras: &'a mut [Extra],
}

impl<'a> Points<'a> {
    /// Cuts before block `at`, counted among all.
    pub(super) fn split_at(self, at: usize) -> (Points<'a>, Points<'a>) {
        let at_here = at - self.first;
        let (blocks, other_blocks) = self.blocks.split_at_mut(at_here);
        let (extras, other_extras) = self.extras.split_at_mut(at_here.min(self.extras.len()));
        (
            Points { first: self.first, blocks, extras },
            Points { first: at, blocks: other_blocks, extras: other_extras },
        )
    }

    /// Only these blocks, counted among all.
    pub(super) fn only(self, range: &Range<usize>) -> Points<'a> {
        self.split_at(range.end).0.split_at(range.start).1
    }
}

macro_rules! window {
    (sums: $($sums:ident),*; fixed: $($fixed:ident: $type:ty),*) => {
        /// Nodes in a row; see [`Nodes`] for what they hold.
        pub(super) struct Window<'a> {
            /// Index of the first among all.
            pub(super) first: usize,
            $(pub(super) $sums: &'a mut [V8],)*
            $(pub(super) $fixed: &'a [$type],)*
        }

        impl<'a> Window<'a> {
            /// All nodes.
            pub(super) fn all(nodes: &'a mut Nodes) -> Window<'a> {
                Window { first: 0, $($sums: &mut nodes.$sums,)* $($fixed: &nodes.$fixed,)* }
            }

            /// Cuts before node `at`, counted among all.
            pub(super) fn split_at(self, at: usize) -> (Window<'a>, Window<'a>) {
                let here = at - self.first;
                $(let $sums = self.$sums.split_at_mut(here.min(self.$sums.len()));)*
                $(let $fixed = self.$fixed.split_at(here);)*
                (
                    Window { first: self.first, $($sums: $sums.0,)* $($fixed: $fixed.0,)* },
                    Window { first: at, $($sums: $sums.1,)* $($fixed: $fixed.1,)* },
                )
            }
        }
    };
}

window! {
    sums: sums, forces, rates, velocities, cells, loads, filtered;
    fixed: free: [f64; 4], full_volume: f64, contact: Option<Contact>, walls: bool
}

impl<'a> Window<'a> {
    /// Only these nodes, counted among all.
    pub(super) fn only(self, range: Range<usize>) -> Window<'a> {
        self.split_at(range.end).0.split_at(range.start).1
    }
}
