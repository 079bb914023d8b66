// SPDX-License-Identifier: MIT
//! The first instant at which a guard polynomial falls below zero.

use crate::number::{KernelFloat, Number, Series, Values, evaluate, slope};
use crate::solver::tolerances::GUARD_RTOL;

/// Largest number of bisections of a step.
const MAX_DEPTH: usize = 50;

/// First times in [0, h] from which the guards `Σ c_k t^k` of the runs `runs`, as bits, are negative, with the
/// runs for which there is one.
///
/// A guard that starts at zero (to round-off) and rises is left alone until it falls again, which is
/// how an element that has just changed its mode starts. Excursions inside the step are found too:
/// the search rests on bounds of the polynomial, not on samples.
#[inline(always)]
pub fn first_zero_crossing<T: Number>(
    guard: &Series<T>,
    order: usize,
    mut runs: u32,
    h: T::Values,
) -> (u32, T::Values) {
    let none = T::Values::zero_();
    let (mut reach, mut power) = (none, T::Values::of(1.0));
    for c in &guard[1..=order] {
        power *= h;
        reach += c.re().magnitude() * power;
    }
    let start = guard[0].re();
    runs &= !(start - reach).mask_where(|left| left > 0.0);
    if runs == 0 {
        return (0, none);
    }
    let mut c = guard.map(|c| c.re());
    let negligible = (start.magnitude() + reach) * GUARD_RTOL;
    let at_zero = runs & !(start - negligible).mask_where(|above| above > 0.0);
    let mut at_once = 0;
    if at_zero != 0 {
        let (falling, rising) = lift_off(&mut c, order, at_zero, h, negligible);
        (at_once, runs) = (falling, runs & !at_zero | rising);
    }
    let (fallen, time) = search(&c, order, runs, h);
    (fallen | at_once, time.replace_where(at_once, none))
}

/// Classify the guards of the runs `at_zero`, as bits, which start at zero. Terms `negligible` within `h`
/// [s] are ignored. Returns the runs that fall and the runs that rise. The polynomial of a rising guard is
/// divided by its leading power of time in place. The other guards rest.
#[inline(always)]
fn lift_off<V: Values>(
    c: &mut Series<V>,
    order: usize,
    at_zero: u32,
    h: V,
    negligible: V,
) -> (u32, u32) {
    let (mut falling, mut rising, mut power) = (0, 0, V::of(1.0));
    for k in 1..=order {
        power *= h;
        let counts = (c[k].magnitude() * power - negligible).mask_where(|size| size > 0.0);
        let begin = at_zero & counts & !falling & !rising;
        let below = begin & c[k].mask_where(|leading| leading < 0.0);
        let above = begin & !below;
        if above != 0 {
            for i in 0..=order {
                let later = if i + k <= order { c[i + k] } else { V::zero_() };
                c[i] = c[i].replace_where(above, later);
            }
        }
        falling |= below;
        rising |= above;
        if at_zero & !falling & !rising == 0 {
            break;
        }
    }
    (falling, rising)
}

/// First roots within [0, h] of the polynomials of some runs, as bits, that are positive at the start.
#[inline(always)]
fn search<V: Values>(c: &Series<V>, order: usize, runs: u32, h: V) -> (u32, V) {
    let (fallen, time, unclear) = within(c, order, runs, V::zero_(), h, V::zero_());
    if unclear == 0 {
        return (fallen, time);
    }
    let (late, at) = in_halves(c, order, unclear, h);
    (fallen | late, time.replace_where(late, at))
}

/// Runs of `runs` whose guards fall once within their spans, with their times, and runs for which the
/// bounds of the polynomial are inconclusive. Guards of the other runs do not fall there, or are
/// `negligible` throughout.
#[inline(always)]
fn within<V: Values>(
    c: &Series<V>,
    order: usize,
    runs: u32,
    from: V,
    to: V,
    negligible: V,
) -> (u32, V, u32) {
    let (middle, radius) = ((from + to) * 0.5, (to - from) * 0.5);
    let d = shifted(c, order, middle);
    let (mut swing, mut bend) = (V::zero_(), V::zero_());
    for k in (1..=order).rev() {
        swing = (swing + d[k].magnitude()) * radius;
        if k > 1 {
            bend = bend * radius + d[k].magnitude() * k as f64;
        }
    }
    let positive = (d[0] - swing).mask_where(|left| left > 0.0);
    let counts = (d[0].magnitude() + swing - negligible).mask_where(|size| size > 0.0);
    let open = runs & !positive & counts;
    if open == 0 {
        return (0, to, 0);
    }
    let falling = open & (-d[1] - bend * radius).mask_where(|fall| fall > 0.0);
    let fallen = falling & below_zero(c, order, to);
    let time = if fallen == 0 { to } else { root(c, order, fallen, from, to) };
    (fallen, time, open & !falling)
}

/// [`search`] in halves of [0, h], halves of these and so on, from left to right.
///
/// About a root of several fold there is nothing but round-off in a span of 1e-13^(1 / fold) of the step: it is
/// passed over, as the search in all its halves would not end.
#[cold]
#[inline(never)]
fn in_halves<V: Values>(c: &Series<V>, order: usize, runs: u32, h: V) -> (u32, V) {
    let size = (0..=order).rev().fold(V::zero_(), |size, k| size * h + c[k].magnitude());
    let (mut fallen, mut time) = (0, h);
    let mut unclear = [runs; MAX_DEPTH];
    // The span in hand is part `part` of 2^depth.
    let (mut part, mut depth) = (0_u64, 1);
    while depth > 0 {
        let [from, to] = [part, part + 1].map(|end| h * (end as f64 / (1_u64 << depth) as f64));
        let runs = unclear[depth - 1] & !fallen;
        let (mut falls, mut at, still) = within(c, order, runs, from, to, size * GUARD_RTOL);
        if still != 0 && depth < MAX_DEPTH {
            unclear[depth] = still;
            (part, depth) = (2 * part, depth + 1);
        } else {
            let at_last = still & below_zero(c, order, to);
            (falls, at) = (falls | at_last, at.replace_where(at_last, from));
            while part % 2 == 1 {
                (part, depth) = (part / 2, depth - 1);
            }
            part += 1;
        }
        (fallen, time) = (fallen | falls, time.replace_where(falls, at));
    }
    (fallen, time)
}

