// SPDX-License-Identifier: MIT
//! Truncated Taylor series in time.

use super::Number;

/// Number of Taylor coefficients of a step, order 0 included.
pub const TERMS: usize = 15;

/// Taylor coefficients of a scalar in time, `value(t0 + h) = Σ c_k h^k`.
pub type Series<T> = [T; TERMS];

/// 1/k; at k = 0 zero.
pub const INVERSE: Series<f64> = {
    let (mut inverse, mut k) = ([0.0; TERMS], 1);
    while k < TERMS {
        inverse[k] = 1.0 / k as f64;
        k += 1;
    }
    inverse
};

/// Value of a series at `h` [s], by Horner's rule over its first `order + 1` coefficients.
#[inline(always)]
pub fn evaluate<T: Number>(series: &Series<T>, order: usize, h: T) -> T {
    let mut value = series[order];
    for k in (0..order).rev() {
        value = value * h + series[k];
    }
    value
}

/// Time derivative of a series at `h` [s].
#[inline(always)]
pub fn slope<T: Number>(series: &Series<T>, order: usize, h: T) -> T {
    let mut value = T::zero_();
    for k in (1..=order).rev() {
        value = value * h + series[k] * k as f64;
    }
    value
}

/// Coefficient `k` of the product of two series (Cauchy product).
#[inline(always)]
pub fn product_term<T: Number>(a: &Series<T>, b: &Series<T>, k: usize) -> T {
    let mut sum = T::zero_();
    for i in 0..=k {
        sum += a[i] * b[k - i];
    }
    sum
}
