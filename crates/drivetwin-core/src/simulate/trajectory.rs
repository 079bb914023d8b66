// SPDX-License-Identifier: MIT
//! Chosen outputs on a time grid.

use super::audit::EnergyAudit;
use super::start::{StartError, find};
use crate::model::mechanism::SpringLaw;
use crate::network::channel::form;
use crate::network::{Network, Row};
use crate::number::Real;
use crate::solve::{Event, Integrator, RowState, Status, Step};
use serde::{Deserialize, Serialize};

/// A quantity to record, by the name of its node or element.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// Speed of a node, rad/s.
    Speed(String),
    /// Angle that a node has turned since the start, rad.
    Angle(String),
    /// Twist of a shaft, rad.
    Twist(String),
    /// Torque of a shaft on its driven end, N·m.
    ShaftTorque(String),
    /// Slip of a friction element, rad/s.
    Slip(String),
    /// Torque of a friction element on its driven side, N·m.
    FrictionTorque(String),
}

/// An output resolved against a network.
enum Column<T> {
    /// Linear form over the basis: position and coefficient of its terms.
    Linear(Vec<(usize, T)>),
    /// Speed of a node over the independent speeds, and the angle at the start of the present step.
    Angle(Vec<T>, T),
    /// Torque of a friction element.
    Friction(usize),
}

/// Result of a run. Columns in the order of the outputs asked for, each as long as `time`; NaN
/// after a failure.
#[derive(Clone, Debug)]
pub struct Trajectory<T> {
    /// Grid, s.
    pub time: Vec<f64>,
    /// One column per output.
    pub columns: Vec<Vec<T>>,
    /// Names of the friction elements that events refer to.
    pub elements: Vec<String>,
    /// Events of friction elements.
    pub events: Vec<Event<T>>,
    /// How the run ended.
    pub status: Status,
    /// Energy balance, where asked for.
    pub audit: Option<EnergyAudit>,
}

/// Fills columns while a run advances.
pub(super) struct Recorder<'g, T> {
    grid: &'g [f64],
    next: usize,
    columns: Vec<(Column<T>, Vec<T>)>,
}

impl<'g, T: Real> Recorder<'g, T> {
    /// Resolve the outputs by name.
    pub fn new(
        network: &Network<T>,
        outputs: &[Output],
        grid: &'g [f64],
    ) -> Result<Self, StartError> {
        let column =
            |output: &Output| Ok((resolve(network, output)?, Vec::with_capacity(grid.len())));
        Ok(Self { grid, next: 0, columns: outputs.iter().map(column).collect::<Result<_, _>>()? })
    }

    /// Record the grid points before the end of the step; `last` includes the end.
    pub fn sample(&mut self, run: &Integrator<'_, T>, step: &Step<T>, last: bool) {
        let (start, end) = (step.start.re(), (step.start + step.length).re());
        while let Some(&t) = self.grid.get(self.next) {
            if t > end || (t == end && !last) {
                break;
            }
            let h = if t >= start { -step.start + t } else { T::zero_() };
            let basis = run.expansion.basis_at(run.network, h);
            for (column, values) in &mut self.columns {
                values.push(match column {
                    Column::Angle(row, angle) => *angle + integral(run, row, h),
                    other => value(other, run, &basis),
                });
            }
            self.next += 1;
        }
        for (column, _) in &mut self.columns {
            if let Column::Angle(row, angle) = column {
                *angle += integral(run, row, step.length);
            }
        }
    }

    /// Whether a column depends on the motion between samples.
    pub fn needs_motion(&self) -> bool {
        self.columns.iter().any(|(column, _)| matches!(column, Column::Angle(..)))
    }

    /// Record the grid points at a sample, given by its basis.
    pub fn sample_basis(&mut self, time: f64, basis: &[T], run: &Integrator<'_, T>) {
        while self.grid.get(self.next).is_some_and(|&t| t <= time) {
            for (column, values) in &mut self.columns {
                values.push(value(column, run, basis));
            }
            self.next += 1;
        }
    }

