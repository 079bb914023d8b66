// SPDX-License-Identifier: MIT
//! Driveline and start whose numbers change from run to run.

use super::run::SimulateError;
use super::sensitivity::SensitivityError;
use super::start::{Start, State};
use crate::model::Driveline;
use crate::network::Network;
use crate::number::Number;

/// Values of the numbers that change from run to run.
#[derive(Clone, Copy, Debug, Default)]
pub struct ParameterSets<'a> {
    /// Paths of the numbers, see [`Driveline::number_mut`]; `start.` and a name leads to the speed of a node or
    /// the twist of a shaft at the start.
    pub paths: &'a [&'a str],
    /// Values, sets × paths.
    pub values: &'a [f64],
}

/// Driveline with the start of its runs.
pub(super) struct Case<T> {
    pub driveline: Driveline<T>,
    pub start: Start<T>,
}

impl<T: Number> Case<T> {
    /// Find a number by its path, see [`ParameterSets`].
    pub fn number_mut(&mut self, path: &str) -> Option<&mut T> {
        match path.strip_prefix("start.") {
            Some(name) => self.start.number_mut(name),
            None => self.driveline.number_mut(path),
        }
    }

    pub fn compile(&self) -> Result<(Network<T>, State<T>), SimulateError> {
        let network = Network::compile(&self.driveline)?;
        let state = self.start.state(&network)?;
        Ok((network, state))
    }
}

impl Case<f64> {
    /// Convert to another number type.
    pub fn promote<T: Number>(&self) -> Case<T> {
        let Self { driveline, start } = self;
        Case { driveline: driveline.promote(), start: Start::from_lanes(|_| start) }
    }
}

/// Runs of a batch: parameter sets of a driveline, from one start or from one each.
pub(super) struct Sets<'s> {
    driveline: &'s Driveline<f64>,
    starts: Vec<&'s Start<f64>>,
    parameters: ParameterSets<'s>,
}

impl<'s> Sets<'s> {
    /// Refuses paths that lead to no number.
    pub fn new(
        driveline: &'s Driveline<f64>,
        starts: Vec<&'s Start<f64>>,
        parameters: ParameterSets<'s>,
    ) -> Result<Self, SensitivityError> {
        let mut searched = driveline.clone();
        let known = |path: &str| match path.strip_prefix("start.") {
            Some(name) => starts.iter().all(|start| start.states(name)),
            None => searched.number_mut(path).is_some(),
        };
        SensitivityError::refuse_unknown(parameters.paths.iter().copied(), known)?;
        Ok(Self { driveline, starts, parameters })
    }

    /// Number of runs.
    pub fn count(&self) -> usize {
        let ParameterSets { paths, values } = self.parameters;
        values.len().checked_div(paths.len()).unwrap_or(self.starts.len())
    }

    /// Start of a run.
    pub fn start(&self, run: usize) -> &'s Start<f64> {
        self.starts[run % self.starts.len()]
    }

    /// Driveline and start of runs side by side, at most as many as a number has; the first stands in for
    /// those that it has more.
    pub fn place_runs<T: Number>(&self, runs: &[usize]) -> Case<T> {
        let of = |place: usize| runs.get(place).map_or(runs[0], |&run| run);
        let start = Start::from_lanes(|place| self.start(of(place)));
        let mut case = Case { driveline: self.driveline.promote(), start };
        let ParameterSets { paths, values } = self.parameters;
        for (i, path) in paths.iter().enumerate() {
            let value = T::from_lanes(|place| values[of(place) * paths.len() + i]);
            // Unknown paths have been refused.
            if let Some(number) = case.number_mut(path) {
                *number = value;
            }
        }
        case
    }
}
