// SPDX-License-Identifier: MIT
//! The first instant at which a guard polynomial falls below zero.

use crate::number::{Real, Series, TERMS, Values, evaluate, slope};

/// Coefficients with the real parts of a guard, for the search.
type Polynomial = [f64; TERMS];

/// First time in [0, h] from which the guard `Σ c_k t^k` is negative, or `None`.
///
/// A guard that starts at zero (to round-off) and rises is left alone until it falls again, which is
/// how an element that has just changed its mode starts. Excursions inside the step are found too:
/// the search rests on bounds of the polynomial, not on samples.
pub fn first_fall<T: Real>(guard: &Series<T>, order: usize, h: f64) -> Option<f64> {
    let mut reach = 0.0;
    let mut power = 1.0;
    for c in &guard[1..=order] {
        power *= h;
        reach += c.re().abs() * power;
    }
    let start = guard[0].re();
    if start > reach {
        return None;
    }
    let mut c: Polynomial = [0.0; TERMS];
    for (target, source) in c.iter_mut().zip(&guard[..=order]) {
        *target = source.re();
    }
    let negligible = 1e-13 * (start.abs() + reach);
    let mut order = order;
    if start <= negligible {
        let leading = (1..=order).find(|&k| c[k].abs() * h.powi(k as i32) > negligible)?;
        if c[leading] < 0.0 {
            return Some(0.0);
        }
        c.copy_within(leading..=order, 0);
        order -= leading;
    }
    search(&c, order, 0.0, h, 0)
}

/// Runs whose guard stays positive over [0, h] as its coefficients tell at once, as bits.
pub fn stay_positive<V: Values>(guard: &Series<V>, order: usize, h: V) -> u32 {
    let (mut reach, mut power) = (V::zero_(), V::of(1.0));
    for &c in &guard[1..=order] {
        power *= h;
        reach += c.magnitude() * power;
    }
    (guard[0] - reach).those(|left| left > 0.0)
}

/// First root of a polynomial that is positive at `from`.
fn search(c: &Polynomial, order: usize, from: f64, to: f64, depth: usize) -> Option<f64> {
    let (middle, radius) = (0.5 * (from + to), 0.5 * (to - from));
    let d = shifted(c, order, middle);
    let mut swing = 0.0;
    let mut bend = 0.0;
    for k in (1..=order).rev() {
        swing = (swing + d[k].abs()) * radius;
        if k > 1 {
            bend = bend * radius + d[k].abs() * k as f64;
        }
    }
    if d[0] > swing {
        return None;
    }
    if order >= 1 && -d[1] > bend * radius {
        return (evaluate(c, order, to) < 0.0).then(|| bisect(c, order, from, to));
    }
    if depth == 50 || middle <= from || middle >= to {
        return (evaluate(c, order, to) < 0.0).then_some(from);
    }
    search(c, order, from, middle, depth + 1).or_else(|| {
        if evaluate(c, order, middle) < 0.0 {
            Some(middle)
        } else {
            search(c, order, middle, to, depth + 1)
        }
    })
}

/// Root of a polynomial that falls through zero once in the bracket: Newton kept inside it.
fn bisect(c: &Polynomial, order: usize, mut from: f64, mut to: f64) -> f64 {
    let mut t = 0.5 * (from + to);
    for _ in 0..100 {
        let value = evaluate(c, order, t);
        if value == 0.0 {
            return t;
        }
        if value > 0.0 {
            from = t
        } else {
            to = t
        }
        let newton = t - value / slope(c, order, t);
        let next = if newton > from && newton < to { newton } else { 0.5 * (from + to) };
        if next == t || to - from <= f64::EPSILON * to.abs() {
            return next;
        }
        t = next;
    }
    t
}

/// Coefficients about `at` instead of 0 (Taylor shift by repeated synthetic division).
fn shifted(c: &Polynomial, order: usize, at: f64) -> Polynomial {
    let mut d = *c;
    for i in 0..order {
        for k in (i..order).rev() {
            d[k] += at * d[k + 1];
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fall(coefficients: &[f64], h: f64) -> Option<f64> {
        let mut series = [0.0; TERMS];
        series[..coefficients.len()].copy_from_slice(coefficients);
        first_fall(&series, coefficients.len() - 1, h)
    }

    #[test]
    fn finds_a_simple_root() {
        let t = fall(&[1.0, -2.0], 1.0).unwrap();
        assert!((t - 0.5).abs() < 1e-15);
    }

    #[test]
    fn finds_an_excursion_that_ends_inside_the_step() {
        // (t - 0.5)² - 0.01: negative between 0.4 and 0.6 only
        let t = fall(&[0.24, -1.0, 1.0], 1.0).unwrap();
        assert!((t - 0.4).abs() < 1e-14);
    }

    #[test]
    fn a_touch_from_above_is_no_fall() {
        assert_eq!(fall(&[0.25 + 1e-9, -1.0, 1.0], 1.0), None);
    }

    #[test]
    fn a_guard_that_leaves_zero_upwards_is_left_alone_until_it_falls() {
        assert_eq!(fall(&[0.0, 1.0], 1.0), None);
        let t = fall(&[0.0, 1.0, -2.0], 1.0).unwrap();
        assert!((t - 0.5).abs() < 1e-14);
    }

    #[test]
    fn a_guard_that_leaves_zero_downwards_falls_at_once() {
        assert_eq!(fall(&[0.0, -1.0], 1.0), Some(0.0));
        assert_eq!(fall(&[0.0, 0.0, -1.0], 1.0), Some(0.0));
    }

    #[test]
    fn a_guard_that_is_zero_throughout_never_falls() {
        assert_eq!(fall(&[0.0, 0.0, 0.0], 1.0), None);
    }
}
