// SPDX-License-Identifier: MIT
//! Guards: polynomials that must stay positive while a mode holds, and the earliest that falls.

use super::expansion::Expansion;
use super::first_fall::first_fall;
use super::integrator::RowState;
use crate::network::channel::Cell;
use crate::network::{Mode, Network};
use crate::number::{Real, Series, TERMS, evaluate, slope};

/// What happens when a guard falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The slip of a friction element reaches zero.
    SlipZero(usize),
    /// The pressure of an open element exceeds its fill pressure.
    Fill(usize),
    /// The normal load of an element is gone.
    Vent(usize),
    /// The holding torque of a stuck element exceeds its static capacity.
    Overload(usize),
    /// The torque through a lossy gear changes its sign.
    PowerReversal(usize),
    /// The speed of a lossy gear changes its sign.
    SpeedReversal(usize),
    /// A channel enters another cell.
    Border(usize, Cell),
}

/// The discrete state that guards depend on.
pub struct Watch<'a, T> {
    /// Network.
    pub network: &'a Network<T>,
    /// Active mode.
    pub mode: &'a Mode<T>,
    /// State of every friction element.
    pub rows: &'a [RowState],
    /// Whether an element slips from exact zero at the start of the step.
    pub released: &'a [bool],
    /// Active cell of every channel.
    pub cells: &'a [Cell],
    /// Sign of the driving side's speed of each lossy gear.
    pub gear_speed_sign: &'a [f64],
    /// Bit i: power flows backwards through lossy gear i.
    pub backward: u32,
}

/// The earliest fall within `h` [s], refined so that the time carries derivatives.
pub fn earliest<T: Real>(
    watch: &Watch<'_, T>,
    expansion: &Expansion<T>,
    h: f64,
) -> Option<(T, Cause)> {
    let mut best: Option<(f64, Series<T>, Cause)> = None;
    let mut consider = |series: Series<T>, cause: Cause| {
        let horizon = best.as_ref().map_or(h, |b| b.0);
        if let Some(t) = first_fall(&series, expansion.order, horizon)
            && best.as_ref().is_none_or(|b| t < b.0)
        {
            best = Some((t, series, cause));
        }
    };
    friction_guards(watch, expansion, &mut consider);
    gear_guards(watch, expansion, &mut consider);
    for (i, channel) in watch.network.channels.iter().enumerate() {
        let series = &expansion.channels[i];
        for (border, next) in channel.borders(watch.cells[i], &expansion.inputs, series) {
            consider(border, Cause::Border(i, next));
        }
    }
    best.map(|(t, series, cause)| (refined(&series, expansion.order, t), cause))
}

fn friction_guards<T: Real>(
    watch: &Watch<'_, T>,
    expansion: &Expansion<T>,
    consider: &mut impl FnMut(Series<T>, Cause),
) {
    for (j, row) in watch.network.frictions.iter().enumerate() {
        let normal = line(row.normal.line(&expansion.inputs), T::of(1.0));
        match watch.rows[j] {
            RowState::Open => {
                consider(line(row.normal.line(&expansion.inputs), T::of(-1.0)), Cause::Fill(j));
            }
            RowState::Slipping { sign } => {
                let slip = &expansion.channels[row.channel].speed;
                consider(departing(slip, sign, watch.released[j]), Cause::SlipZero(j));
                consider(normal, Cause::Vent(j));
            }
            RowState::Saturated { .. } => consider(normal, Cause::Vent(j)),
            RowState::Stuck => {
                let position = watch.mode.stuck.iter().position(|&s| s == j);
                let position = position.expect("a stuck element belongs to the mode");
                let row_of_torque = watch.mode.stuck_torque.row(position);
                let torque = expansion.form(watch.network, row_of_torque);
                let capacity = row.law.at(T::zero_()) * row.peak;
                let cap = line(row.normal.line(&expansion.inputs), capacity);
                consider(combined(&cap, &torque, -1.0), Cause::Overload(j));
                consider(combined(&cap, &torque, 1.0), Cause::Overload(j));
                consider(normal, Cause::Vent(j));
            }
        }
    }
}

fn gear_guards<T: Real>(
    watch: &Watch<'_, T>,
    expansion: &Expansion<T>,
    consider: &mut impl FnMut(Series<T>, Cause),
) {
    for (i, loss) in watch.network.losses.iter().enumerate() {
        if !watch.network.is_directional(i) {
            continue;
        }
        let speed_sign = watch.gear_speed_sign[i];
        let power_sign = if watch.backward >> i & 1 == 1 { -speed_sign } else { speed_sign };
        let torque = expansion.form(watch.network, watch.mode.gear_torque.row(i));
        consider(torque.map(|c| c * power_sign), Cause::PowerReversal(i));
        let speed = expansion.speed_form(&loss.speed);
        consider(speed.map(|c| c * speed_sign), Cause::SpeedReversal(i));
    }
}

/// Slip in its direction. An element released at this instant starts from exact zero, and where its
/// static and kinetic capacities agree also from zero acceleration: what is left of these is
/// round-off and would look like an immediate return.
fn departing<T: Real>(slip: &Series<T>, sign: f64, released: bool) -> Series<T> {
    let mut guard = slip.map(|c| c * sign);
    if released {
        guard[0] = T::zero_();
        if guard[1].re().abs() <= 1e-9 * guard[2].re().abs().max(1.0) {
            guard[1] = T::zero_();
        }
    }
    guard
}

fn line<T: Real>([value, rate]: [T; 2], factor: T) -> Series<T> {
    let mut series = [T::zero_(); TERMS];
    series[0] = value * factor;
    series[1] = rate * factor;
    series
}

fn combined<T: Real>(a: &Series<T>, b: &Series<T>, sign: f64) -> Series<T> {
    let mut out = *a;
    for (o, &c) in out.iter_mut().zip(b) {
        *o += c * sign;
    }
    out
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
