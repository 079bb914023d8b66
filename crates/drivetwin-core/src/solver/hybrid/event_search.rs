// SPDX-License-Identifier: MIT
//! Guards: polynomials that must stay positive while a mode holds, and the earliest that falls.

use crate::network::{GearState, RowId};
use crate::number::{
    KernelFloat, Number, Real, Series, SimdVector, TERMS, Values, evaluate, slope,
};
use crate::solver::hybrid::event::{EventCause, FrictionState};
use crate::solver::hybrid::state::HybridState;
use crate::solver::hybrid::zero_crossing::first_zero_crossing;
use crate::solver::lane_mask::lanes_in;
use crate::solver::simd::{Kernel, dispatch_simd};
use crate::solver::tolerances::{
    ACCELERATION_ATOL, BOUND_RTOL, FORCED_SLIP_RTOL, GRAZING_RTOL, RELEASE_RATE_RTOL,
    RELEASE_SUM_RTOL, SUM_RTOL, TAYLOR_TOL, TORQUE_ATOL, sum_and_scale,
};

/// The earliest fall within `h` [s], refined so that the time carries derivatives, and whether it
/// grazes.
pub fn earliest<T: Real>(state: &HybridState<'_, T>, h: f64) -> Option<(T, EventCause, bool)> {
    let mut best: Option<(f64, Series<T>, EventCause)> = None;
    all_guards(state, h, &mut |series: Series<T>, cause: EventCause| {
        let horizon = best.as_ref().map_or(h, |b| b.0);
        let (falls, t) = first_zero_crossing(&series, state.expansion.order, 1, horizon);
        if falls == 1 && best.as_ref().is_none_or(|b| t < b.0) {
            best = Some((t, series, cause));
        }
    });
    best.map(|(t, series, cause)| {
        let order = state.expansion.order;
        (refined(&series, order, t), cause, grazes(&series, order, t, h))
    })
}

/// The earliest falls of several runs, `runs` as bits, each within its own `h` [s].
pub fn earliest_per_lane<const K: usize>(
    state: &HybridState<'_, SimdVector<K>>,
    runs: u32,
    h: SimdVector<K>,
) -> [Option<(f64, EventCause)>; K] {
    let (mut causes, mut fallen, mut earliest) = ([None; K], 0, h);
    all_guards(state, h, &mut |series: Series<SimdVector<K>>, cause: EventCause| {
        let order = state.expansion.order;
        let kernel = ZeroCrossingKernel { series: &series, order, runs, horizon: earliest };
        let (falls, t) = dispatch_simd(kernel);
        let earlier = falls & (!fallen | (earliest - t).mask_where(|left| left > 0.0));
        lanes_in(earlier).for_each(|run| causes[run] = Some(cause));
        earliest = earliest.replace_where(earlier, t);
        fallen |= earlier;
    });
    std::array::from_fn(|run| causes[run].map(|cause| (earliest.0[run], cause)))
}

/// [`first_zero_crossing`], to be dispatched.
struct ZeroCrossingKernel<'s, const K: usize> {
    series: &'s Series<SimdVector<K>>,
    order: usize,
    runs: u32,
    horizon: SimdVector<K>,
}

impl<const K: usize> Kernel for ZeroCrossingKernel<'_, K> {
    type Output = (u32, SimdVector<K>);

    #[inline(always)]
    fn run<const F: bool>(self) -> Self::Output {
        first_zero_crossing(self.series, self.order, self.runs, self.horizon)
    }
}

/// Hand on every guard within `h` [s] with what its fall causes.
fn all_guards<T: Number>(
    state: &HybridState<'_, T>,
    h: T::Values,
    consider: &mut impl FnMut(Series<T>, EventCause),
) {
    for j in 0..state.rows.len() {
        friction_guards(state, j, consider);
    }
    for i in 0..state.gears.len() {
        gear_guards(state, i, consider);
    }
    for (i, channel) in state.network.channels.iter().enumerate() {
        let series = &state.expansion.channels[i];
        let branch = state.branches[i];
        let borders = channel.boundaries(branch, &state.expansion.inputs, series);
        for (place, (mut border, next)) in borders.into_iter().enumerate() {
            if let Some([twist, rate]) = channel.border_weights(branch, place) {
                let error =
                    argument_error(state, i, 0) * twist + argument_error(state, i, 1) * rate;
                ignore_unresolved(&mut border, state.expansion.order, h, error);
            }
            consider(border, EventCause::BranchBoundary(i, next));
        }
    }
}

/// Truncation error of an argument of a channel over a step, to which every term may contribute.
fn argument_error<T: Number>(state: &HybridState<'_, T>, channel: usize, i: usize) -> T::Values {
    let terms = state.network.channels[channel].arguments[i].iter().zip(&state.expansion.scales);
    let sum = |sum, (c, scale): (&T, &T)| sum + c.re().magnitude() / scale.re();
    terms.fold(T::Values::zero_(), sum) * TAYLOR_TOL * (state.expansion.order + 1) as f64
}

