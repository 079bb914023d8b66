// SPDX-License-Identifier: MIT
//! Scalar torques that are not linear in the state, as Taylor recurrences in time.
//!
//! Within a cell (a direction of slip, a piece of a table) each is analytic; the solver watches the
//! cell's borders.

use super::cell::Cell;
use super::linalg::is_zero;
use crate::model::converter_map::ConverterMap;
use crate::model::friction::{Decay, FrictionLaw};
use crate::model::mechanism::{Normal, Region, TwistForm};
use crate::model::torque_map::TorqueMap;
use crate::number::{Number, Series, TERMS, Values, product_term};

/// A law over one or two linear forms of the state, and the inputs.
#[derive(Clone, Debug)]
pub enum Law<T> {
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
    /// Piecewise linear compliance over twist and its rate.
    Regions(Vec<Region<T>>),
}

/// A channel: its law and its arguments over the states.
#[derive(Clone, Debug)]
pub struct Channel<T> {
    /// Law.
    pub law: Law<T>,
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
    /// Normal load of a friction law, and the number of the last coefficient that is not zero.
    normal: (Series<T>, usize),
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
            normal: (zero, 0),
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

impl<T: Number> Channel<T> {
    /// True if the torque is a product of arguments. Its first non-zero term may then have twice the power
    /// of time of theirs.
    pub fn is_product(&self) -> bool {
        matches!(self.law, Law::Quadratic(_) | Law::Map { .. } | Law::Converter { .. })
    }

    /// Slip over which stiction decays by e, rad/s, and stiction itself.
    pub fn stiction(&self) -> Option<(T, T)> {
        match &self.law {
            Law::Friction { mu: FrictionLaw::Stribeck(law), .. } => {
                Some((law.v_s, law.mu_s - law.mu_c))
            }
            _ => None,
        }
    }

    /// True if the active cell depends on an input and may change when the input jumps.
    pub fn follows_inputs(&self) -> bool {
        matches!(self.law, Law::Map { .. })
    }

    /// Fill in coefficient `k` of the torque; the arguments' coefficients up to `k` are given.
    #[inline(always)]
    pub fn term(&self, cell: Cell, inputs: &[Series<T>], c: &mut ChannelSeries<T>, k: usize) {
        let [s, r] = &c.arguments;
        c.torque[k] = match (&self.law, cell) {
            (_, Cell::Off) => T::zero_(),
            (Law::Friction { mu, normal, peak }, Cell::Saturated { sign }) => {
                normal.term(inputs, k) * mu.at(T::zero_()) * *peak * sign
            }
            (Law::Friction { mu, normal, .. }, Cell::Moving { sign, piece }) => {
                c.slip[k] = s[k] * sign;
                c.mu[k] = mu.series_term(&c.slip, piece, &mut c.decay, k);
                let (load, last) = &mut c.normal;
                load[k] = normal.term(inputs, k);
                *last = if k <= 1 || !is_zero(load[k]) { k } else { *last };
                let mut sum = T::zero_();
                for i in 0..=*last {
                    sum += load[i] * c.mu[k - i];
                }
                sum * sign
            }
            (Law::Quadratic(coefficient), Cell::Moving { sign, .. }) => {
                *coefficient * product_term(s, s, k) * sign
            }
            (Law::Map { input, map }, Cell::Map { throttle, speed }) => {
                let cell = map.cell(throttle, speed);
                let position = &inputs[*input];
                let bilinear = product_term(position, s, k) * cell.t11;
                let linear = bilinear + position[k] * cell.t10 + s[k] * cell.t01;
                if k == 0 { linear + cell.t00 } else { linear }
            }
            (Law::Converter { map, at_turbine }, Cell::Converter { index, sign }) => {
                let cell = map.cell(index);
                // torque = Sgn(ω_p) (q0 ω_p² + q1 ω_p ω_t + q2 ω_t²), with ν = ω_t / ω_p multiplied out
                let ([c0, c1], [m0, m1]) = (cell.c, cell.m);
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
            (Law::Slip { stiffness, least_speed }, Cell::Slip { sign }) => {
                if sign == 0.0 {
                    *stiffness * s[k] / *least_speed
                } else {
                    quotient_term(*stiffness * s[k] * sign, &c.torque, r, k)
                }
            }
            (Law::Regions(regions), Cell::Region { index }) => {
                let TwistForm { constant, per_twist, per_rate } = regions[index].torque;
                let linear = per_twist * s[k] + per_rate * r[k];
                if k == 0 { linear + constant } else { linear }
            }
            (law, cell) => unreachable!("cell {cell:?} does not belong to {law:?}"),
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
