// SPDX-License-Identifier: MIT
//! Scalar torques that are not linear in the state, as Taylor recurrences in time.
//!
//! Within a branch (a direction of slip, a piece of a table) each is analytic; the solver searches for
//! crossings of the branch's boundaries.

use super::branch::{
    Branch, BranchBoundary, add_weighted, between, loss_boundaries, scaled, slip_boundaries,
};
use super::linalg::is_zero;
use crate::model::converter_map::ConverterMap;
use crate::model::friction::{Decay, FrictionLaw};
use crate::model::mechanism::{Normal, Region, TwistForm};
use crate::model::torque_map::{TorqueMap, span_index};
use crate::number::{Number, Series, TERMS, Values, product_term};

/// A law over one or two linear forms of the state, and the inputs.
#[derive(Clone, Debug)]
pub enum TorqueLaw<T> {
    /// Friction torque over the slip.
    Friction {
        /// μ over |slip|.
        mu: FrictionLaw<T>,
        /// Factor of μ.
        normal: Normal<T>,
        /// Static over kinetic capacity.
        peak: T,
    },
    /// `coefficient · ω|ω|`.
    Quadratic(T),
    /// Map over throttle and speed.
    Map {
        /// Index of the throttle input.
        input: usize,
        /// The map.
        map: TorqueMap,
    },
    /// Torque converter over pump and turbine speed.
    Converter {
        /// The map.
        map: ConverterMap,
        /// Torque given at the turbine, else taken at the pump.
        at_turbine: bool,
    },
    /// Tyre over the difference of speeds and the speed of the road.
    Slip {
        /// Torque over slip, N·m.
        stiffness: T,
        /// Least speed of the road that a slip is related to, rad/s.
        least_speed: f64,
    },
    /// Loss torque over the slip and the torque through a gear, see [`Network::table_losses`].
    ///
    /// [`Network::table_losses`]: crate::network::Network::table_losses
    Loss {
        /// Loss torque over transmitted torque, in place of a throttle, and slip from zero on.
        map: TorqueMap,
        /// True if it depends on the torque through a gear, the second argument.
        coupled: bool,
    },
    /// Piecewise linear compliance over twist and its rate.
    Regions(Vec<Region<T>>),
}

/// A channel: its law and its arguments over the states.
#[derive(Clone, Debug)]
pub struct NonlinearTorque<T> {
    /// Law.
    pub law: TorqueLaw<T>,
    /// One or two linear forms over the states.
    pub arguments: Vec<Vec<T>>,
}

/// Taylor coefficients of a channel over a step.
#[derive(Clone, Debug)]
pub struct ChannelSeries<T> {
    /// The arguments.
    pub arguments: [Series<T>; 2],
    /// |slip| of a friction law.
    slip: Series<T>,
    /// Normal load of a friction law.
    normal: Series<T>,
    /// Index of the last coefficient of the normal load that is not zero.
    normal_order: usize,
    /// Decay of the stiction of a Stribeck law.
    decay: Decay<T>,
    /// μ of a friction law.
    mu: Series<T>,
    /// The torque, N·m.
    pub torque: Series<T>,
}

impl<T: Number> Default for ChannelSeries<T> {
    fn default() -> Self {
        let zero = [T::zero_(); TERMS];
        Self {
            arguments: [zero, zero],
            slip: zero,
            normal: zero,
            normal_order: 0,
            decay: Decay::default(),
            mu: zero,
            torque: zero,
        }
    }
}

/// Round-off of a normal load, relative to what it is the difference of.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

impl<T: Number> Normal<T> {
    /// Coefficient `k` of the normal load (capacity over μ), not cut at zero.
    pub fn term(&self, inputs: &[Series<T>], k: usize) -> T {
        match *self {
            Self::Pressure { input, gain, p0 } => {
                let pressure = inputs[input][k];
                gain * if k == 0 { pressure - p0 } else { pressure }
            }
            Self::Constant(normal) => {
                if k == 0 {
                    normal
                } else {
                    T::zero_()
                }
            }
        }
    }

