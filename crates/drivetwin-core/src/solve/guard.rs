// SPDX-License-Identifier: MIT
//! Guards: polynomials that must stay positive while a mode holds, and the earliest that falls.

use super::decide::{NEGLIGIBLE_ACCELERATION, NO_TORQUE, NOTHING, ROUND_OFF, sum_and_scale};
use super::first_fall::first_fall;
use super::formation::each;
use super::lanes::{Task, dispatch};
use super::regime::{Regime, RowState};
use crate::network::{Cell, GearState, Row};
use crate::number::{Lane, Number, Pack, Real, Series, TERMS, Values, evaluate, slope};

/// What happens when a guard falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The slip of a friction element, or the speed of a lossy gear, reaches zero.
    AtRest(Row),
    /// The normal load of an element sets in or is gone.
    Pressed(usize),
    /// The torque of a row at rest leaves its bounds; its sign.
    Overload(Row, f64),
    /// The same within round-off of a knot of the inputs, which may end there.
    OverloadAtKnot(Row),
    /// Power through a rolling gear changes its direction.
    PowerReversal(usize),
    /// A channel enters another cell.
    Border(usize, Cell),
    /// Events at one instant did not come to an end; everything is decided anew a moment later.
    Stalled,
}

impl Cause {
    /// The same, found to happen at a knot: what holds from there on decides.
    pub fn at_knot(self) -> Self {
        match self {
            Self::Overload(row, _) => Self::OverloadAtKnot(row),
            other => other,
        }
    }
}

/// The earliest fall within `h` [s], refined so that the time carries derivatives, and whether it
/// grazes.
pub fn earliest<T: Real>(regime: &Regime<'_, T>, h: f64) -> Option<(T, Cause, bool)> {
    let mut best: Option<(f64, Series<T>, Cause)> = None;
    all_guards(regime, &mut |series: Series<T>, cause: Cause| {
        let horizon = best.as_ref().map_or(h, |b| b.0);
        let (falls, t) = first_fall(&series, regime.expansion.order, (1, horizon));
        if falls == 1 && best.as_ref().is_none_or(|b| t < b.0) {
            best = Some((t, series, cause));
        }
    });
    best.map(|(t, series, cause)| {
        let order = regime.expansion.order;
        (refined(&series, order, t), cause, grazes(&series, order, (t, h)))
    })
}

/// The earliest falls of several runs, `runs` as bits, each within its own `h` [s].
pub fn earliest_of_each<const K: usize>(
    regime: &Regime<'_, Pack<K>>,
    (runs, h): (u32, Pack<K>),
) -> [Option<(f64, Cause)>; K] {
    let (mut causes, mut fallen, mut earliest) = ([None; K], 0, h);
    all_guards(regime, &mut |series: Series<Pack<K>>, cause: Cause| {
        let guard = (&series, regime.expansion.order);
        let (falls, t) = dispatch(FirstFall { guard, span: (runs, earliest) });
        let earlier = falls & (!fallen | (earliest - t).those(|left| left > 0.0));
        each(earlier).for_each(|run| causes[run] = Some(cause));
        earliest = earliest.with(earlier, t);
        fallen |= earlier;
    });
    std::array::from_fn(|run| causes[run].map(|cause| (earliest.0[run], cause)))
}

/// [`first_fall`], to be dispatched.
struct FirstFall<'s, const K: usize> {
    guard: (&'s Series<Pack<K>>, usize),
    span: (u32, Pack<K>),
}

impl<const K: usize> Task for FirstFall<'_, K> {
    type Output = (u32, Pack<K>);

    #[inline(always)]
    fn run<const F: bool>(self) -> Self::Output {
        first_fall(self.guard.0, self.guard.1, self.span)
    }
}

/// Hand on every guard with what its fall causes.
fn all_guards<T: Number>(regime: &Regime<'_, T>, consider: &mut impl FnMut(Series<T>, Cause)) {
    for j in 0..regime.rows.len() {
        friction_guards(regime, j, consider);
    }
    for i in 0..regime.gears.len() {
        gear_guards(regime, i, consider);
    }
    for (i, channel) in regime.network.channels.iter().enumerate() {
        let series = &regime.expansion.channels[i];
        for (border, next) in channel.borders(regime.cells[i], &regime.expansion.inputs, series) {
            consider(border, Cause::Border(i, next));
        }
    }
}

fn friction_guards<T: Number>(
    regime: &Regime<'_, T>,
    j: usize,
    consider: &mut impl FnMut(Series<T>, Cause),
) {
    let row = &regime.network.frictions[j];
    let normal = row.normal.series(&regime.expansion.inputs);
    let pressed = regime.pressed[j];
    let mut load = if pressed { normal } else { negative(normal) };
    if !pressed {
        load[0] += row.normal.nothing();
    }
    consider(load, Cause::Pressed(j));
    match regime.rows[j] {
        RowState::Open | RowState::Saturated { .. } => {}
        RowState::Slipping { sign } => {
            let slip = &regime.expansion.channels[j].arguments[0];
            let cause = Cause::AtRest(Row::Friction(j));
            consider(departing(slip, sign, regime.released[j]), cause);
        }
        RowState::Stuck => {
            let torque = holding_torque(regime, Row::Friction(j));
            let capacity = row.law.at(T::zero_()) * row.peak;
            let mut cap = scaled(&normal, if pressed { capacity } else { T::zero_() });
            cap[0] += balanced(regime) * NOTHING + if row.one_way { NO_TORQUE } else { 0.0 };
            consider(combined(&cap, &torque, 1.0), Cause::Overload(Row::Friction(j), -1.0));
            if !row.one_way {
                consider(combined(&cap, &torque, -1.0), Cause::Overload(Row::Friction(j), 1.0));
            }
        }
    }
}

