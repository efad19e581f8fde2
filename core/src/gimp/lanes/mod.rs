//! Eight numbers at a time: the one vocabulary in which the kernels are written.
//!
//! The same generic code is compiled for AVX-512, for AVX2 with FMA and for the baseline. Every operation here is
//! an IEEE 754 operation with one correctly rounded result (or a move, a comparison or a selection), so that all
//! three give the same bits; nothing is reassociated or contracted.

mod baseline;
mod row;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(super) use baseline::Baseline;
pub(super) use row::Row;
#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Eight numbers in memory, one cache line.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(super) struct V8(pub(super) [f64; 8]);

impl V8 {
    pub(super) const ZERO: V8 = V8([0.0; 8]);
}

/// Eight numbers in registers. Implementations other than [`Baseline`] may only be made inside functions compiled
/// for the processor features they need.
pub(super) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Eight truth values.
    type Mask: Copy;
    /// The lower half of a row, in one register.
    type Low: Row;
    /// What of a row fits in one register: all of it, or its lower half.
    type First: Row;
    /// The rest of it, if `First` is not all.
    type Rest: Row;
    /// Whether `First` is the lower half only.
    const SPLIT: bool;

    fn splat(value: f64) -> Self;
    fn load(from: &V8) -> Self;
    fn store(self, to: &mut V8);
    /// `self * b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn sqrt(self) -> Self;
    fn floor(self) -> Self;
    /// `self < other ? self : other`, so `other` if either is not a number.
    fn min(self, other: Self) -> Self;
    /// `self > other ? self : other`, so `other` if either is not a number.
    fn max(self, other: Self) -> Self;
    fn gt(self, other: Self) -> Self::Mask;
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn any(mask: Self::Mask) -> bool;
    /// Lane j of row i becomes lane i of row j.
    fn transpose(rows: [Self; 8]) -> [Self; 8];
    /// Stores lane j of vector i as number i of row j; the upper halves of the rows stay as they are.
    fn store_low_rows(vectors: [Self; 4], rows: &mut [V8; 8]);
    /// Number i of row j becomes lane j of vector i, for the lower halves of the rows.
    fn load_low_rows(rows: &[V8; 8]) -> [Self; 4];
    /// The lanes as indices; they must be whole numbers from 0 to 2^31 - 1.
    fn indices(self) -> [usize; 8];
}

/// The numbers, lane by lane.
#[inline(always)]
pub(super) fn numbers<S: Lanes>(lanes: S) -> [f64; 8] {
    let mut row = V8::ZERO;
    lanes.store(&mut row);
    row.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe_row<R: Row>(from: &V8, to: &mut V8) {
        let row = R::load(from);
        let sum = (row * R::halves(0.1, 0.2)).mul_add(R::quarters(0.3, 0.4, 0.5), R::pairs(0.6, 0.7));
        row.mul_add(R::splat(0.8), sum).store(to);
    }

    fn probe<S: Lanes>() -> Vec<u64> {
        let a = V8([1.5, -2.25, 1e-3, 7.0, 0.0, -0.0, 3.3e5, 1.0 / 3.0]);
        let b = V8([0.1, 9.0, -4.0, 7.0, 2.0, 5.0, -1e-8, 1e8]);
        let (x, y) = (S::load(&a), S::load(&b));
        let mask = x.gt(y);
        let rows = S::transpose([x, y, x + y, x - y, x * y, x / y, x.mul_add(y, x), S::select(mask, -x, y)]);
        let mut out = Vec::new();
        for r in rows.into_iter().chain([x.min(y), x.max(y), (x * x).sqrt(), y.floor(), S::splat(0.7)]) {
            let mut v = V8::ZERO;
            r.store(&mut v);
            out.extend(v.0.map(f64::to_bits));
        }
        let mut low = [a; 8];
        S::store_low_rows([x, y, x + y, x * y], &mut low);
        let [first, .., last] = S::load_low_rows(&low);
        first.store(&mut low[0]);
        last.store(&mut low[1]);
        probe_row::<S::Low>(&a, &mut low[2]);
        probe_row::<S::First>(&a, &mut low[3]);
        if S::SPLIT {
            probe_row::<S::Rest>(&a, &mut low[3]);
        }
        out.extend(low.iter().flat_map(|v| v.0.map(f64::to_bits)));
        let both = S::or(y.gt(x), mask);
        out.push(u64::from(S::any(both)));
        out.push(u64::from(S::any(S::and(y.gt(x), mask))));
        out.extend(S::load(&V8([0.0, 1.0, 2.0, 3.0, 77.0, 1e6, 12345.0, 8.0])).indices().map(|i| i as u64));
        out
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn every_operation_gives_the_same_bits_on_every_kernel() {
        #[target_feature(enable = "avx2,fma")]
        fn avx2() -> Vec<u64> {
            probe::<Avx2>()
        }
        #[target_feature(enable = "avx512f,avx512dq,avx512vl,fma,avx2")]
        fn avx512() -> Vec<u64> {
            probe::<Avx512>()
        }
        let reference = probe::<Baseline>();
        for kernel in crate::gimp::Kernel::available() {
            // SAFETY: `available` lists only kernels whose features this processor has.
            let found = match kernel {
                crate::gimp::Kernel::Baseline => probe::<Baseline>(),
                crate::gimp::Kernel::Avx2 => unsafe { avx2() },
                crate::gimp::Kernel::Avx512 => unsafe { avx512() },
            };
            assert_eq!(found, reference, "{kernel:?}");
        }
    }
}
