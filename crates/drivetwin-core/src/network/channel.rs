// SPDX-License-Identifier: MIT
//! Scalar torques that are not linear in the state, as Taylor recurrences in time.
//!
//! Within a cell (a direction of slip, a piece of a table) each is analytic; the solver watches the
//! cell's borders.

use super::linalg::Matrix;
use crate::model::FrictionLaw;
use crate::model::friction::{Piece, Stribeck};
use crate::model::mechanism::{ForceLaw, Friction, Normal};
use crate::model::torque_map::{TorqueMap, span_index};
use crate::number::{Real, Series, TERMS, product_term};

/// A law over one speed and the inputs.
#[derive(Clone, Debug)]
pub enum Law<T> {
    /// Friction torque, slip as argument.
    Friction {
        /// μ over |slip|.
        mu: FrictionLaw<T>,
        /// What μ is multiplied by.
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
}

/// A channel: its law and the speed it depends on, over the independent speeds.
#[derive(Clone, Debug)]
pub struct Channel<T> {
    /// Law.
    pub law: Law<T>,
    /// Argument over the independent speeds.
    pub speed: Vec<T>,
}

/// The analytic branch that is active.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Cell {
    /// No torque.
    #[default]
    Off,
    /// Friction at rest relative to the other side, loaded to its static capacity.
    Saturated {
        /// Sign of the torque.
        sign: f64,
    },
    /// Moving in one direction, on piece `piece` of a table.
    Moving {
        /// Sign of the speed.
        sign: f64,
        /// Piece of the table, 0 without one.
        piece: usize,
    },
    /// Cell of a map: spans of throttle and speed.
    Map {
        /// Throttle span.
        throttle: usize,
        /// Speed span.
        speed: usize,
    },
}

/// Taylor coefficients of a channel over a step.
#[derive(Clone, Debug)]
pub struct ChannelSeries<T> {
    /// The speed.
    pub speed: Series<T>,
    /// exp(-|s|/v_s) of a Stribeck law.
    exponential: Series<T>,
    /// μ, or unused.
    mu: Series<T>,
    /// The torque, N·m.
    pub torque: Series<T>,
}

impl<T: Real> Default for ChannelSeries<T> {
    fn default() -> Self {
        let zero = [T::zero_(); TERMS];
        Self { speed: zero, exponential: zero, mu: zero, torque: zero }
    }
}

impl<T: Real> Normal<T> {
    /// Value and rate [N·m over μ, per s] of the normal load, not cut at zero; `inputs` holds value
    /// and rate of every input.
    pub fn line(&self, inputs: &[[T; 2]]) -> [T; 2] {
        match *self {
            Self::Pressure { input, gain, p0 } => {
                [gain * (inputs[input][0] - p0), gain * inputs[input][1]]
            }
            Self::Constant(normal) => [normal, T::zero_()],
        }
    }
}

impl<T: Real> Channel<T> {
    /// Channel of a friction element.
    pub fn friction(friction: &Friction<T>, slip: Vec<T>) -> Self {
        let (mu, normal) = (friction.law.clone(), friction.normal.clone());
        Self { law: Law::Friction { mu, normal, peak: friction.peak }, speed: slip }
    }

    /// Channel of a force law, `None` for the linear ones.
    pub fn force(law: &ForceLaw<T>, speed: Vec<T>) -> Option<Self> {
        let law = match law {
            ForceLaw::Input(_) | ForceLaw::Constant(_) => return None,
            ForceLaw::Quadratic(coefficient) => Law::Quadratic(*coefficient),
            ForceLaw::Map { input, map } => Law::Map { input: *input, map: map.clone() },
        };
        Some(Self { law, speed })
    }

    /// The cell that holds at speed `s` when moving with `sign`.
    pub fn cell_at(&self, s: f64, sign: f64, inputs: &[[T; 2]]) -> Cell {
        match &self.law {
            Law::Friction { mu: FrictionLaw::Table(table), .. } => {
                Cell::Moving { sign, piece: table.cell((s * sign).max(0.0)) }
            }
            Law::Friction { .. } | Law::Quadratic(_) => Cell::Moving { sign, piece: 0 },
            Law::Map { input, map } => Cell::Map {
                throttle: span_index(&map.throttle, inputs[*input][0].re()),
                speed: span_index(&map.speed, s),
            },
        }
    }