fn gear_guards<T: Number>(
    regime: &Regime<'_, T>,
    i: usize,
    consider: &mut impl FnMut(Series<T>, Cause),
) {
    let gear = &regime.network.losses[i];
    if !gear.loss.is_directional() {
        return;
    }
    let torque =
        regime.expansion.form(regime.network, regime.mode.gear_torque(regime.network).row(i));
    match regime.gears[i] {
        GearState::Rolling { sign, backward } => {
            let mut power = scaled(&torque, T::of(sign));
            power[0] -= gear.loss.threshold();
            let mut power = if backward { scaled(&power, T::of(-1.0)) } else { power };
            power[0] += balanced(regime) * ROUND_OFF + without_direction(regime, i);
            consider(power, Cause::PowerReversal(i));
            if regime.blocked[i] {
                return;
            }
            let released = regime.released[regime.rows.len() + i];
            let speed = regime.expansion.speed_form(&gear.speed);
            consider(departing(&speed, sign, released), Cause::AtRest(Row::Gear(i)));
        }
        GearState::Held => {
            let loss = holding_torque(regime, Row::Gear(i));
            let bounds = gear.loss.bounds();
            let line = |(slope, drag): (T, T)| {
                let mut line = scaled(&torque, slope);
                line[0] += drag;
                line
            };
            let mut upper = larger(bounds.upper.map(line));
            let mut lower = scaled(&larger(bounds.lower.map(line).map(negative)), T::of(-1.0));
            upper[0] += NO_TORQUE;
            lower[0] -= NO_TORQUE;
            consider(combined(&upper, &loss, -1.0), Cause::Overload(Row::Gear(i), 1.0));
            consider(combined(&loss, &lower, -1.0), Cause::Overload(Row::Gear(i), -1.0));
        }
    }
}

/// The line that is the larger one now; where the other takes over the mode is decided anew.
fn larger<T: Number>([a, b]: [Series<T>; 2]) -> Series<T> {
    let [above, level] =
        [|a, b| a > b, |a, b| a == b].map(|say| a[0].re().decide_with(b[0].re(), say));
    let ahead = above || (level && a[1].re().decide_with(b[1].re(), |a, b| a >= b));
    if ahead { a } else { b }
}

fn holding_torque<T: Number>(regime: &Regime<'_, T>, row: Row) -> Series<T> {
    let position = regime.mode.stuck.iter().position(|&s| s == row);
    let position = position.expect("what is at rest belongs to the mode");
    regime.expansion.form(regime.network, regime.mode.stuck_torque.row(position))
}

/// Sum of the torques that elements at rest hold [N·m]: what they balance leaves round-off in others.
fn balanced<T: Number>(regime: &Regime<'_, T>) -> T {
    let held = regime.mode.stuck.iter().map(|&row| holding_torque(regime, row)[0].re());
    T::lifted(held.fold(T::Values::zero_(), |sum, torque| sum + torque.magnitude()))
}

/// Torque [N·m] through a rolling gear of which the direction is round-off.
fn without_direction<T: Number>(regime: &Regime<'_, T>, i: usize) -> T {
    let mut basis = Vec::new();
    regime.expansion.basis_at(regime.network, T::zero_(), &mut basis);
    let row = regime.mode.gear_torque(regime.network).row(i);
    T::lifted(sum_and_scale(row, &basis).1 * NOTHING + T::Values::of(NO_TORQUE))
}

/// Slip in its direction. What is released at this instant starts from exact zero, and where static
/// and kinetic capacities agree also from zero acceleration: what is left of these beside the next term, or
/// against its direction, is round-off and would look like an immediate return.
fn departing<T: Number>(slip: &Series<T>, sign: f64, released: bool) -> Series<T> {
    let mut guard = scaled(slip, T::of(sign));
    if released {
        guard[0] = T::zero_();
        let (rate, bend) = (guard[1].re(), guard[2].re().magnitude());
        let small = (rate.magnitude() - bend * 1e-9).those(|left| left <= 0.0);
        let against = rate.those(|rate| (-NEGLIGIBLE_ACCELERATION..0.0).contains(&rate));
        guard[1] = guard[1].with(small | against, T::zero_());
    }
    guard
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

/// Depth below zero, relative to the size of the guard, that counts as a mere touch.
const GRAZING: f64 = 1e-6;

/// Whether a guard falls so flatly that its parabola dips below zero by next to nothing: the event, and
/// with it everything after, then hangs on round-off and has no usable derivative.
fn grazes<T: Real>(guard: &Series<T>, order: usize, (t, h): (f64, f64)) -> bool {
    let g: Series<f64> = guard.map(|c| c.re());
    let (fall, mut bend, mut size, mut power) = (slope(&g, order, t), 0.0, 0.0, 1.0);
    for k in (2..=order).rev() {
        bend = bend * t + g[k] * (k * (k - 1)) as f64;
    }
    for c in &g[..=order] {
        size += c.abs() * power;
        power *= h;
    }
    t > 0.0 && bend > 0.0 && fall * fall < 2.0 * bend * GRAZING * size
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
