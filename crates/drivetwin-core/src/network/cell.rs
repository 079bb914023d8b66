// SPDX-License-Identifier: MIT
//! The analytic branch of a channel, where it ends, and what lies beyond.

use super::channel::{Channel, ChannelSeries, Law};
use crate::model::FrictionLaw;
use crate::model::mechanism::{Region, TwistForm};
use crate::model::torque_map::span_index;
use crate::number::{Number, Series, Values};

/// The branch that is active.
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
    /// Spans of throttle and speed of a torque map.
    Map {
        /// Throttle span.
        throttle: usize,
        /// Speed span.
        speed: usize,
    },
    /// Span of the speed ratio of a converter.
    Converter {
        /// Cell of its map.
        index: usize,
        /// Sign of the pump speed: turning backwards, its torques are those of a mirror.
        sign: f64,
    },
    /// Direction of the road below a tyre.
    Slip {
        /// Its sign; 0 below the least speed.
        sign: f64,
    },
    /// Region of a piecewise linear compliance.
    Region {
        /// Its index.
        index: usize,
    },
}

/// A border of a cell: the series must stay positive; beyond lies the cell.
pub type Border<T> = (Series<T>, Cell);

impl<T: Number> Channel<T> {
    /// The cell that holds at the given arguments; `sign` is the direction of a friction element.
    pub fn cell_at(&self, arguments: [T::Values; 2], sign: f64, inputs: &[Series<T>]) -> Cell {
        let [s, r] = arguments;
        match &self.law {
            Law::Friction { mu: FrictionLaw::Table(table), .. } => {
                Cell::Moving { sign, piece: s.decide(|s| table.cell((s * sign).max(0.0))) }
            }
            Law::Friction { .. } | Law::Quadratic(_) => Cell::Moving { sign, piece: 0 },
            Law::Map { input, map } => Cell::Map {
                throttle: inputs[*input][0].re().decide(|u| span_index(&map.throttle, u)),
                speed: s.decide(|s| span_index(&map.speed, s)),
            },
            Law::Converter { map, .. } => {
                let index = |s: f64, r: f64| {
                    map.cell_index(if s == 0.0 && r == 0.0 { 0.0 } else { r / s.abs() * sign })
                };
                Cell::Converter { index: s.decide_with(r, index), sign }
            }
            Law::Slip { least_speed, .. } => {
                let sign = |r: f64| if r.abs() < *least_speed { 0.0 } else { r.signum() };
                Cell::Slip { sign: r.decide(sign) }
            }
            Law::Regions(regions) => {
                let (s, r) = (T::promote(s), T::promote(r));
                let left = |(border, _): &(TwistForm<T>, usize)| border.at(s, r).re();
                let inside = |region: &Region<T>| {
                    region.borders.iter().all(|border| left(border).decide(|left| left >= 0.0))
                };
                Cell::Region { index: regions.iter().position(inside).unwrap_or(0) }
            }
        }
    }

    /// Borders of the active cell.
    pub fn borders(
        &self,
        cell: Cell,
        inputs: &[Series<T>],
        c: &ChannelSeries<T>,
    ) -> Vec<Border<T>> {
        let [s, r] = &c.arguments;
        match (&self.law, cell) {
            (Law::Friction { mu: FrictionLaw::Table(table), .. }, Cell::Moving { sign, piece }) => {
                let (_, (from, to)) = table.piece(piece);
                let next =
                    |step: isize| Cell::Moving { sign, piece: piece.wrapping_add_signed(step) };
                let from = if piece == 0 { f64::NEG_INFINITY } else { from };
                between(&scaled(s, sign), (from, to)).map(|(b, step)| (b, next(step))).collect()
            }
            (Law::Quadratic(_), Cell::Moving { sign, piece }) => {
                vec![(scaled(s, sign), Cell::Moving { sign: -sign, piece })]
            }
            (Law::Map { input, map }, Cell::Map { throttle, speed }) => {
                let cell = map.cell(throttle, speed);
                let across = between(&inputs[*input], cell.throttle).map(|(border, step)| {
                    let throttle = throttle.wrapping_add_signed(step);
                    (border, Cell::Map { throttle, speed })
                });
                let along = between(s, cell.speed).map(|(border, step)| {
                    let speed = speed.wrapping_add_signed(step);
                    (border, Cell::Map { throttle, speed })
                });
                across.chain(along).collect()
            }
            (Law::Converter { map, .. }, Cell::Converter { index, sign }) => {
                let (from, to) = map.cell(index).span;
                let ends = [(from, sign, -1), (to, -sign, 1)];
                let border = |(end, side, step): (f64, f64, isize)| {
                    let next = Cell::Converter { index: index.wrapping_add_signed(step), sign };
                    (weighted(r, T::of(side), s, T::of(-side * end)), next)
                };
                let ends = ends.into_iter().filter(|e| e.0.is_finite()).map(border);
                // Where the pump alone stops, the speed ratio goes from one infinity to the other.
                let mirrored = match (from.is_finite(), to.is_finite()) {
                    (true, false) => 0,
                    (false, true) => map.speed_ratio.len(),
                    _ => index,
                };
                let back = Cell::Converter { index: mirrored, sign: -sign };
                ends.chain([(scaled(s, sign), back)]).collect()
            }
            (Law::Slip { least_speed, .. }, Cell::Slip { sign }) => {
                slip_borders(r, *least_speed, sign)
            }
            (Law::Regions(regions), Cell::Region { index }) => {
                let border = |&(form, next): &(TwistForm<T>, usize)| {
                    let mut series = weighted(s, form.per_twist, r, form.per_rate);
                    series[0] += form.constant;
                    (series, Cell::Region { index: next })
                };
                regions[index].borders.iter().map(border).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// Borders of a tyre on a road of speed `road` in direction `sign`, 0 below the least speed.
fn slip_borders<T: Number>(road: &Series<T>, least_speed: f64, sign: f64) -> Vec<Border<T>> {
    if sign == 0.0 {
        let ends = between(road, (-least_speed, least_speed));
        return ends.map(|(border, step)| (border, Cell::Slip { sign: step as f64 })).collect();
    }
    let mut border = scaled(road, sign);
    border[0] -= T::of(least_speed);
    vec![(border, Cell::Slip { sign: 0.0 })]
}

fn scaled<T: Number>(series: &Series<T>, factor: f64) -> Series<T> {
    series.map(|c| c * factor)
}

fn weighted<T: Number>(a: &Series<T>, wa: T, b: &Series<T>, wb: T) -> Series<T> {
    std::array::from_fn(|k| a[k] * wa + b[k] * wb)
}

/// Distances to the ends of a span that exist, each with the step to the neighbouring cell.
fn between<T: Number>(
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