/// Lift a guard that stays within the truncation `error` for all of `h` [s]. A damped coupling without a gap
/// would cross the borders of such a motion without end.
fn ignore_unresolved<T: Number>(
    guard: &mut Series<T>,
    order: usize,
    h: T::Values,
    error: T::Values,
) {
    let size = guard[..=order].iter().rev();
    let size = size.fold(T::Values::zero_(), |sum, c| sum * h + c.re().magnitude());
    let unresolved = (size - error).mask_where(|excess| excess <= 0.0);
    guard[0] = guard[0].replace_where(unresolved, T::promote(size + size));
}

fn friction_guards<T: Number>(
    state: &HybridState<'_, T>,
    j: usize,
    consider: &mut impl FnMut(Series<T>, EventCause),
) {
    let row = &state.network.frictions[j];
    let normal = row.normal.series(&state.expansion.inputs);
    let pressed = state.pressed[j];
    let mut load = if pressed { normal } else { negative(normal) };
    if !pressed {
        load[0] += row.normal.load_tolerance();
    }
    consider(load, EventCause::LoadOnset(j));
    match state.rows[j] {
        FrictionState::Open | FrictionState::Saturated { .. } => {}
        FrictionState::Slipping { sign } => {
            let slip = &state.expansion.channels[j].arguments[0];
            let row = RowId::Friction(j);
            let released = state.released[j].then(|| rate_size(state, row));
            consider(departing(slip, sign, released), EventCause::SlipZero(row));
        }
        FrictionState::Sticking => {
            forced_guards(state, RowId::Friction(j), consider);
            let torque = holding_torque(state, RowId::Friction(j));
            let capacity = row.law.at(T::zero_()) * row.peak;
            let mut cap = scaled(&normal, if pressed { capacity } else { T::zero_() });
            cap[0] += balanced(state) * BOUND_RTOL + if row.one_way { TORQUE_ATOL } else { 0.0 };
            consider(
                combined(&cap, &torque, 1.0),
                EventCause::TorqueLimit(RowId::Friction(j), -1.0),
            );
            if !row.one_way {
                consider(
                    combined(&cap, &torque, -1.0),
                    EventCause::TorqueLimit(RowId::Friction(j), 1.0),
                );
            }
        }
    }
}

fn gear_guards<T: Number>(
    state: &HybridState<'_, T>,
    i: usize,
    consider: &mut impl FnMut(Series<T>, EventCause),
) {
    let gear = &state.network.losses[i];
    if !gear.loss.is_directional() {
        return;
    }
    let torque = state.expansion.form(state.network, state.mode.gear_torque(state.network).row(i));
    match state.gears[i] {
        GearState::Meshing { sign, power_reversed } => {
            let mut power = scaled(&torque, T::of(sign));
            power[0] -= gear.loss.threshold();
            let mut power = if power_reversed { scaled(&power, T::of(-1.0)) } else { power };
            power[0] += balanced(state) * SUM_RTOL + direction_tolerance(state, i);
            consider(power, EventCause::PowerReversal(i));
            if state.blocked[i] {
                return;
            }
            let row = RowId::Gear(i);
            let released = state.released[state.index_of(row)].then(|| rate_size(state, row));
            let speed = state.expansion.speed_form(&gear.speed);
            consider(departing(&speed, sign, released), EventCause::SlipZero(row));
        }
        GearState::Locked => {
            forced_guards(state, RowId::Gear(i), consider);
            let loss = holding_torque(state, RowId::Gear(i));
            let bounds = gear.loss.bounds();
            let line = |(slope, drag): (T, T)| {
                let mut line = scaled(&torque, slope);
                line[0] += drag;
                line
            };
            let mut upper = larger(bounds.upper.map(line));
            let mut lower = scaled(&larger(bounds.lower.map(line).map(negative)), T::of(-1.0));
            upper[0] += TORQUE_ATOL;
            lower[0] -= TORQUE_ATOL;
            consider(combined(&upper, &loss, -1.0), EventCause::TorqueLimit(RowId::Gear(i), 1.0));
            consider(combined(&loss, &lower, -1.0), EventCause::TorqueLimit(RowId::Gear(i), -1.0));
        }
    }
}

/// Prescribed speeds can force a row at rest to move; nothing else can.
fn forced_guards<T: Number>(
    state: &HybridState<'_, T>,
    row: RowId,
    consider: &mut impl FnMut(Series<T>, EventCause),
) {
    if state.network.prescribed.is_empty() {
        return;
    }
    let speeds = state.network.slip_of(row);
    let slip = state.expansion.speed_form(speeds);
    let terms = speeds.iter().zip(&state.x).map(|(c, v)| (c.re() * v.re()).magnitude());
    let scale = terms.fold(T::Values::of(1.0), |largest, term| term.larger(largest));
    for sign in [1.0, -1.0] {
        let mut room = scaled(&slip, T::of(-sign));
        room[0] += T::promote(scale * FORCED_SLIP_RTOL);
        consider(room, EventCause::TorqueLimit(row, sign));
    }
}

