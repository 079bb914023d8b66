// SPDX-License-Identifier: MIT
//! The number types the physics is written over: `f64` for values, [`Dual`] for derivatives, [`Pack`]
//! for several runs side by side.

mod dual;
mod lane;
mod pack;
mod series;

pub use dual::Dual;
pub use lane::{Factor, Lane, SMALL, Values};
pub use pack::Pack;
pub use series::{INVERSE, Series, TERMS, evaluate, product_term, slope};

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Sub, SubAssign};

/// A real number, with or without derivatives. Decisions are taken on [`Real::re`].
pub trait Real:
    Factor<Self, Values = f64>
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
    /// Derivatives by the parameters: an array.
    type Slopes: Copy + Debug + Send + Sync;

    /// Derivatives that are no numbers.
    const NO_SLOPES: Self::Slopes;

    /// A value without derivatives.
    fn of(value: f64) -> Self;

    /// Zero, without derivatives.
    fn zero_() -> Self {
        Self::of(0.0)
    }

    /// The value.
    fn re(&self) -> f64;

    /// Number zero with derivatives by the parameters.
    fn sloped(slopes: Self::Slopes) -> Self;

    /// Derivatives by the parameters.
    fn slopes(self) -> Self::Slopes;

    /// Whether it has no derivatives other than zero.
    fn is_constant(&self) -> bool;

    /// 1 / x.
    fn recip(self) -> Self;

    /// Square root.
    fn sqrt(self) -> Self;

    /// e^x.
    fn exp(self) -> Self;

    /// Sine, x in rad.
    fn sin(self) -> Self;

    /// Cosine, x in rad.
    fn cos(self) -> Self;
}

impl Real for f64 {
    type Slopes = [f64; 0];

    const NO_SLOPES: Self::Slopes = [];

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn re(&self) -> f64 {
        *self
    }
    #[inline(always)]
    fn sloped(_: Self::Slopes) -> Self {
        0.0
    }
    #[inline(always)]
    fn slopes(self) -> Self::Slopes {
        []
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
    fn sin(self) -> Self {
        self.sin()
    }
    fn cos(self) -> Self {
        self.cos()
    }
}