/// The runs, as bits, whose polynomials are negative at `t`.
#[inline(always)]
fn below_zero<V: Values>(c: &Series<V>, order: usize, t: V) -> u32 {
    evaluate(c, order, t).mask_where(|value| value < 0.0)
}

/// Roots of polynomials that fall through zero once in their brackets: Newton kept inside them.
#[inline(always)]
fn root<V: Values>(c: &Series<V>, order: usize, mut runs: u32, mut from: V, mut to: V) -> V {
    let mut t = (from + to) * 0.5;
    for _ in 0..100 {
        let value = evaluate(c, order, t);
        runs &= !value.mask_where(|value| value == 0.0);
        let above = value.mask_where(|value| value > 0.0);
        from = from.replace_where(runs & above, t);
        to = to.replace_where(runs & !above, t);
        let newton = t - value / slope(c, order, t);
        let inside =
            (newton - from).mask_where(|left| left > 0.0) & (to - newton).mask_where(|l| l > 0.0);
        let next = ((from + to) * 0.5).replace_where(inside, newton);
        let narrow = (to - from - to.magnitude() * f64::EPSILON).mask_where(|left| left <= 0.0);
        let done = (next - t).mask_where(|step| step == 0.0) | narrow;
        t = t.replace_where(runs, next);
        runs &= !done;
        if runs == 0 {
            break;
        }
    }
    t
}

/// Coefficients about `at` instead of 0 (Taylor shift by repeated synthetic division).
#[inline(always)]
fn shifted<V: Values>(c: &Series<V>, order: usize, at: V) -> Series<V> {
    let mut d = *c;
    for i in 0..order {
        for k in (i..order).rev() {
            let higher = d[k + 1];
            d[k] += at * higher;
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::{SimdVector, TERMS};
    use proptest::prelude::*;

    fn fall(coefficients: &[f64], h: f64) -> Option<f64> {
        let mut series = [0.0; TERMS];
        series[..coefficients.len()].copy_from_slice(coefficients);
        let (fallen, time) = first_zero_crossing(&series, coefficients.len() - 1, 1, h);
        (fallen == 1).then_some(time)
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

    #[test]
    fn roots_of_several_fold_end_the_search() {
        // (0.3 - t)^n: round-off near 0.3 makes touches look like falls, and one root like several
        for (fold, c) in [
            (2, [0.09, -0.6, 1.0, 0.0, 0.0, 0.0]),
            (3, [0.027, -0.27, 0.9, -1.0, 0.0, 0.0]),
            (4, [0.0081, -0.108, 0.54, -1.2, 1.0, 0.0]),
            (5, [0.00243, -0.0405, 0.27, -0.9, 1.5, -1.0]),
        ] {
            let falls = u32::from(fold % 2 == 1);
            let guard =
                std::array::from_fn(|k| SimdVector::<8>::of(c.get(k).copied().unwrap_or(0.0)));
            let (fallen, time) = first_zero_crossing(&guard, 5, 255, SimdVector::of(1.0));
            assert_eq!(fallen, 255 * falls, "{fold}");
            let width = 2.0 * GUARD_RTOL.powf(1.0 / f64::from(fold));
            assert!(falls == 0 || (time.run_value(7) - 0.3).abs() < width, "{fold}: {time:?}");
        }
    }

    /// Guards of several runs, some of which start at zero: small whole coefficients, so that roots fall
    /// together and leading ones vanish.
    fn guards() -> impl Strategy<Value = Series<SimdVector<8>>> {
        let coefficients = prop::collection::vec(-4_i8..=4, 8 * 6);
        coefficients.prop_map(|c| {
            std::array::from_fn(|k| {
                SimdVector::from_lanes(|run| c.get(k * 8 + run).map_or(0.0, |&c| f64::from(c)))
            })
        })
    }

    proptest! {
        #[test]
        fn runs_side_by_side_fall_as_each_alone(guards in guards(), runs in 0_u32..256, h in 0.1..4.0) {
            let (fallen, time) = first_zero_crossing(&guards, 5, runs, SimdVector::of(h));
            prop_assert_eq!(fallen & !runs, 0);
            for run in (0..8).filter(|run| runs >> run & 1 == 1) {
                let (falls, at) = first_zero_crossing(&guards.map(|c| c.run_value(run)), 5, 1, h);
                prop_assert_eq!(falls, fallen >> run & 1);
                prop_assert!(falls == 0 || at.to_bits() == time.run_value(run).to_bits());
            }
        }

        #[test]
        fn no_guard_is_negative_before_it_falls(guards in guards(), h in 0.1..4.0) {
            let guard = guards.map(|c| c.run_value(0));
            prop_assume!(guard[0] >= 0.0);
            let value = |t: f64| evaluate(&guard, 5, t);
            let (falls, at) = first_zero_crossing(&guard, 5, 1, h);
            let until = if falls == 1 { at } else { h };
            for part in 1..100 {
                prop_assert!(value(until * f64::from(part) / 100.0) > -1e-9);
            }
        }
    }
}