    /// Fill in coefficient `k` of the torque; the speed's coefficients up to `k` are given.
    pub fn term(&self, cell: Cell, inputs: &[[T; 2]], c: &mut ChannelSeries<T>, k: usize) {
        c.torque[k] = match (&self.law, cell) {
            (_, Cell::Off) => T::zero_(),
            (Law::Friction { mu, normal, peak }, Cell::Saturated { sign }) => {
                let capacity = mu.at(T::zero_()) * *peak * sign;
                if k < 2 { normal.line(inputs)[k] * capacity } else { T::zero_() }
            }
            (Law::Friction { mu, normal, .. }, Cell::Moving { sign, piece }) => {
                c.mu[k] = mu_term(mu, sign, piece, c, k);
                let [n0, n1] = normal.line(inputs);
                let torque = c.mu[k] * n0;
                (if k > 0 { torque + c.mu[k - 1] * n1 } else { torque }) * sign
            }
            (Law::Quadratic(coefficient), Cell::Moving { sign, .. }) => {
                *coefficient * product_term(&c.speed, &c.speed, k) * sign
            }
            (Law::Map { input, map }, Cell::Map { throttle, speed }) => {
                let cell = map.cell(throttle, speed);
                let [p0, p1] = inputs[*input];
                let linear = c.speed[k] * (p0 * cell.t11 + cell.t01);
                match k {
                    0 => linear + p0 * cell.t10 + cell.t00,
                    1 => linear + p1 * cell.t10 + p1 * c.speed[0] * cell.t11,
                    _ => linear + p1 * c.speed[k - 1] * cell.t11,
                }
            }
            (law, cell) => unreachable!("cell {cell:?} does not belong to {law:?}"),
        };
    }

    /// Borders of the cell: each series must stay positive; crossing leads to the named cell.
    pub fn borders(
        &self,
        cell: Cell,
        inputs: &[[T; 2]],
        c: &ChannelSeries<T>,
    ) -> Vec<(Series<T>, Cell)> {
        match (&self.law, cell) {
            (Law::Friction { mu: FrictionLaw::Table(table), .. }, Cell::Moving { sign, piece }) => {
                let (_, span) = table.piece(piece);
                let slip = scaled(&c.speed, sign);
                between(&slip, (if piece == 0 { f64::NEG_INFINITY } else { span.0 }, span.1))
                    .map(|(series, step)| {
                        (series, Cell::Moving { sign, piece: piece.wrapping_add_signed(step) })
                    })
                    .collect()
            }
            (Law::Quadratic(_), Cell::Moving { sign, piece }) => {
                vec![(scaled(&c.speed, sign), Cell::Moving { sign: -sign, piece })]
            }
            (Law::Map { input, map }, Cell::Map { throttle, speed }) => {
                let cell = map.cell(throttle, speed);
                let mut position = [T::zero_(); TERMS];
                position[..2].copy_from_slice(&inputs[*input]);
                let across = between(&position, cell.throttle).map(|(series, step)| {
                    (series, Cell::Map { throttle: throttle.wrapping_add_signed(step), speed })
                });
                let along = between(&c.speed, cell.speed).map(|(series, step)| {
                    (series, Cell::Map { throttle, speed: speed.wrapping_add_signed(step) })
                });
                across.chain(along).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// Coefficient `k` of μ over |slip|, which moves with `sign`.
fn mu_term<T: Real>(
    law: &FrictionLaw<T>,
    sign: f64,
    piece: usize,
    c: &mut ChannelSeries<T>,
    k: usize,
) -> T {
    let slip = c.speed[k] * sign;
    match law {
        FrictionLaw::Table(table) => {
            let (Piece { from, value, slope }, _) = table.piece(piece);
            if k == 0 { value + slope * (slip - from) } else { slope * slip }
        }
        FrictionLaw::Stribeck(Stribeck { mu_c, mu_s, v_s, mu_v }) => {
            // E' = -(|s|'/v_s) E, order by order
            c.exponential[k] = if k == 0 {
                (-slip / *v_s).exp()
            } else {
                let mut sum = T::zero_();
                for i in 1..=k {
                    sum += c.speed[i] * c.exponential[k - i] * i as f64;
                }
                -sum * sign / (*v_s * k as f64)
            };
            let mu = (*mu_s - *mu_c) * c.exponential[k] + *mu_v * slip;
            if k == 0 { mu + *mu_c } else { mu }
        }
    }
}

fn scaled<T: Real>(series: &Series<T>, factor: f64) -> Series<T> {
    series.map(|c| c * factor)
}

/// Distances to the ends of a span that exist, each with the step to the neighbouring cell.
fn between<T: Real>(
    series: &Series<T>,
    span: (f64, f64),
) -> impl Iterator<Item = (Series<T>, isize)> {
    let mut above = *series;
    above[0] -= span.0;
    let mut below = scaled(series, -1.0);
    below[0] += span.1;
    let finite = [(span.0, (above, -1)), (span.1, (below, 1))];
    finite.into_iter().filter(|(end, _)| end.is_finite()).map(|(_, border)| border)
}

/// Value of a linear form, given by its coefficients over the independent speeds.
pub fn form<T: Real>(coefficients: &[T], speeds: &[T]) -> T {
    coefficients.iter().zip(speeds).fold(T::zero_(), |sum, (&c, &v)| sum + c * v)
}

/// Product of a matrix row with a vector.
pub fn apply<T: Real>(matrix: &Matrix<T>, row: usize, vector: &[T]) -> T {
    form(matrix.row(row), vector)
}
