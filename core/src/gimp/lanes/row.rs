//! The eight numbers that belong to one node or one point, all or half of them, in one register.

use super::V8;
use std::ops::{Add, Mul};

/// A row of eight numbers, or half of one. What is not held is neither loaded nor stored.
pub(in crate::gimp) trait Row: Copy + Add<Output = Self> + Mul<Output = Self> {
    fn load(from: &V8) -> Self;
    fn store(self, to: &mut V8);
    /// `self * b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn splat(value: f64) -> Self;
    /// Numbers 0 to 3 are `low`, 4 to 7 are `high`.
    fn halves(low: f64, high: f64) -> Self;
    /// Numbers 0 to 3 are `low`, 4 and 5 are `third`, 6 and 7 are `fourth`.
    fn quarters(low: f64, third: f64, fourth: f64) -> Self;
    /// Numbers 0, 1, 4 and 5 are `even`, the others are `odd`.
    fn pairs(even: f64, odd: f64) -> Self;
}

/// Four numbers in a register.
pub(super) trait Quad: Copy + Add<Output = Self> + Mul<Output = Self> {
    fn load(from: &[f64; 4]) -> Self;
    fn store(self, to: &mut [f64; 4]);
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn splat(value: f64) -> Self;
    fn pairs(even: f64, odd: f64) -> Self;
}

/// The lower or the upper half of a row.
#[derive(Clone, Copy)]
pub(in crate::gimp) struct Half<Q, const HIGH: bool>(pub(super) Q);

impl<Q: Quad, const HIGH: bool> Add for Half<Q, HIGH> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Half(self.0 + other.0)
    }
}

impl<Q: Quad, const HIGH: bool> Mul for Half<Q, HIGH> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Half(self.0 * other.0)
    }
}

impl<Q: Quad, const HIGH: bool> Row for Half<Q, HIGH> {
    #[inline(always)]
    fn load(from: &V8) -> Self {
        Half(Q::load(half::<HIGH>(from)))
    }

    #[inline(always)]
    fn store(self, to: &mut V8) {
        self.0.store(half_mut::<HIGH>(to));
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Half(self.0.mul_add(b.0, c.0))
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Half(Q::splat(value))
    }

    #[inline(always)]
    fn halves(low: f64, high: f64) -> Self {
        Half(Q::splat(if HIGH { high } else { low }))
    }

    #[inline(always)]
    fn quarters(low: f64, third: f64, fourth: f64) -> Self {
        Half(if HIGH { Q::pairs(third, fourth) } else { Q::splat(low) })
    }

    #[inline(always)]
    fn pairs(even: f64, odd: f64) -> Self {
        Half(Q::pairs(even, odd))
    }
}

#[inline(always)]
fn half<const HIGH: bool>(row: &V8) -> &[f64; 4] {
    let half = if HIGH { row.0.last_chunk() } else { row.0.first_chunk() };
    half.unwrap_or(&[0.0; 4])
}

#[inline(always)]
fn half_mut<const HIGH: bool>(row: &mut V8) -> &mut [f64; 4] {
    let half = if HIGH { row.0.last_chunk_mut() } else { row.0.first_chunk_mut() };
    half.expect("a row has two halves")
}