    /// Columns at full length.
    pub fn finish(self) -> Vec<Vec<T>> {
        let length = self.grid.len();
        let pad = |(_, mut values): (Column<T>, Vec<T>)| {
            values.resize(length, T::of(f64::NAN));
            values
        };
        self.columns.into_iter().map(pad).collect()
    }
}

fn resolve<T: Real>(network: &Network<T>, output: &Output) -> Result<Column<T>, StartError> {
    let m = &network.mechanism;
    let nodes: Vec<&str> = m.nodes.iter().map(String::as_str).collect();
    let springs: Vec<&str> = m.springs.iter().map(|s| s.element.as_str()).collect();
    let frictions: Vec<&str> = m.frictions.iter().map(|f| f.element.as_str()).collect();
    let speed = |node| Column::Linear(terms(&network.over_speeds(&vec![(node, T::of(1.0))])));
    Ok(match output {
        Output::Speed(name) => speed(find("node", name, &nodes)?),
        Output::Angle(name) => {
            let node = find("node", name, &nodes)?;
            Column::Angle(network.over_speeds(&vec![(node, T::of(1.0))]), T::zero_())
        }
        Output::Twist(name) => {
            let twist = network.speeds() + find("shaft", name, &springs)?;
            Column::Linear(vec![(twist, T::of(1.0))])
        }
        Output::ShaftTorque(name) => shaft_torque(network, find("shaft", name, &springs)?),
        Output::Slip(name) => {
            let element = find("friction element", name, &frictions)?;
            Column::Linear(terms(&network.frictions[element].slip))
        }
        Output::FrictionTorque(name) => {
            Column::Friction(find("friction element", name, &frictions)?)
        }
    })
}

/// Terms of a row that are not zero.
fn terms<T: Real>(row: &[T]) -> Vec<(usize, T)> {
    row.iter().copied().enumerate().filter(|(_, c)| c.re() != 0.0).collect()
}

fn shaft_torque<T: Real>(network: &Network<T>, i: usize) -> Column<T> {
    match network.mechanism.springs[i].law {
        SpringLaw::Linear { stiffness, damping } => {
            let mut row: Vec<T> = network.twist_rates.row(i).iter().map(|&c| c * damping).collect();
            row.resize(network.states(), T::zero_());
            row[network.speeds() + i] = stiffness;
            Column::Linear(terms(&row))
        }
        SpringLaw::Regions { .. } => {
            let springs = &network.mechanism.springs[..i];
            let backlashes =
                springs.iter().filter(|s| matches!(s.law, SpringLaw::Regions { .. })).count();
            Column::Linear(vec![(network.drives[backlashes].basis, T::of(1.0))])
        }
    }
}

/// Value of a column from the basis at an instant; an angle is that at the start of the step.
fn value<T: Real>(column: &Column<T>, run: &Integrator<'_, T>, basis: &[T]) -> T {
    match column {
        Column::Linear(terms) => {
            terms.iter().fold(T::zero_(), |sum, &(position, c)| sum + c * basis[position])
        }
        Column::Angle(_, angle) => *angle,
        Column::Friction(j) => match run.rows[*j] {
            RowState::Open => T::zero_(),
            RowState::Slipping { .. } | RowState::Saturated { .. } => {
                basis[run.network.first_channel() + j]
            }
            RowState::Stuck => holding_torque(run, *j, basis),
        },
    }
}

fn holding_torque<T: Real>(run: &Integrator<'_, T>, j: usize, basis: &[T]) -> T {
    let position = run.mode.stuck.iter().position(|&s| s == Row::Friction(j));
    form(run.mode.stuck_torque.row(position.expect("a stuck element belongs to the mode")), basis)
}

/// Angle turned within the first `h` seconds of the present step.
fn integral<T: Real>(run: &Integrator<'_, T>, row: &[T], h: T) -> T {
    let mut sum = T::zero_();
    for (&c, series) in row.iter().zip(&run.expansion.states) {
        if c.re() != 0.0 {
            let mut value = T::zero_();
            for k in (0..=run.expansion.order).rev() {
                value = value * h + series[k] / (k + 1) as f64;
            }
            sum += c * value * h;
        }
    }
    sum
}
