//! Between points and the nine nodes around each: sums weighted with shape functions or their gradients.
//!
//! A node or a point has a row of eight numbers (or four); the pattern says which of them go with S, dS/dx or dS/dy. S is a
//! product, so that three products along x and nine multiply-adds along y carry a row. Sorted points share their nodes in
//! runs: the nine rows stay in registers while the run lasts.

use super::lanes::{Lanes, Row, V8};
use super::shape::{Shape, Slopes};

/// Shape functions as a pattern of weights.
pub(super) trait Pattern {
    /// Index of the lower left node of point `q`.
    fn base(&self, q: usize) -> usize;
    /// The factor along x of the weights of column `i`, for point `q`.
    fn along_x<R: Row>(&self, i: usize, q: usize) -> R;
    /// The factor along y of the weights of row `j`, for point `q`.
    fn along_y<R: Row>(&self, j: usize, q: usize) -> R;
}

/// All numbers with S.
pub(super) struct Values<'a>(pub(super) &'a Shape);

impl Pattern for Values<'_> {
    #[inline(always)]
    fn base(&self, q: usize) -> usize {
        self.0.base[q]
    }

    #[inline(always)]
    fn along_x<R: Row>(&self, i: usize, q: usize) -> R {
        R::splat(self.0.x[i].0[q])
    }

    #[inline(always)]
    fn along_y<R: Row>(&self, j: usize, q: usize) -> R {
        R::splat(self.0.y[j].0[q])
    }
}

