// SPDX-License-Identifier: MIT
//! Chosen outputs on a time grid.

use super::audit::EnergyAudit;
use super::start::{StartError, find};
use crate::model::mechanism::SpringLaw;
use crate::network::channel::form;
use crate::network::{Network, Row};
use crate::number::{Real, evaluate};
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

/// An output with its index in the network.
enum Column<T> {
    Speeds(Vec<T>),
    /// Speed of the node and the angle at the start of the present step.
    Angle(Vec<T>, T),
    Twist(usize),
    Shaft(usize),
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
            for (column, values) in &mut self.columns {
                values.push(value(column, run, h));
            }
            self.next += 1;
        }
        for (column, _) in &mut self.columns {
            if let Column::Angle(row, angle) = column {
                *angle += integral(run, row, step.length);
            }
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
    Ok(match output {
        Output::Speed(name) => {
            let node = find("node", name, &nodes)?;
            Column::Speeds(network.over_speeds(&vec![(node, T::of(1.0))]))
        }
        Output::Angle(name) => {
            let node = find("node", name, &nodes)?;
            Column::Angle(network.over_speeds(&vec![(node, T::of(1.0))]), T::zero_())
        }
        Output::Twist(name) => Column::Twist(find("shaft", name, &springs)?),
        Output::ShaftTorque(name) => Column::Shaft(find("shaft", name, &springs)?),
        Output::Slip(name) => {
            let element = find("friction element", name, &frictions)?;
            Column::Speeds(network.frictions[element].slip.clone())
        }
        Output::FrictionTorque(name) => {
            Column::Friction(find("friction element", name, &frictions)?)
        }
    })
}

/// Value of a column `h` seconds into the present step.
fn value<T: Real>(column: &Column<T>, run: &Integrator<'_, T>, h: T) -> T {
    let order = run.expansion.order;
    let state = |i: usize| evaluate(&run.expansion.states[i], order, h);
    let linear =
        |row: &[T]| row.iter().enumerate().fold(T::zero_(), |sum, (i, &c)| sum + c * state(i));
    match column {
        Column::Speeds(row) => linear(row),
        Column::Twist(i) => state(run.network.speeds() + i),
        Column::Shaft(i) => shaft_torque(run, *i, h),
        Column::Friction(j) => match run.rows[*j] {
            RowState::Open => T::zero_(),
            RowState::Slipping { .. } | RowState::Saturated { .. } => {
                evaluate(&run.expansion.channels[*j].torque, order, h)
            }
            RowState::Stuck => {
                let position = run.mode.stuck.iter().position(|&s| s == Row::Friction(*j));
                let position = position.expect("a stuck element belongs to the mode");
                form(run.mode.stuck_torque.row(position), &run.expansion.basis_at(run.network, h))
            }
        },
        Column::Angle(row, angle) => *angle + integral(run, row, h),
    }
}

fn shaft_torque<T: Real>(run: &Integrator<'_, T>, i: usize, h: T) -> T {
    let basis = run.expansion.basis_at(run.network, h);
    match run.network.mechanism.springs[i].law {
        SpringLaw::Linear { stiffness, damping } => {
            let rate = form(run.network.twist_rates.row(i), &basis);
            stiffness * basis[run.network.speeds() + i] + damping * rate
        }
        SpringLaw::Backlash { .. } => {
            let springs = &run.network.mechanism.springs[..i];
            let backlashes =
                springs.iter().filter(|s| matches!(s.law, SpringLaw::Backlash { .. })).count();
            basis[run.network.drives[backlashes].basis]
        }
    }
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
