// SPDX-License-Identifier: MIT
//! A value with its derivatives by `P` parameters (forward mode).

use super::{Number, Real};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// `re + Σ eps_i ε_i` with `ε_i ε_j = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const P: usize> {
    /// Value.
    pub re: f64,
    /// Derivatives.
    pub eps: [f64; P],
}

impl<const P: usize> Dual<P> {
    /// Value and its derivatives.
    #[inline(always)]
    pub fn new(re: f64, eps: [f64; P]) -> Self {
        Self { re, eps }
    }

    /// Parameter number `i` itself.
    pub fn variable(re: f64, i: usize) -> Self {
        let mut eps = [0.0; P];
        eps[i] = 1.0;
        Self { re, eps }
    }

    /// Function value and derivative, by the chain rule.
    #[inline(always)]
    pub(super) fn chain(self, value: f64, derivative: f64) -> Self {
        let mut eps = self.eps;
        for e in &mut eps {
            *e *= derivative;
        }
        Self { re: value, eps }
    }

    #[inline(always)]
    fn zip(self, other: Self, re: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut eps = [0.0; P];
        for i in 0..P {
            eps[i] = f(self.eps[i], other.eps[i]);
        }
        Self { re, eps }
    }
}

impl<const P: usize> Add for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.zip(o, self.re + o.re, |a, b| a + b)
    }
}

impl<const P: usize> Sub for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.zip(o, self.re - o.re, |a, b| a - b)
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
impl<const P: usize> Mul for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let product_rule = |a, b| self.re * b + a * o.re;
        self.zip(o, self.re * o.re, product_rule)
    }
}

impl<const P: usize> Div for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let (ratio, inverse) = (self.re / o.re, 1.0 / o.re);
        self.zip(o, ratio, |a, b| (a - ratio * b) * inverse)
    }
}

impl<const P: usize> Neg for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.re, -1.0)
    }
}

impl<const P: usize> Add<f64> for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: f64) -> Self {
        Self { re: self.re + o, eps: self.eps }
    }
}

impl<const P: usize> Sub<f64> for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: f64) -> Self {
        Self { re: self.re - o, eps: self.eps }
    }
}

impl<const P: usize> Mul<f64> for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self.chain(self.re * o, o)
    }
}

impl<const P: usize> Div<f64> for Dual<P> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: f64) -> Self {
        Self { re: self.re / o, eps: self.eps.map(|e| e / o) }
    }
}

impl<R, const P: usize> AddAssign<R> for Dual<P>
where
    Self: Add<R, Output = Self>,
{
    #[inline(always)]
    fn add_assign(&mut self, o: R) {
        *self = *self + o;
    }
}

impl<R, const P: usize> SubAssign<R> for Dual<P>
where
    Self: Sub<R, Output = Self>,
{
    #[inline(always)]
    fn sub_assign(&mut self, o: R) {
        *self = *self - o;
    }
}

impl<R, const P: usize> MulAssign<R> for Dual<P>
where
    Self: Mul<R, Output = Self>,
{
    #[inline(always)]
    fn mul_assign(&mut self, o: R) {
        *self = *self * o;
    }
}

impl<R, const P: usize> DivAssign<R> for Dual<P>
where
    Self: Div<R, Output = Self>,
{
    #[inline(always)]
    fn div_assign(&mut self, o: R) {
        *self = *self / o;
    }
}

impl<const P: usize> Number for Dual<P> {
    #[inline(always)]
    fn promote(value: f64) -> Self {
        Self::of(value)
    }
    fn from_lanes(value: impl Fn(usize) -> f64) -> Self {
        Self::of(value(0))
    }
    fn is_constant(&self) -> bool {
        self.eps == [0.0; P]
    }
    fn size(&self) -> f64 {
        self.eps.iter().fold(self.re.abs(), |sum, e| sum + e.abs())
    }
    fn recip(self) -> Self {
        let inverse = self.re.recip();
        self.chain(inverse, -inverse * inverse)
    }
    fn sqrt(self) -> Self {
        let root = self.re.sqrt();
        self.chain(root, 0.5 / root)
    }
    fn exp(self) -> Self {
        let value = self.re.exp();
        self.chain(value, value)
    }
}

impl<const P: usize> Real for Dual<P> {
    type Slopes = [f64; P];

    const NO_SLOPES: [f64; P] = [f64::NAN; P];

    #[inline(always)]
    fn from_slopes(slopes: [f64; P]) -> Self {
        Self { re: 0.0, eps: slopes }
    }
    #[inline(always)]
    fn slopes(self) -> [f64; P] {
        self.eps
    }
    fn sin(self) -> Self {
        self.chain(self.re.sin(), self.re.cos())
    }
    fn cos(self) -> Self {
        self.chain(self.re.cos(), -self.re.sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Central difference of a function of one variable against its dual.
    fn check(f: impl Fn(Dual<1>) -> Dual<1>, x: f64) {
        let h = 1e-6;
        let at = |x: f64| f(Dual::of(x)).re;
        let difference = (at(x + h) - at(x - h)) / (2.0 * h);
        let exact = f(Dual::variable(x, 0)).eps[0];
        assert!((exact - difference).abs() < 1e-8 * (1.0 + exact.abs()), "{exact} {difference}");
    }

    #[test]
    fn derivatives_of_all_operations_agree_with_differences() {
        check(|x| x * x + x / (x + 2.0) - x * 3.0, 0.7);
        check(|x| x.recip() + x.sqrt() + (-x).exp(), 0.7);
        check(|x| x.sin() * x.cos() - x, 0.7);
    }
}