    /// Round-off of the load [N·m] at the fill pressure; above zero.
    pub fn load_tolerance(&self) -> T {
        let size = match self {
            Self::Pressure { gain, p0, .. } => (*gain * *p0).re().magnitude(),
            Self::Constant(_) => T::Values::zero_(),
        };
        T::promote(size * ROUND_OFF + T::Values::of(f64::MIN_POSITIVE))
    }

    /// Runs, as bits, of which the load is gone from an instant on, by the values of inputs there and their
    /// rates.
    pub fn is_unloaded(&self, inputs: impl Fn(usize) -> [T::Values; 2]) -> u32 {
        let Self::Pressure { input, gain, p0 } = self else { return 0 };
        let [pressure, rate] = inputs(*input).map(|value| value * gain.re());
        let left = pressure - (*gain * *p0 + self.load_tolerance()).re();
        left.mask_where(|left| left <= 0.0) & rate.mask_where(|rate| rate <= 0.0)
    }

    /// All coefficients of the normal load.
    pub fn series(&self, inputs: &[Series<T>]) -> Series<T> {
        std::array::from_fn(|k| self.term(inputs, k))
    }
}

impl<T: Number> NonlinearTorque<T> {
    /// True if the torque is a product of arguments. Its first non-zero term may then have twice the power
    /// of time of theirs.
    pub fn is_product(&self) -> bool {
        matches!(
            self.law,
            TorqueLaw::Quadratic(_)
                | TorqueLaw::Map { .. }
                | TorqueLaw::Converter { .. }
                | TorqueLaw::Loss { .. }
        )
    }

    /// Return true if the second argument is the torque through a gear, which follows from all torques.
    pub fn is_coupled(&self) -> bool {
        matches!(self.law, TorqueLaw::Loss { coupled: true, .. })
    }

    /// Loss torque per torque through the gear, at a slip [rad/s]; zero of other laws.
    pub fn loss_slope(&self, branch: Branch, slip: T) -> T {
        match (&self.law, branch) {
            (TorqueLaw::Loss { map, .. }, Branch::Loss { sign, torque, speed }) => {
                let cell = map.cell(torque, speed);
                slip * (cell.t11 * sign) + cell.t10
            }
            _ => T::zero_(),
        }
    }

    /// Slip over which stiction decays by e, rad/s, and stiction itself.
    pub fn stiction(&self) -> Option<(T, T)> {
        match &self.law {
            TorqueLaw::Friction { mu: FrictionLaw::Stribeck(law), .. } => {
                Some((law.v_s, law.mu_s - law.mu_c))
            }
            _ => None,
        }
    }

    /// True if the active branch depends on an input and may change when the input jumps.
    pub fn follows_inputs(&self) -> bool {
        matches!(self.law, TorqueLaw::Map { .. })
    }

