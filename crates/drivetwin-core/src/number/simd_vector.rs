// SPDX-License-Identifier: MIT
//! Values of several runs side by side.

use super::Number;
use super::consensus::{branch, leader_lane};
use super::kernel_float::{Coefficient, KernelFloat, Values, small_exp};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// `K` values, one of each run. The loops over the runs compile to vector instructions of the set that
/// is active where they are inlined. Aligned to the cache's lines, so that no vector straddles two.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct SimdVector<const K: usize>(pub [f64; K]);

impl<const K: usize> SimdVector<K> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = [0.0; K];
        for i in 0..K {
            out[i] = f(self.0[i], other.0[i]);
        }
        Self(out)
    }

    #[inline(always)]
    fn bits(self, f: impl Fn(f64) -> u32) -> u32 {
        let mut bits = 0;
        for i in 0..K {
            bits |= f(self.0[i]) << i;
        }
        bits
    }

    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self.0;
        for value in &mut out {
            *value = f(*value);
        }
        Self(out)
    }
}

impl<const K: usize> Add for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.zip(o, |a, b| a + b)
    }
}

impl<const K: usize> Sub for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.zip(o, |a, b| a - b)
    }
}

impl<const K: usize> Mul for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.zip(o, |a, b| a * b)
    }
}

impl<const K: usize> Div for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        self.zip(o, |a, b| a / b)
    }
}

impl<const K: usize> Add<f64> for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: f64) -> Self {
        self.each(|a| a + o)
    }
}

impl<const K: usize> Sub<f64> for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: f64) -> Self {
        self.each(|a| a - o)
    }
}

impl<const K: usize> Mul<f64> for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self.each(|a| a * o)
    }
}

impl<const K: usize> Div<f64> for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: f64) -> Self {
        self.each(|a| a / o)
    }
}

impl<R, const K: usize> AddAssign<R> for SimdVector<K>
where
    Self: Add<R, Output = Self>,
{
    #[inline(always)]
    fn add_assign(&mut self, o: R) {
        *self = *self + o;
    }
}

impl<R, const K: usize> SubAssign<R> for SimdVector<K>
where
    Self: Sub<R, Output = Self>,
{
    #[inline(always)]
    fn sub_assign(&mut self, o: R) {
        *self = *self - o;
    }
}

impl<R, const K: usize> MulAssign<R> for SimdVector<K>
where
    Self: Mul<R, Output = Self>,
{
    #[inline(always)]
    fn mul_assign(&mut self, o: R) {
        *self = *self * o;
    }
}

impl<R, const K: usize> DivAssign<R> for SimdVector<K>
where
    Self: Div<R, Output = Self>,
{
    #[inline(always)]
    fn div_assign(&mut self, o: R) {
        *self = *self / o;
    }
}

impl<const K: usize> Number for SimdVector<K> {
    #[inline(always)]
    fn promote(values: Self) -> Self {
        values
    }
    fn from_lanes(value: impl Fn(usize) -> f64) -> Self {
        Self(std::array::from_fn(value))
    }
    #[inline(always)]
    fn is_constant(&self) -> bool {
        true
    }
    #[inline(always)]
    fn recip(self) -> Self {
        self.each(f64::recip)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.each(f64::sqrt)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.each(f64::exp)
    }
}

impl<const K: usize> Neg for SimdVector<K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|a| -a)
    }
}

impl<const K: usize> KernelFloat for SimdVector<K> {
    const DERIVATIVES: bool = false;

    const RUNS: u32 = (1 << K) - 1;

    type Values = Self;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; K])
    }
    #[inline(always)]
    fn fma<const F: bool>(self, a: Self, b: Self) -> Self {
        let mut out = b.0;
        for i in 0..K {
            out[i] = self.0[i].fma::<F>(a.0[i], out[i]);
        }
        Self(out)
    }
    #[inline(always)]
    fn fma_times<const F: bool>(self, factor: f64, b: Self) -> Self {
        self.fma::<F>(Self::splat(factor), b)
    }
    #[inline(always)]
    fn fma_values<const F: bool>(self, factor: Self, b: Self) -> Self {
        self.fma::<F>(factor, b)
    }
    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        self.each(|a| a * factor)
    }
    #[inline(always)]
    fn exponential<const F: bool>(self) -> Self {
        self.each(|a| a.exponential::<F>())
    }
    #[inline(always)]
    fn times_small_exp<const F: bool>(self, x: Self) -> Self {
        self.zip(x, |value, x| value * small_exp::<F>(x))
    }
    #[inline(always)]
    fn replace_where(self, runs: u32, other: Self) -> Self {
        let mut out = self.0;
        for i in 0..K {
            out[i] = if runs >> i & 1 == 1 { other.0[i] } else { out[i] };
        }
        Self(out)
    }
    #[inline(always)]
    fn values(self) -> Self {
        self
    }
}

impl<const K: usize> Coefficient<Self> for SimdVector<K> {
    #[inline(always)]
    fn multiply(self, a: Self) -> Self {
        self * a
    }
    #[inline(always)]
    fn multiply_add<const F: bool>(self, a: Self, b: Self) -> Self {
        self.fma::<F>(a, b)
    }
}

impl<const K: usize> Values for SimdVector<K> {
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.each(f64::abs)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.zip(other, |a, b| a.larger(b))
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.zip(other, |a, b| a.smaller(b))
    }
    #[inline(always)]
    fn either_negative(self, other: Self) -> Self {
        self.zip(other, |a, b| a.either_negative(b))
    }
    #[inline(always)]
    fn negative_mask(self) -> u32 {
        self.bits(|a| a.negative_mask())
    }
    #[inline(always)]
    fn any_negative(self) -> bool {
        let mut any = 0;
        for i in 0..K {
            any |= self.0[i].to_bits();
        }
        any >> 63 == 1
    }
    #[inline(always)]
    fn decide<R: PartialEq>(self, predicate: impl Fn(f64) -> R) -> R {
        branch(|run| predicate(self.0[run % K]))
    }
    #[inline(always)]
    fn decide_with<R: PartialEq>(self, other: Self, predicate: impl Fn(f64, f64) -> R) -> R {
        branch(|run| predicate(self.0[run % K], other.0[run % K]))
    }
    #[inline(always)]
    fn mask_where(self, predicate: impl Fn(f64) -> bool) -> u32 {
        self.bits(|a| u32::from(predicate(a)))
    }
    fn leading(self) -> f64 {
        self.0[leader_lane() % K]
    }
    #[inline(always)]
    fn run_value(self, run: usize) -> f64 {
        self.0[run % K]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guard_has_fallen_where_either_sign_is_negative() {
        let (one, other) =
            (SimdVector::<4>([1.0, -1.0, 0.0, -2.0]), SimdVector([0.0, 3.0, -4.0, -5.0]));
        assert_eq!(one.either_negative(other).negative_mask(), 0b1110);
    }

    #[test]
    fn infinities_and_what_is_no_number_are_unbounded() {
        let values = SimdVector::<4>([1.0, f64::NAN, f64::NEG_INFINITY, f64::INFINITY]);
        assert_eq!(values.nonfinite_mask(), 0b1110);
    }
}