macro_rules! gradient_pattern {
    ($(#[$doc:meta])* $name:ident, $value:ident, $slope:ident, $x:expr, $y:expr) => {
        $(#[$doc])*
        pub(super) struct $name<'a>(pub(super) &'a Shape, pub(super) &'a Slopes);

        impl Pattern for $name<'_> {
            #[inline(always)]
            fn base(&self, q: usize) -> usize {
                self.0.base[q]
            }

            #[inline(always)]
            fn along_x<R: Row>(&self, i: usize, q: usize) -> R {
                let ($value, $slope) = (self.0.x[i].0[q], self.1.x[i].0[q]);
                $x
            }

            #[inline(always)]
            fn along_y<R: Row>(&self, j: usize, q: usize) -> R {
                let ($value, $slope) = (self.0.y[j].0[q], self.1.y[j].0[q]);
                $y
            }
        }
    };
}

gradient_pattern!(
    /// The first four numbers with dS/dx, the last four with dS/dy.
    Gradients, value, slope, R::halves(slope, value), R::halves(value, slope)
);
gradient_pattern!(
    /// The first four numbers with S, two with dS/dx, two with dS/dy.
    ValuesAndGradients, value, slope, R::quarters(value, slope, value), R::quarters(value, value, slope)
);
gradient_pattern!(
    /// Half a row: two numbers with dS/dx, two with dS/dy.
    GradientPairs, value, slope, R::pairs(slope, value), R::pairs(value, slope)
);

/// Adds the weighted rows of eight points to their nodes.
#[inline(always)]
pub(super) fn add<S: Lanes>(rows: &[V8; 8], pattern: &impl Pattern, stride: usize, nodes: &mut [V8]) {
    add_part::<S::First>(rows, pattern, stride, nodes);
    if S::SPLIT {
        add_part::<S::Rest>(rows, pattern, stride, nodes);
    }
}

/// As [`add`], for the lower halves of the rows.
#[inline(always)]
pub(super) fn add_low<S: Lanes>(rows: &[V8; 8], pattern: &impl Pattern, stride: usize, nodes: &mut [V8]) {
    add_part::<S::Low>(rows, pattern, stride, nodes);
}

/// The weighted sums of their nodes' rows for eight points.
#[inline(always)]
pub(super) fn collect<S: Lanes>(pattern: &impl Pattern, stride: usize, nodes: &[V8]) -> [S; 8] {
    let mut rows = [V8::ZERO; 8];
    collect_part::<S::First>(pattern, stride, nodes, &mut rows);
    if S::SPLIT {
        collect_part::<S::Rest>(pattern, stride, nodes, &mut rows);
    }
    S::transpose([
        S::load(&rows[0]),
        S::load(&rows[1]),
        S::load(&rows[2]),
        S::load(&rows[3]),
        S::load(&rows[4]),
        S::load(&rows[5]),
        S::load(&rows[6]),
        S::load(&rows[7]),
    ])
}

/// As [`collect`], for the lower halves of the rows.
#[inline(always)]
pub(super) fn collect_low<S: Lanes>(pattern: &impl Pattern, stride: usize, nodes: &[V8]) -> [S; 4] {
    let mut rows = [V8::ZERO; 8];
    collect_part::<S::Low>(pattern, stride, nodes, &mut rows);
    S::load_low_rows(&rows)
}

/// Number i of the points' rows is lane by lane in vector i.
#[inline(always)]
pub(super) fn rows<S: Lanes>(vectors: [S; 8]) -> [V8; 8] {
    let mut rows = [V8::ZERO; 8];
    for (row, vector) in rows.iter_mut().zip(S::transpose(vectors)) {
        vector.store(row);
    }
    rows
}

/// As [`rows`], for the lower halves; the upper ones are zero.
#[inline(always)]
pub(super) fn low_rows<S: Lanes>(vectors: [S; 4]) -> [V8; 8] {
    let mut rows = [V8::ZERO; 8];
    S::store_low_rows(vectors, &mut rows);
    rows
}

#[inline(always)]
fn add_part<R: Row>(rows: &[V8; 8], pattern: &impl Pattern, stride: usize, nodes: &mut [V8]) {
    let mut q = 0;
    while q < 8 {
        let base = pattern.base(q);
        let mut sums = load_nine::<R>(nodes, base, stride);
        loop {
            let row = R::load(&rows[q]);
            let y0 = pattern.along_y::<R>(0, q);
            let y1 = pattern.along_y::<R>(1, q);
            let y2 = pattern.along_y::<R>(2, q);
            for i in 0..3 {
                let part = row * pattern.along_x::<R>(i, q);
                sums[i] = part.mul_add(y0, sums[i]);
                sums[3 + i] = part.mul_add(y1, sums[3 + i]);
                sums[6 + i] = part.mul_add(y2, sums[6 + i]);
            }
            q += 1;
            if q == 8 || pattern.base(q) != base {
                break;
            }
        }
        for j in 0..3 {
            let start = base + j * stride;
            for (node, sum) in nodes[start..start + 3].iter_mut().zip(&sums[3 * j..3 * j + 3]) {
                sum.store(node);
            }
        }
    }
}

#[inline(always)]
fn collect_part<R: Row>(pattern: &impl Pattern, stride: usize, nodes: &[V8], rows: &mut [V8; 8]) {
    for (q, row) in rows.iter_mut().enumerate() {
        let near = load_nine::<R>(nodes, pattern.base(q), stride);
        let y0 = pattern.along_y::<R>(0, q);
        let y1 = pattern.along_y::<R>(1, q);
        let y2 = pattern.along_y::<R>(2, q);
        let column0 = near[6].mul_add(y2, near[3].mul_add(y1, near[0] * y0));
        let column1 = near[7].mul_add(y2, near[4].mul_add(y1, near[1] * y0));
        let column2 = near[8].mul_add(y2, near[5].mul_add(y1, near[2] * y0));
        let x0 = pattern.along_x::<R>(0, q);
        let x1 = pattern.along_x::<R>(1, q);
        let x2 = pattern.along_x::<R>(2, q);
        column2.mul_add(x2, column1.mul_add(x1, column0 * x0)).store(row);
    }
}

/// The rows of the nine nodes from `base`, the lower left one, row by row.
#[inline(always)]
fn load_nine<R: Row>(nodes: &[V8], base: usize, stride: usize) -> [R; 9] {
    let a = &nodes[base..base + 3];
    let b = &nodes[base + stride..base + stride + 3];
    let c = &nodes[base + 2 * stride..base + 2 * stride + 3];
    [
        R::load(&a[0]),
        R::load(&a[1]),
        R::load(&a[2]),
        R::load(&b[0]),
        R::load(&b[1]),
        R::load(&b[2]),
        R::load(&c[0]),
        R::load(&c[1]),
        R::load(&c[2]),
    ]
}