    /// Fill in coefficient `k` of the torque; the arguments' coefficients up to `k` are given.
    #[inline(always)]
    pub fn term(&self, branch: Branch, inputs: &[Series<T>], c: &mut ChannelSeries<T>, k: usize) {
        let [s, r] = &c.arguments;
        c.torque[k] = match (&self.law, branch) {
            (_, Branch::Off) => T::zero_(),
            (TorqueLaw::Friction { mu, normal, peak }, Branch::Saturated { sign }) => {
                normal.term(inputs, k) * mu.at(T::zero_()) * *peak * sign
            }
            (TorqueLaw::Friction { mu, normal, .. }, Branch::Moving { sign, piece }) => {
                c.slip[k] = s[k] * sign;
                c.mu[k] = mu.series_term(&c.slip, piece, &mut c.decay, k);
                c.normal[k] = normal.term(inputs, k);
                c.normal_order = if k <= 1 || !is_zero(c.normal[k]) { k } else { c.normal_order };
                let mut sum = T::zero_();
                for i in 0..=c.normal_order {
                    sum += c.normal[i] * c.mu[k - i];
                }
                sum * sign
            }
            (TorqueLaw::Quadratic(coefficient), Branch::Moving { sign, .. }) => {
                *coefficient * product_term(s, s, k) * sign
            }
            (TorqueLaw::Map { input, map }, Branch::Map { throttle, speed }) => {
                let bilinear_law = map.cell(throttle, speed);
                let position = &inputs[*input];
                let bilinear = product_term(position, s, k) * bilinear_law.t11;
                let linear = bilinear + position[k] * bilinear_law.t10 + s[k] * bilinear_law.t01;
                if k == 0 { linear + bilinear_law.t00 } else { linear }
            }
            (TorqueLaw::Converter { map, at_turbine }, Branch::Converter { index, sign }) => {
                let quadratics = map.cell(index);
                // torque = Sgn(ω_p) (q0 ω_p² + q1 ω_p ω_t + q2 ω_t²), with ν = ω_t / ω_p multiplied out
                let ([c0, c1], [m0, m1]) = (quadratics.c, quadratics.m);
                let q = if *at_turbine {
                    [c0 * m0, c0 * m1 + c1 * m0, c1 * m1]
                } else {
                    [-c0, -c1, 0.0]
                };
                let sum = product_term(s, s, k) * q[0]
                    + product_term(s, r, k) * q[1]
                    + product_term(r, r, k) * q[2];
                sum * sign
            }
            (TorqueLaw::Slip { stiffness, least_speed }, Branch::Slip { sign }) => {
                if sign == 0.0 {
                    *stiffness * s[k] / *least_speed
                } else {
                    quotient_term(*stiffness * s[k] * sign, &c.torque, r, k)
                }
            }
            (TorqueLaw::Loss { map, .. }, Branch::Loss { sign, torque, speed }) => {
                let cell = map.cell(torque, speed);
                let bilinear = product_term(r, s, k) * (cell.t11 * sign);
                let linear = bilinear + r[k] * cell.t10 + s[k] * cell.t01;
                if k == 0 { linear + cell.t00 * sign } else { linear }
            }
            (TorqueLaw::Regions(regions), Branch::Region { index }) => {
                let TwistForm { constant, per_twist, per_rate } = regions[index].torque;
                let linear = per_twist * s[k] + per_rate * r[k];
                if k == 0 { linear + constant } else { linear }
            }
            // A branch of another law: the run ends with status `not finite`.
            _ => T::of(f64::NAN),
        };
    }
}

/// Coefficient `k` of q = p / r from that of p and the coefficients of q before: p = q r.
#[inline(always)]
fn quotient_term<T: Number>(p: T, q: &Series<T>, r: &Series<T>, k: usize) -> T {
    let mut rest = p;
    for i in 0..k {
        rest -= q[i] * r[k - i];
    }
    rest / r[0]
}

/// Value of a linear form, given by its coefficients.
#[inline(always)]
pub fn form<T: Number>(coefficients: &[T], values: &[T]) -> T {
    let mut sum = T::zero_();
    for (&c, &v) in coefficients.iter().zip(values) {
        sum += c * v;
    }
    sum
}

impl<T: Number> NonlinearTorque<T> {
    /// The branch that holds at the given arguments; `sign` is the direction of a friction element.
    pub fn branch_at(&self, arguments: [T::Values; 2], sign: f64, inputs: &[Series<T>]) -> Branch {
        let [s, r] = arguments;
        match &self.law {
            TorqueLaw::Friction { mu: FrictionLaw::Table(table), .. } => {
                Branch::Moving { sign, piece: s.decide(|s| table.cell((s * sign).max(0.0))) }
            }
            TorqueLaw::Friction { .. } | TorqueLaw::Quadratic(_) => {
                Branch::Moving { sign, piece: 0 }
            }
            TorqueLaw::Map { input, map } => Branch::Map {
                throttle: inputs[*input][0].re().decide(|u| span_index(&map.throttle, u)),
                speed: s.decide(|s| span_index(&map.speed, s)),
            },
            TorqueLaw::Converter { map, .. } => {
                let index = |s: f64, r: f64| {
                    map.cell_index(if s == 0.0 && r == 0.0 { 0.0 } else { r / s.abs() * sign })
                };
                Branch::Converter { index: s.decide_with(r, index), sign }
            }
            TorqueLaw::Slip { least_speed, .. } => {
                let sign = |r: f64| if r.abs() < *least_speed { 0.0 } else { r.signum() };
                Branch::Slip { sign: r.decide(sign) }
            }
            TorqueLaw::Loss { map, .. } => Branch::Loss {
                sign,
                torque: span_index(&map.throttle, 0.0),
                speed: s.decide(|s| span_index(&map.speed, (s * sign).max(0.0))),
            },
            TorqueLaw::Regions(regions) => {
                let (s, r) = (T::promote(s), T::promote(r));
                let left = |(border, _): &(TwistForm<T>, usize)| border.at(s, r).re();
                let inside = |region: &Region<T>| {
                    region.borders.iter().all(|border| left(border).decide(|left| left >= 0.0))
                };
                Branch::Region { index: regions.iter().position(inside).unwrap_or(0) }
            }
        }
    }

