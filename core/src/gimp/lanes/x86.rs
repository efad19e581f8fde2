//! Eight lanes in one AVX-512 register, or in two AVX registers (AVX2 and FMA).
//!
//! Safety of every `unsafe` below: values of these types are only made inside functions compiled with
//! `#[target_feature]` for the instructions used, which are entered only after a run-time check
//! ([`crate::gimp::Kernel::available`]). Loads and stores go through references to aligned [`V8`].

use super::row::{Half, Quad, Row};
use super::{Lanes, V8};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Clone, Copy)]
pub(in crate::gimp) struct Avx512(__m512d);

#[derive(Clone, Copy)]
pub(in crate::gimp) struct Avx2(__m256d, __m256d);

/// Four numbers in one AVX register.
#[derive(Clone, Copy)]
pub(in crate::gimp) struct Quarter(__m256d);

macro_rules! arithmetic {
    ($trait:ident, $method:ident, $wide:ident, $half:ident) => {
        impl $trait for Avx512 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { Avx512($wide(self.0, other.0)) }
            }
        }
        impl $trait for Avx2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { Avx2($half(self.0, other.0), $half(self.1, other.1)) }
            }
        }
    };
}

arithmetic!(Add, add, _mm512_add_pd, _mm256_add_pd);
arithmetic!(Sub, sub, _mm512_sub_pd, _mm256_sub_pd);
arithmetic!(Mul, mul, _mm512_mul_pd, _mm256_mul_pd);
arithmetic!(Div, div, _mm512_div_pd, _mm256_div_pd);

impl Neg for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        <Self as Lanes>::splat(-0.0) - self
    }
}

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        <Self as Lanes>::splat(-0.0) - self
    }
}

impl Avx512 {
    #[inline(always)]
    fn split(self) -> Avx2 {
        // SAFETY: see the head of this file.
        unsafe { Avx2(_mm512_castpd512_pd256(self.0), _mm512_extractf64x4_pd::<1>(self.0)) }
    }

    #[inline(always)]
    fn join(halves: Avx2) -> Avx512 {
        // SAFETY: see the head of this file.
        unsafe { Avx512(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(halves.0), halves.1)) }
    }
}

impl Row for Avx512 {
    #[inline(always)]
    fn load(from: &V8) -> Self {
        <Self as Lanes>::load(from)
    }

    #[inline(always)]
    fn store(self, to: &mut V8) {
        Lanes::store(self, to);
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Lanes::mul_add(self, b, c)
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        <Self as Lanes>::splat(value)
    }

    #[inline(always)]
    fn halves(low: f64, high: f64) -> Self {
        unsafe { Avx512(_mm512_mask_blend_pd(0xf0, _mm512_set1_pd(low), _mm512_set1_pd(high))) }
    }

    #[inline(always)]
    fn quarters(low: f64, third: f64, fourth: f64) -> Self {
        unsafe {
            let front = _mm512_mask_blend_pd(0x30, _mm512_set1_pd(low), _mm512_set1_pd(third));
            Avx512(_mm512_mask_blend_pd(0xc0, front, _mm512_set1_pd(fourth)))
        }
    }

    #[inline(always)]
    fn pairs(even: f64, odd: f64) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Avx512(_mm512_mask_blend_pd(0xcc, _mm512_set1_pd(even), _mm512_set1_pd(odd))) }
    }
}

impl Add for Quarter {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: see the head of this file; so for every block below.
        unsafe { Quarter(_mm256_add_pd(self.0, other.0)) }
    }
}

impl Mul for Quarter {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        unsafe { Quarter(_mm256_mul_pd(self.0, other.0)) }
    }
}

impl Quad for Quarter {
    #[inline(always)]
    fn load(from: &[f64; 4]) -> Self {
        unsafe { Quarter(_mm256_loadu_pd(from.as_ptr())) }
    }