/// The line that is the larger one now; where the other takes over the mode is decided anew.
fn larger<T: Number>([a, b]: [Series<T>; 2]) -> Series<T> {
    let [above, level] =
        [|a, b| a > b, |a, b| a == b].map(|say| a[0].re().decide_with(b[0].re(), say));
    let ahead = above || (level && a[1].re().decide_with(b[1].re(), |a, b| a >= b));
    if ahead { a } else { b }
}

fn holding_torque<T: Number>(state: &HybridState<'_, T>, row: RowId) -> Series<T> {
    let torque = state.mode.holding_torque(row);
    torque.map_or([T::zero_(); TERMS], |row| state.expansion.form(state.network, row))
}

/// Sum of the torques that elements at rest hold [N·m]: what they balance leaves round-off in others.
fn balanced<T: Number>(state: &HybridState<'_, T>) -> T {
    let held = state.mode.stuck.iter().map(|&row| holding_torque(state, row)[0].re());
    T::promote(held.fold(T::Values::zero_(), |sum, torque| sum + torque.magnitude()))
}

/// Torque [N·m] through a rolling gear below which its direction is round-off.
fn direction_tolerance<T: Number>(state: &HybridState<'_, T>, i: usize) -> T {
    let mut basis = Vec::new();
    state.expansion.basis_at(state.network, T::zero_(), &mut basis);
    let row = state.mode.gear_torque(state.network).row(i);
    T::promote(sum_and_scale(row, &basis).1 * BOUND_RTOL + T::Values::of(TORQUE_ATOL))
}

/// Slip in its direction. What is released at this instant starts from exact zero, and where static
/// and kinetic capacities agree also from zero acceleration: what is left of these beside the next term, or
/// against its direction, is round-off and would look like an immediate return. `released` is then the size of
/// the terms that its rate is the sum of: between light members a rate is small beside the next term, but no
/// round-off.
fn departing<T: Number>(slip: &Series<T>, sign: f64, released: Option<T::Values>) -> Series<T> {
    let mut guard = scaled(slip, T::of(sign));
    if let Some(terms) = released {
        guard[0] = T::zero_();
        let (rate, bend) = (guard[1].re(), guard[2].re().magnitude());
        let least = (bend * RELEASE_RATE_RTOL).smaller(terms * RELEASE_SUM_RTOL);
        let small = (rate.magnitude() - least).mask_where(|left| left <= 0.0);
        let against = rate.mask_where(|rate| (-ACCELERATION_ATOL..0.0).contains(&rate));
        guard[1] = guard[1].replace_where(small | against, T::zero_());
    }
    guard
}

/// Sum of the magnitudes of the terms that the slip rate of a row is the sum of, rad/s².
fn rate_size<T: Number>(state: &HybridState<'_, T>, row: RowId) -> T::Values {
    let mut basis = Vec::new();
    state.expansion.basis_at(state.network, T::zero_(), &mut basis);
    state.acceleration(row, &state.mode, &basis).1
}

fn negative<T: Number>(series: Series<T>) -> Series<T> {
    scaled(&series, T::of(-1.0))
}

fn scaled<T: Number>(series: &Series<T>, factor: T) -> Series<T> {
    series.map(|c| c * factor)
}

fn combined<T: Number>(a: &Series<T>, b: &Series<T>, sign: f64) -> Series<T> {
    let mut out = [T::zero_(); TERMS];
    for (o, (&a, &b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *o = a + b * sign;
    }
    out
}

/// True if a guard grazes zero: its parabola dips below zero by less than [`GRAZING_RTOL`] of its size. The
/// event and the motion after it then depend on round-off and have no usable derivative.
fn grazes<T: Real>(guard: &Series<T>, order: usize, t: f64, h: f64) -> bool {
    let g: Series<f64> = guard.map(|c| c.re());
    let (fall, mut bend, mut size, mut power) = (slope(&g, order, t), 0.0, 0.0, 1.0);
    for k in (2..=order).rev() {
        bend = bend * t + g[k] * (k * (k - 1)) as f64;
    }
    for c in &g[..=order] {
        size += c.abs() * power;
        power *= h;
    }
    t > 0.0 && bend > 0.0 && fall * fall < 2.0 * bend * GRAZING_RTOL * size
}

/// One Newton step over the number type: the time of the event then carries its derivatives,
/// dt = -g_p / g_t.
fn refined<T: Real>(guard: &Series<T>, order: usize, t: f64) -> T {
    let at = T::of(t);
    let rate = slope(guard, order, at);
    if t == 0.0 || rate.re() == 0.0 {
        return at;
    }
    let correction = evaluate(guard, order, at) / rate;
    let correction = correction - correction.re();
    at - correction
}
