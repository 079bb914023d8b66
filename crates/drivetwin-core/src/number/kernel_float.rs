// SPDX-License-Identifier: MIT
//! Arithmetic without decisions: what the inner loop over samples needs of a number.

use super::{Dual, Number};
use std::ops::{Add, Mul, Neg, Sub};

/// One run, one run with derivatives, or several runs side by side. Operations act on every run alike,
/// so that a run's result does not depend on its neighbours.
///
/// Multiply-adds are fused by the caller's word (`F`), not by the compiler: a fused one is an
/// instruction where the processor has it and a slow call where it has not.
pub trait KernelFloat:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// True if a value carries derivatives, so that inputs may jump in these alone.
    const DERIVATIVES: bool;

    /// All runs, as bits.
    const RUNS: u32;

    /// The values alone.
    type Values: Values;

    /// Set all lanes to one value.
    fn splat(value: f64) -> Self;

    /// `self · a + b`.
    fn fma<const F: bool>(self, a: Self, b: Self) -> Self;

    /// `self · factor + b`.
    fn fma_times<const F: bool>(self, factor: f64, b: Self) -> Self;

    /// `self · factor + b` with a factor of every run.
    fn fma_values<const F: bool>(self, factor: Self::Values, b: Self) -> Self;

    /// Product with a number.
    fn times(self, factor: f64) -> Self;

    /// `e^x` to a few units in the last place for |x| < 700, beyond that of the bound.
    fn exponential<const F: bool>(self) -> Self;

    /// `self · e^x` for |x| up to [`SMALL`].
    fn times_small_exp<const F: bool>(self, x: Self) -> Self;

    /// Replace the values of the runs given as bits by those of `other`.
    fn replace_where(self, runs: u32, other: Self) -> Self;

    /// The values without derivatives.
    fn values(self) -> Self::Values;
}

/// A factor of numbers of type `L`: one of them, or a plain number, which is the same in all runs and has no
/// derivatives.
pub trait Coefficient<L: KernelFloat>: KernelFloat {
    /// `self · a`.
    fn multiply(self, a: L) -> L;

    /// `self · a + b`.
    fn multiply_add<const F: bool>(self, a: L, b: L) -> L;
}

impl<L: KernelFloat> Coefficient<L> for f64 {
    #[inline(always)]
    fn multiply(self, a: L) -> L {
        a.times(self)
    }
    #[inline(always)]
    fn multiply_add<const F: bool>(self, a: L, b: L) -> L {
        a.fma_times::<F>(self, b)
    }
}

impl<const P: usize> Coefficient<Self> for Dual<P> {
    #[inline(always)]
    fn multiply(self, a: Self) -> Self {
        self * a
    }
    #[inline(always)]
    fn multiply_add<const F: bool>(self, a: Self, b: Self) -> Self {
        self.fma::<F>(a, b)
    }
}

/// Values of one or several runs, as used in guards: a guard falls where its sign bit is set.
pub trait Values: Number + KernelFloat<Values = Self> {
    /// Value of `predicate` for the run that decides. Of several runs the first decides for all. Runs with
    /// another value of `predicate` part with it, see [`with_consensus`](super::with_consensus).
    fn decide<R: PartialEq>(self, predicate: impl Fn(f64) -> R) -> R;

    /// Value of `predicate` over two values, see [`Self::decide`].
    fn decide_with<R: PartialEq>(self, other: Self, predicate: impl Fn(f64, f64) -> R) -> R;

    /// Runs for whose value `predicate` holds, as bits.
    fn mask_where(self, predicate: impl Fn(f64) -> bool) -> u32;

    /// The value of the run that decides, for messages.
    fn leading(self) -> f64;

    /// The value of a run by its number.
    fn run_value(self, run: usize) -> f64;

    /// Magnitude.
    fn magnitude(self) -> Self;

    /// The larger of two numbers, run by run.
    fn larger(self, other: Self) -> Self;

    /// The smaller of two numbers, run by run.
    fn smaller(self, other: Self) -> Self;

    /// Number that is negative where either operand is; its magnitude has no meaning.
    fn either_negative(self, other: Self) -> Self;

    /// Runs whose value is negative, as bits.
    fn negative_mask(self) -> u32;

    /// True if the value of any run is negative.
    fn any_negative(self) -> bool;

    /// Runs whose value is infinite or no number, as bits.
    fn nonfinite_mask(self) -> u32 {
        self.mask_where(|value| !value.is_finite())
    }
}

/// `a · b + c`, fused or not.
#[inline(always)]
pub(super) fn fused<const F: bool>(a: f64, b: f64, c: f64) -> f64 {
    if F { a.mul_add(b, c) } else { a * b + c }
}