    #[inline(always)]
    fn store(self, to: &mut [f64; 4]) {
        unsafe { _mm256_storeu_pd(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Quarter(_mm256_fmadd_pd(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        unsafe { Quarter(_mm256_set1_pd(value)) }
    }

    #[inline(always)]
    fn pairs(even: f64, odd: f64) -> Self {
        unsafe { Quarter(_mm256_blend_pd::<0b1100>(_mm256_set1_pd(even), _mm256_set1_pd(odd))) }
    }
}

impl Lanes for Avx512 {
    type Mask = __mmask8;
    type Low = Half<Quarter, false>;
    type First = Avx512;
    type Rest = Half<Quarter, true>;
    const SPLIT: bool = false;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file; so for every block below.
        unsafe { Avx512(_mm512_set1_pd(value)) }
    }

    #[inline(always)]
    fn load(from: &V8) -> Self {
        unsafe { Avx512(_mm512_load_pd(from.0.as_ptr())) }
    }

    #[inline(always)]
    fn store(self, to: &mut V8) {
        unsafe { _mm512_store_pd(to.0.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Avx512(_mm512_fmadd_pd(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Avx512(_mm512_sqrt_pd(self.0)) }
    }

    #[inline(always)]
    fn floor(self) -> Self {
        unsafe { Avx512(_mm512_roundscale_pd::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        unsafe { Avx512(_mm512_min_pd(self.0, other.0)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        unsafe { Avx512(_mm512_max_pd(self.0, other.0)) }
    }

    #[inline(always)]
    fn gt(self, other: Self) -> __mmask8 {
        unsafe { _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn select(mask: __mmask8, yes: Self, no: Self) -> Self {
        unsafe { Avx512(_mm512_mask_blend_pd(mask, no.0, yes.0)) }
    }

    #[inline(always)]
    fn or(a: __mmask8, b: __mmask8) -> __mmask8 {
        a | b
    }

    #[inline(always)]
    fn and(a: __mmask8, b: __mmask8) -> __mmask8 {
        a & b
    }

    #[inline(always)]
    fn any(mask: __mmask8) -> bool {
        mask != 0
    }

    #[inline(always)]
    fn transpose(r: [Self; 8]) -> [Self; 8] {
        unsafe {
            // Pairs of rows, then pairs of pairs by 128-bit quarters, then halves.
            let (a0, a1) = (_mm512_unpacklo_pd(r[0].0, r[1].0), _mm512_unpackhi_pd(r[0].0, r[1].0));
            let (a2, a3) = (_mm512_unpacklo_pd(r[2].0, r[3].0), _mm512_unpackhi_pd(r[2].0, r[3].0));
            let (a4, a5) = (_mm512_unpacklo_pd(r[4].0, r[5].0), _mm512_unpackhi_pd(r[4].0, r[5].0));
            let (a6, a7) = (_mm512_unpacklo_pd(r[6].0, r[7].0), _mm512_unpackhi_pd(r[6].0, r[7].0));
            let b0 = _mm512_shuffle_f64x2::<0x88>(a0, a2);
            let b1 = _mm512_shuffle_f64x2::<0x88>(a1, a3);
            let b2 = _mm512_shuffle_f64x2::<0xdd>(a0, a2);
            let b3 = _mm512_shuffle_f64x2::<0xdd>(a1, a3);
            let b4 = _mm512_shuffle_f64x2::<0x88>(a4, a6);
            let b5 = _mm512_shuffle_f64x2::<0x88>(a5, a7);
            let b6 = _mm512_shuffle_f64x2::<0xdd>(a4, a6);
            let b7 = _mm512_shuffle_f64x2::<0xdd>(a5, a7);
            [
                Avx512(_mm512_shuffle_f64x2::<0x88>(b0, b4)),
                Avx512(_mm512_shuffle_f64x2::<0x88>(b1, b5)),
                Avx512(_mm512_shuffle_f64x2::<0x88>(b2, b6)),
                Avx512(_mm512_shuffle_f64x2::<0x88>(b3, b7)),
                Avx512(_mm512_shuffle_f64x2::<0xdd>(b0, b4)),
                Avx512(_mm512_shuffle_f64x2::<0xdd>(b1, b5)),
                Avx512(_mm512_shuffle_f64x2::<0xdd>(b2, b6)),
                Avx512(_mm512_shuffle_f64x2::<0xdd>(b3, b7)),
            ]
        }
    }

    #[inline(always)]
    fn store_low_rows(vectors: [Self; 4], rows: &mut [V8; 8]) {
        let [a, b, c, d] = vectors;
        Avx2::store_low_rows([a.split(), b.split(), c.split(), d.split()], rows);
    }

    #[inline(always)]
    fn load_low_rows(rows: &[V8; 8]) -> [Self; 4] {
        let [a, b, c, d] = Avx2::load_low_rows(rows);
        [Self::join(a), Self::join(b), Self::join(c), Self::join(d)]
    }

    #[inline(always)]
    fn indices(self) -> [usize; 8] {
        // SAFETY: eight 64-bit integers either way.
        let whole: [i64; 8] = unsafe { std::mem::transmute(_mm512_cvttpd_epi64(self.0)) };
        whole.map(|i| i as usize)
    }
}

impl Lanes for Avx2 {
    type Mask = (__m256d, __m256d);
    type Low = Half<Quarter, false>;
    type First = Half<Quarter, false>;
    type Rest = Half<Quarter, true>;
    const SPLIT: bool = true;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file; so for every block below.
        unsafe { Avx2(_mm256_set1_pd(value), _mm256_set1_pd(value)) }
    }

    #[inline(always)]
    fn load(from: &V8) -> Self {
        let (low, high) = from.0.split_at(4);
        unsafe { Avx2(_mm256_load_pd(low.as_ptr()), _mm256_load_pd(high.as_ptr())) }
    }

    #[inline(always)]
    fn store(self, to: &mut V8) {
        let (low, high) = to.0.split_at_mut(4);
        unsafe {
            _mm256_store_pd(low.as_mut_ptr(), self.0);
            _mm256_store_pd(high.as_mut_ptr(), self.1);
        }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Avx2(_mm256_fmadd_pd(self.0, b.0, c.0), _mm256_fmadd_pd(self.1, b.1, c.1)) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Avx2(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
    }

    #[inline(always)]
    fn floor(self) -> Self {
        unsafe { Avx2(_mm256_floor_pd(self.0), _mm256_floor_pd(self.1)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        unsafe { Avx2(_mm256_min_pd(self.0, other.0), _mm256_min_pd(self.1, other.1)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        unsafe { Avx2(_mm256_max_pd(self.0, other.0), _mm256_max_pd(self.1, other.1)) }
    }

    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        unsafe {
            (_mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0), _mm256_cmp_pd::<_CMP_GT_OQ>(self.1, other.1))
        }
    }

    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        unsafe { Avx2(_mm256_blendv_pd(no.0, yes.0, mask.0), _mm256_blendv_pd(no.1, yes.1, mask.1)) }
    }

    #[inline(always)]
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        unsafe { (_mm256_or_pd(a.0, b.0), _mm256_or_pd(a.1, b.1)) }
    }

    #[inline(always)]
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        unsafe { (_mm256_and_pd(a.0, b.0), _mm256_and_pd(a.1, b.1)) }
    }

    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        unsafe { _mm256_movemask_pd(_mm256_or_pd(mask.0, mask.1)) != 0 }
    }

    #[inline(always)]
    fn transpose(r: [Self; 8]) -> [Self; 8] {
        let [a0, a1, a2, a3] = transpose_quarter([r[0].0, r[1].0, r[2].0, r[3].0]);
        let [a4, a5, a6, a7] = transpose_quarter([r[0].1, r[1].1, r[2].1, r[3].1]);
        let [b0, b1, b2, b3] = transpose_quarter([r[4].0, r[5].0, r[6].0, r[7].0]);
        let [b4, b5, b6, b7] = transpose_quarter([r[4].1, r[5].1, r[6].1, r[7].1]);
        [
            Avx2(a0, b0),
            Avx2(a1, b1),
            Avx2(a2, b2),
            Avx2(a3, b3),
            Avx2(a4, b4),
            Avx2(a5, b5),
            Avx2(a6, b6),
            Avx2(a7, b7),
        ]
    }

    #[inline(always)]
    fn store_low_rows(vectors: [Self; 4], rows: &mut [V8; 8]) {
        let [a, b, c, d] = vectors;
        let first = transpose_quarter([a.0, b.0, c.0, d.0]);
        let last = transpose_quarter([a.1, b.1, c.1, d.1]);
        for q in 0..4 {
            Half::<Quarter, false>(Quarter(first[q])).store(&mut rows[q]);
            Half::<Quarter, false>(Quarter(last[q])).store(&mut rows[4 + q]);
        }
    }

    #[inline(always)]
    fn load_low_rows(rows: &[V8; 8]) -> [Self; 4] {
        let first = transpose_quarter([low(&rows[0]), low(&rows[1]), low(&rows[2]), low(&rows[3])]);
        let last = transpose_quarter([low(&rows[4]), low(&rows[5]), low(&rows[6]), low(&rows[7])]);
        [Avx2(first[0], last[0]), Avx2(first[1], last[1]), Avx2(first[2], last[2]), Avx2(first[3], last[3])]
    }

    #[inline(always)]
    fn indices(self) -> [usize; 8] {
        // SAFETY: four 32-bit integers either way.
        let (low, high): ([i32; 4], [i32; 4]) = unsafe {
            (
                std::mem::transmute::<__m128i, [i32; 4]>(_mm256_cvttpd_epi32(self.0)),
                std::mem::transmute::<__m128i, [i32; 4]>(_mm256_cvttpd_epi32(self.1)),
            )
        };
        [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]].map(|i| i as usize)
    }
}

/// The lower half of a row.
#[inline(always)]
fn low(row: &V8) -> __m256d {
    let half: Half<Quarter, false> = Row::load(row);
    half.0.0
}

/// Transposes four rows of four.
#[inline(always)]
fn transpose_quarter(r: [__m256d; 4]) -> [__m256d; 4] {
    // SAFETY: see the head of this file.
    unsafe {
        let (a0, a1) = (_mm256_unpacklo_pd(r[0], r[1]), _mm256_unpackhi_pd(r[0], r[1]));
        let (a2, a3) = (_mm256_unpacklo_pd(r[2], r[3]), _mm256_unpackhi_pd(r[2], r[3]));
        [
            _mm256_permute2f128_pd::<0x20>(a0, a2),
            _mm256_permute2f128_pd::<0x20>(a1, a3),
            _mm256_permute2f128_pd::<0x31>(a0, a2),
            _mm256_permute2f128_pd::<0x31>(a1, a3),
        ]
    }
}
