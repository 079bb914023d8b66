// SPDX-License-Identifier: MIT
//! The number type the physics is written over: `f64` for values, dual numbers for derivatives.

use num_dual::DualNum;

/// A real number or a dual number over `f64`.
pub trait Real: DualNum<Primitive = f64> + Copy + Send + Sync {
    /// Zero, with zero derivatives.
    fn zero_() -> Self {
        Self::from(0.0)
    }

    /// A value without derivatives.
    fn of(value: f64) -> Self {
        Self::from(value)
    }
}

impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Real for T {}

/// Number of Taylor coefficients of a step, order 0 included.
pub const TERMS: usize = 15;

/// Taylor coefficients of a scalar in time, `value(t0 + h) = Σ c_k h^k`.
pub type Series<T> = [T; TERMS];

/// Value of a series at `h` [s], by Horner's rule over its first `order + 1` coefficients.
pub fn evaluate<T: Real>(series: &Series<T>, order: usize, h: T) -> T {
    let mut value = series[order];
    for k in (0..order).rev() {
        value = value * h + series[k];
    }
    value
}

/// Time derivative of a series at `h` [s].
pub fn slope<T: Real>(series: &Series<T>, order: usize, h: T) -> T {
    let mut value = T::zero_();
    for k in (1..=order).rev() {
        value = value * h + series[k] * k as f64;
    }
    value
}

/// Coefficient `k` of the product of two series (Cauchy product).
pub fn product_term<T: Real>(a: &Series<T>, b: &Series<T>, k: usize) -> T {
    let mut sum = T::zero_();
    for i in 0..=k {
        sum += a[i] * b[k - i];
    }
    sum
}
