//! Eight lanes as an array: for every processor. Where the target has no fused multiply-add, `mul_add` is a slow
//! but exact library call.

use super::row::{Half, Quad};
use super::{Lanes, V8};
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Clone, Copy)]
pub(in crate::gimp) struct Baseline([f64; 8]);

macro_rules! lane_by_lane {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Baseline {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..8 {
                    self.0[i] $op other.0[i];
                }
                self
            }
        }
    };
}

lane_by_lane!(Add, add, +=);
lane_by_lane!(Sub, sub, -=);
lane_by_lane!(Mul, mul, *=);
lane_by_lane!(Div, div, /=);

impl Neg for Baseline {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Baseline(self.0.map(|a| -a))
    }
}

impl Lanes for Baseline {
    type Mask = [bool; 8];
    type Low = Half<Four, false>;
    type First = Half<Four, false>;
    type Rest = Half<Four, true>;
    const SPLIT: bool = true;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Baseline([value; 8])
    }

    #[inline(always)]
    fn load(from: &V8) -> Self {
        Baseline(from.0)
    }

    #[inline(always)]
    fn store(self, to: &mut V8) {
        to.0 = self.0;
    }

    #[inline(always)]
    fn mul_add(mut self, b: Self, c: Self) -> Self {
        for i in 0..8 {
            self.0[i] = self.0[i].mul_add(b.0[i], c.0[i]);
        }
        self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Baseline(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Baseline(self.0.map(f64::floor))
    }

    #[inline(always)]
    fn min(mut self, other: Self) -> Self {
        for i in 0..8 {
            self.0[i] = if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] };
        }
        self
    }

    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        for i in 0..8 {
            self.0[i] = if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] };
        }
        self
    }

    #[inline(always)]
    fn gt(self, other: Self) -> [bool; 8] {
        std::array::from_fn(|i| self.0[i] > other.0[i])
    }

    #[inline(always)]
    fn select(mask: [bool; 8], yes: Self, no: Self) -> Self {
        Baseline(std::array::from_fn(|i| if mask[i] { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    fn or(a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        std::array::from_fn(|i| a[i] | b[i])
    }

    #[inline(always)]
    fn and(a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        std::array::from_fn(|i| a[i] & b[i])
    }

    #[inline(always)]
    fn any(mask: [bool; 8]) -> bool {
        mask.into_iter().any(|m| m)
    }

    #[inline(always)]
    fn transpose(rows: [Self; 8]) -> [Self; 8] {
        std::array::from_fn(|j| Baseline(std::array::from_fn(|i| rows[i].0[j])))
    }

    #[inline(always)]
    fn store_low_rows(vectors: [Self; 4], rows: &mut [V8; 8]) {
        for (i, vector) in vectors.iter().enumerate() {
            for (row, &value) in rows.iter_mut().zip(&vector.0) {
                row.0[i] = value;
            }
        }
    }

    #[inline(always)]
    fn load_low_rows(rows: &[V8; 8]) -> [Self; 4] {
        std::array::from_fn(|i| Baseline(std::array::from_fn(|j| rows[j].0[i])))
    }

    #[inline(always)]
    fn indices(self) -> [usize; 8] {
        self.0.map(|a| a as usize)
    }
}

/// Four numbers as an array.
#[derive(Clone, Copy)]
pub(in crate::gimp) struct Four([f64; 4]);

impl Add for Four {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Four(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Mul for Four {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Four(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }
}

impl Quad for Four {
    #[inline(always)]
    fn load(from: &[f64; 4]) -> Self {
        Four(*from)
    }

    #[inline(always)]
    fn store(self, to: &mut [f64; 4]) {
        *to = self.0;
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Four(std::array::from_fn(|i| self.0[i].mul_add(b.0[i], c.0[i])))
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Four([value; 4])
    }

    #[inline(always)]
    fn pairs(even: f64, odd: f64) -> Self {
        Four([even, even, odd, odd])
    }
}
