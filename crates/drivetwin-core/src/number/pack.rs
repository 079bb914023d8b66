// SPDX-License-Identifier: MIT
//! Values of several runs side by side.

use super::lane::{Lane, Values};
use std::ops::{Add, Mul, Neg, Sub};

/// `K` values, one of each run. The loops over the runs compile to vector instructions of the set that
/// is active where they are inlined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pack<const K: usize>(pub [f64; K]);

impl<const K: usize> Pack<K> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = [0.0; K];
        for i in 0..K {
            out[i] = f(self.0[i], other.0[i]);
        }
        Self(out)
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

impl<const K: usize> Add for Pack<K> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.zip(o, |a, b| a + b)
    }
}

impl<const K: usize> Sub for Pack<K> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.zip(o, |a, b| a - b)
    }
}

impl<const K: usize> Mul for Pack<K> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.zip(o, |a, b| a * b)
    }
}

impl<const K: usize> Neg for Pack<K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|a| -a)
    }
}

impl<const K: usize> Lane for Pack<K> {
    const DERIVATIVES: bool = false;

    type Values = Self;

    #[inline(always)]
    fn all(value: f64) -> Self {
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
    fn times(self, factor: f64) -> Self {
        self.each(|a| a * factor)
    }
    #[inline(always)]
    fn exponential<const F: bool>(self) -> Self {
        self.each(|a| a.exponential::<F>())
    }
    #[inline(always)]
    fn values(self) -> Self {
        self
    }
}

impl<const K: usize> Values for Pack<K> {
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.each(f64::abs)
    }
    #[inline(always)]
    fn lower(self, other: Self) -> Self {
        self.zip(other, |a, b| a.lower(b))
    }
    #[inline(always)]
    fn upper(self, other: Self) -> Self {
        self.zip(other, |a, b| a.upper(b))
    }
    #[inline(always)]
    fn lower_unless_idle(self, other: Self) -> Self {
        self.zip(other, |a, b| a.lower_unless_idle(b))
    }
    #[inline(always)]
    fn fallen(self) -> u32 {
        let mut bits = 0;
        for i in 0..K {
            bits |= self.0[i].fallen() << i;
        }
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_no_number_counts_as_fallen() {
        let guard = Pack::<4>([1.0, 0.0, f64::NAN, -1.0]);
        assert_eq!(guard.fallen(), 0b1110);
        assert_eq!(guard.lower(Pack::all(2.0)).fallen(), 0b1110);
        assert_eq!(1.0_f64.lower(f64::NAN).fallen(), 1);
    }
}