    /// Magnitudes of the weights of twist and rate in border `i` of a compliance; None of other laws.
    pub fn border_weights(&self, branch: Branch, i: usize) -> Option<[T::Values; 2]> {
        let (TorqueLaw::Regions(regions), Branch::Region { index }) = (&self.law, branch) else {
            return None;
        };
        let (border, _) = &regions[index].borders[i];
        Some([border.per_twist, border.per_rate].map(|weight| weight.re().magnitude()))
    }

    /// Boundaries of the active branch.
    pub fn boundaries(
        &self,
        branch: Branch,
        inputs: &[Series<T>],
        c: &ChannelSeries<T>,
    ) -> Vec<BranchBoundary<T>> {
        let [s, r] = &c.arguments;
        match (&self.law, branch) {
            (
                TorqueLaw::Friction { mu: FrictionLaw::Table(table), .. },
                Branch::Moving { sign, piece },
            ) => {
                let (_, (from, to)) = table.piece(piece);
                let next =
                    |step: isize| Branch::Moving { sign, piece: piece.wrapping_add_signed(step) };
                let from = if piece == 0 { f64::NEG_INFINITY } else { from };
                between(&scaled(s, sign), (from, to)).map(|(b, step)| (b, next(step))).collect()
            }
            (TorqueLaw::Quadratic(_), Branch::Moving { sign, piece }) => {
                vec![(scaled(s, sign), Branch::Moving { sign: -sign, piece })]
            }
            (TorqueLaw::Map { input, map }, Branch::Map { throttle, speed }) => {
                let spans = map.cell(throttle, speed);
                let across = between(&inputs[*input], spans.throttle).map(|(border, step)| {
                    let throttle = throttle.wrapping_add_signed(step);
                    (border, Branch::Map { throttle, speed })
                });
                let along = between(s, spans.speed).map(|(border, step)| {
                    let speed = speed.wrapping_add_signed(step);
                    (border, Branch::Map { throttle, speed })
                });
                across.chain(along).collect()
            }
            (TorqueLaw::Converter { map, .. }, Branch::Converter { index, sign }) => {
                let (from, to) = map.cell(index).span;
                let ends = [(from, sign, -1), (to, -sign, 1)];
                let border = |(end, side, step): (f64, f64, isize)| {
                    let next = Branch::Converter { index: index.wrapping_add_signed(step), sign };
                    (add_weighted(r, T::of(side), s, T::of(-side * end)), next)
                };
                let ends = ends.into_iter().filter(|e| e.0.is_finite()).map(border);
                // Where the pump alone stops, the speed ratio goes from one infinity to the other.
                let mirrored = match (from.is_finite(), to.is_finite()) {
                    (true, false) => 0,
                    (false, true) => map.speed_ratio.len(),
                    _ => index,
                };
                let back = Branch::Converter { index: mirrored, sign: -sign };
                ends.chain([(scaled(s, sign), back)]).collect()
            }
            (TorqueLaw::Slip { least_speed, .. }, Branch::Slip { sign }) => {
                slip_boundaries(r, *least_speed, sign)
            }
            (TorqueLaw::Loss { map, coupled }, Branch::Loss { sign, .. }) => {
                let torques = if *coupled { Some(scaled(r, sign)) } else { None };
                loss_boundaries(map, branch, &scaled(s, sign), torques)
            }
            (TorqueLaw::Regions(regions), Branch::Region { index }) => {
                let border = |&(form, next): &(TwistForm<T>, usize)| {
                    let mut series = add_weighted(s, form.per_twist, r, form.per_rate);
                    series[0] += form.constant;
                    (series, Branch::Region { index: next })
                };
                regions[index].borders.iter().map(border).collect()
            }
            _ => Vec::new(),
        }
    }
}
