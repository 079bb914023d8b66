// SPDX-License-Identifier: MIT
//! The number types the physics is written over: `f64` for values, [`Dual`] for derivatives, [`SimdVector`]
//! for several runs side by side that move as one.

mod consensus;
mod dual;
mod kernel_float;
mod seeded;
mod series;
mod simd_vector;
mod transpose;

pub use consensus::with_consensus;
pub use dual::Dual;
pub use kernel_float::{Coefficient, KernelFloat, SMALL, Values};
pub use series::{INVERSE, Series, TERMS, evaluate, product_term, slope};
pub use simd_vector::SimdVector;
pub use transpose::{FOUR, transpose};

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Sub, SubAssign};

/// A number that mechanisms are stated, compiled and moved in: of one run, with or without derivatives, or
/// of several runs side by side. Decisions are taken on [`Number::re`], see [`Values::decide`].
pub trait Number:
    Coefficient<Self>
    + Debug
    + PartialEq
    + Send
    + Sync
    + 'static
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + AddAssign<f64>
    + SubAssign<f64>
    + MulAssign<f64>
    + DivAssign<f64>
{
    /// A value without derivatives, the same in every run.
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::splat(value)
    }

    /// Zero, without derivatives.
    fn zero_() -> Self {
        Self::of(0.0)
    }

    /// Values without derivatives.
    fn promote(values: Self::Values) -> Self;

    /// A value of every run by its number; that of run 0 where there is but one.
    fn from_lanes(value: impl Fn(usize) -> f64) -> Self;

    /// The value, of every run.
    fn re(&self) -> Self::Values {
        self.values()
    }

    /// Return true if all derivatives are zero.
    fn is_constant(&self) -> bool;

    /// Its magnitude and those of its derivatives.
    fn size(&self) -> Self::Values {
        self.re().magnitude()
    }

    /// 1 / x.
    fn recip(self) -> Self;

    /// Square root.
    fn sqrt(self) -> Self;

    /// e^x.
    fn exp(self) -> Self;
}

/// A number of one run, with or without derivatives.
pub trait Real: Number + Coefficient<Self, Values = f64> {
    /// Derivatives by the parameters: an array.
    type Slopes: Copy + Debug + Send + Sync;

    /// Derivatives that are no numbers.
    const NO_SLOPES: Self::Slopes;

    /// Number zero with derivatives by the parameters.
    fn from_slopes(slopes: Self::Slopes) -> Self;

    /// Derivatives by the parameters.
    fn slopes(self) -> Self::Slopes;

    /// Sine, x in rad.
    fn sin(self) -> Self;

    /// Cosine, x in rad.
    fn cos(self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn promote(value: f64) -> Self {
        value
    }
    fn from_lanes(value: impl Fn(usize) -> f64) -> Self {
        value(0)
    }
    #[inline(always)]
    fn is_constant(&self) -> bool {
        true
    }
    fn recip(self) -> Self {
        self.recip()
    }
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    fn exp(self) -> Self {
        self.exp()
    }
}

impl Real for f64 {
    type Slopes = [f64; 0];

    const NO_SLOPES: Self::Slopes = [];

    #[inline(always)]
    fn from_slopes(_: Self::Slopes) -> Self {
        0.0
    }
    #[inline(always)]
    fn slopes(self) -> Self::Slopes {
        []
    }
    fn sin(self) -> Self {
        self.sin()
    }
    fn cos(self) -> Self {
        self.cos()
    }
}