/// 1.5 · 2^52: a sum with it leaves the nearest integer in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, of which the first has trailing zeros (Cody and Waite).
const LN_2: (f64, f64) = (0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10);
/// 1/k! for k = 13 .. 0.
const EXPONENTIAL: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// By `e^x = 2^n e^r` with |r| ≤ ln 2 / 2 and the series of `e^r`; free of branches.
#[inline(always)]
pub(super) fn exponential<const F: bool>(x: f64) -> f64 {
    let x = x.clamp(-700.0, 700.0);
    let shifted = fused::<F>(x, std::f64::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    let r = fused::<F>(n, -LN_2.1, fused::<F>(n, -LN_2.0, x));
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    // Even and odd powers apart, for half the chain of dependent products.
    let square = r * r;
    let (mut odd, mut even) = (EXPONENTIAL[0], EXPONENTIAL[1]);
    for k in (2..EXPONENTIAL.len()).step_by(2) {
        odd = fused::<F>(odd, square, EXPONENTIAL[k]);
        even = fused::<F>(even, square, EXPONENTIAL[k + 1]);
    }
    fused::<F>(odd, r, even) * power
}

/// Largest |x| for which [`KernelFloat::times_small_exp`] is exact to 3e-14.
pub const SMALL: f64 = 0.125;

/// `e^x` for |x| up to [`SMALL`], by its series; powers of x² apart, for a short chain of products.
#[inline(always)]
pub(super) fn small_exp<const F: bool>(x: f64) -> f64 {
    let (c, square) = (&EXPONENTIAL, x * x);
    let pair = |k: usize| fused::<F>(c[12 - k], x, c[13 - k]);
    let (low, high) = (fused::<F>(pair(2), square, pair(0)), fused::<F>(pair(6), square, pair(4)));
    let high = fused::<F>(c[5], square * square, high);
    fused::<F>(high, square * square, low)
}

impl KernelFloat for f64 {
    const DERIVATIVES: bool = false;

    const RUNS: u32 = 1;

    type Values = Self;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn fma<const F: bool>(self, a: Self, b: Self) -> Self {
        fused::<F>(self, a, b)
    }
    #[inline(always)]
    fn fma_times<const F: bool>(self, factor: f64, b: Self) -> Self {
        fused::<F>(self, factor, b)
    }
    #[inline(always)]
    fn fma_values<const F: bool>(self, factor: f64, b: Self) -> Self {
        self.fma_times::<F>(factor, b)
    }
    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        self * factor
    }
    #[inline(always)]
    fn exponential<const F: bool>(self) -> Self {
        exponential::<F>(self)
    }
    #[inline(always)]
    fn times_small_exp<const F: bool>(self, x: Self) -> Self {
        self * small_exp::<F>(x)
    }
    #[inline(always)]
    fn replace_where(self, runs: u32, other: Self) -> Self {
        if runs & 1 == 1 { other } else { self }
    }
    #[inline(always)]
    fn values(self) -> Self {
        self
    }
}

impl Values for f64 {
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn either_negative(self, other: Self) -> Self {
        f64::from_bits(self.to_bits() | other.to_bits())
    }
    #[inline(always)]
    fn negative_mask(self) -> u32 {
        (self.to_bits() >> 63) as u32
    }
    #[inline(always)]
    fn any_negative(self) -> bool {
        self.is_sign_negative()
    }
    #[inline(always)]
    fn decide<R: PartialEq>(self, predicate: impl Fn(f64) -> R) -> R {
        predicate(self)
    }
    #[inline(always)]
    fn decide_with<R: PartialEq>(self, other: Self, predicate: impl Fn(f64, f64) -> R) -> R {
        predicate(self, other)
    }
    #[inline(always)]
    fn mask_where(self, predicate: impl Fn(f64) -> bool) -> u32 {
        u32::from(predicate(self))
    }
    #[inline(always)]
    fn leading(self) -> f64 {
        self
    }
    #[inline(always)]
    fn run_value(self, _: usize) -> f64 {
        self
    }
}

impl<const P: usize> KernelFloat for Dual<P> {
    const DERIVATIVES: bool = true;

    const RUNS: u32 = 1;

    type Values = f64;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::new(value, [0.0; P])
    }
    #[inline(always)]
    fn fma<const F: bool>(self, a: Self, b: Self) -> Self {
        let mut eps = b.eps;
        for i in 0..P {
            eps[i] = fused::<F>(self.eps[i], a.re, eps[i]);
            eps[i] = fused::<F>(self.re, a.eps[i], eps[i]);
        }
        Self::new(fused::<F>(self.re, a.re, b.re), eps)
    }
    #[inline(always)]
    fn fma_times<const F: bool>(self, factor: f64, b: Self) -> Self {
        let mut eps = b.eps;
        for i in 0..P {
            eps[i] = fused::<F>(self.eps[i], factor, eps[i]);
        }
        Self::new(fused::<F>(self.re, factor, b.re), eps)
    }
    #[inline(always)]
    fn fma_values<const F: bool>(self, factor: f64, b: Self) -> Self {
        self.fma_times::<F>(factor, b)
    }
    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        self * factor
    }
    #[inline(always)]
    fn exponential<const F: bool>(self) -> Self {
        let value = exponential::<F>(self.re);
        self.chain(value, value)
    }
    #[inline(always)]
    fn times_small_exp<const F: bool>(self, x: Self) -> Self {
        let factor = small_exp::<F>(x.re);
        self * x.chain(factor, factor)
    }
    #[inline(always)]
    fn replace_where(self, runs: u32, other: Self) -> Self {
        if runs & 1 == 1 { other } else { self }
    }
    #[inline(always)]
    fn values(self) -> f64 {
        self.re
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_exponential_agrees_with_the_library(x in -600.0..600.0_f64) {
            for value in [exponential::<false>(x), exponential::<true>(x)] {
                prop_assert!((value / x.exp() - 1.0).abs() < 4.0 * f64::EPSILON);
            }
        }
    }

    proptest! {
        #[test]
        fn small_growth_agrees_with_the_library(x in -SMALL..SMALL) {
            for value in [small_exp::<false>(x), small_exp::<true>(x)] {
                prop_assert!((value / x.exp() - 1.0).abs() < 3e-14);
            }
        }
    }

    #[test]
    fn fused_and_plain_products_of_duals_agree_to_round_off() {
        let (a, b) = (Dual::<2>::new(1.7, [0.3, -2.0]), Dual::<2>::new(-0.4, [1.1, 5.0]));
        let (fused, unfused) = (a.fma::<true>(b, a), a * b + a);
        for (x, y) in fused.eps.iter().zip(unfused.eps) {
            assert!((x - y).abs() < 1e-14);
        }
    }
}
