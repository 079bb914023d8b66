// SPDX-License-Identifier: MIT
//! Exact forward derivatives of a run, through lock and break-away events.

use super::output::Output;
use super::run::{RunOptions, SimulateError, run};
use super::sets::Case;
use super::start::Start;
use super::trajectory::Trajectory;
use crate::model::Driveline;
use crate::network::Network;
use crate::number::Dual;
use crate::solver::{Settings, Signal, Status};
use thiserror::Error;

/// Most unknowns that one pass differentiates for: more are slower where loops are not fully optimised.
pub const LANES: usize = if cfg!(feature = "wide") { 16 } else { FEW };
/// Most unknowns of the narrow pass.
const FEW: usize = 8;

/// Reason why a batch or derivatives cannot be computed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SensitivityError {
    /// A path that leads to no number.
    #[error(
        "parameter {path:?} is unknown; write element.field, start.node, start.shaft or delay.input"
    )]
    Unknown {
        /// The path.
        path: String,
    },
    /// A number at a value where the motion has a corner.
    #[error(
        "nothing has a derivative by {path:?} at 0: what has no capacity holds nothing; give it a \
         small positive value"
    )]
    Corner {
        /// Path of the number.
        path: String,
    },
    /// The scenario cannot be run.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

impl SensitivityError {
    /// Refuse the first path that is not known.
    pub(super) fn refuse_unknown<'p>(
        mut paths: impl Iterator<Item = &'p str>,
        mut is_known: impl FnMut(&str) -> bool,
    ) -> Result<(), Self> {
        match paths.find(|path| !is_known(path)) {
            Some(path) => Err(Self::Unknown { path: path.to_owned() }),
            None => Ok(()),
        }
    }
}

/// Inputs and start of a run.
#[derive(Clone, Debug)]
pub struct Scenario<'a> {
    /// Signals by the names of the inputs.
    pub signals: Vec<(&'a str, Signal<'a, f64>)>,
    /// Start.
    pub start: Start<f64>,
}

/// Derivative of a number by an unknown.
#[derive(Clone, Copy, Debug)]
pub struct Seed<'a> {
    /// Unknown, from 0 on.
    pub unknown: usize,
    /// Path of the number, see [`super::ParameterSets`]; `delay.` and a name leads to the delay of an input.
    pub path: &'a str,
    /// Derivative, one for all runs or one for each; that of a delay is the one of run 0.
    pub weights: &'a [f64],
}

/// Unknowns to differentiate by, each with the numbers that depend on it.
#[derive(Clone, Copy, Debug)]
pub struct Unknowns<'a> {
    /// Number of unknowns.
    pub count: usize,
    /// Derivatives of the numbers.
    pub seeds: &'a [Seed<'a>],
}

impl Unknowns<'_> {
    /// Number of passes, one for the values where there are no unknowns.
    pub(super) fn passes(&self) -> usize {
        self.count.div_ceil(LANES).max(1)
    }

    /// Refuse derivatives by a capacity of nothing.
    pub(super) fn check_corners(&self, case: &mut Case<f64>) -> Result<(), SensitivityError> {
        let paths = self.seeds.iter().map(|seed| seed.path);
        let mut is_zero = |path: &str| case.number_mut(path).is_some_and(|number| *number == 0.0);
        match paths.filter(|path| path.ends_with(".rolling")).find(|path| is_zero(path)) {
            Some(path) => Err(SensitivityError::Corner { path: path.to_owned() }),
            None => Ok(()),
        }
    }

    /// Driveline, start and inputs of a run with the unknowns of one pass as variables.
    pub(super) fn seed<'a, const P: usize>(
        &self,
        pass: usize,
        run: usize,
        case: &Case<f64>,
        signals: &[(&'a str, Signal<'a, f64>)],
    ) -> Result<Seeded<'a, P>, SensitivityError> {
        let mut case = case.promote::<Dual<P>>();
        let mut signals: Vec<_> = signals.iter().map(|(name, s)| (*name, s.promote())).collect();
        for seed in self.seeds.iter().filter(|seed| seed.unknown / LANES == pass) {
            let number = match seed.path.strip_prefix("delay.") {
                Some(input) => {
                    let found = signals.iter_mut().find(|(name, _)| *name == input);
                    found.and_then(|(_, signal)| signal.delay_mut())
                }
                None => case.number_mut(seed.path),
            };
            let unknown = || SensitivityError::Unknown { path: seed.path.to_owned() };
            let weight = seed.weights[run % seed.weights.len()];
            number.ok_or_else(unknown)?.eps[seed.unknown % LANES] += weight;
        }
        Ok(Seeded { case, signals })
    }
}

/// Driveline, start and inputs with variables.
pub(super) struct Seeded<'a, const P: usize> {
    pub case: Case<Dual<P>>,
    pub signals: Vec<(&'a str, Signal<'a, Dual<P>>)>,
}

/// Run to be differentiated.
#[derive(Clone, Debug)]
pub struct Differentiation<'a> {
    /// Driveline.
    pub driveline: &'a Driveline<f64>,
    /// Inputs and start.
    pub scenario: Scenario<'a>,
    /// Time grid, s.
    pub grid: &'a [f64],
    /// Recorded outputs.
    pub outputs: &'a [Output],
    /// Accuracy.
    pub settings: Settings,
    /// Unknowns.
    pub unknowns: Unknowns<'a>,
}

/// A run with the derivatives of its columns and event times.
#[derive(Clone, Debug)]
pub struct Sensitivities {
    /// Values.
    pub run: Trajectory<f64>,
    /// Derivatives of every column, pass by pass: time × unknowns of the pass, the last the fastest.
    /// All passes but the last are for [`LANES`] unknowns; in that there may be room for more than
    /// were asked for, with zeros.
    pub columns: Vec<Vec<Vec<f64>>>,
    /// Derivative of every event time by every unknown: unknowns × events.
    pub events: Vec<Vec<f64>>,
}

/// A run with its derivatives by the unknowns of one pass, as in [`Sensitivities`].
struct Pass {
    run: Trajectory<f64>,
    columns: Vec<Vec<f64>>,
    events: Vec<Vec<f64>>,
}

impl Differentiation<'_> {
    /// Simulate and differentiate by the unknowns. Derivatives are undefined where an event grazes; event
    /// times differentiate implicitly.
    pub fn run(&self) -> Result<Sensitivities, SensitivityError> {
        let (driveline, start) = (self.driveline.clone(), self.scenario.start.clone());
        let mut case = Case { driveline, start };
        self.unknowns.check_corners(&mut case)?;
        let mut found: Option<Sensitivities> = None;
        for k in 0..self.unknowns.passes() {
            let count = self.unknowns.count.saturating_sub(k * LANES).min(LANES);
            let Pass { run, columns, events } = if count <= FEW {
                self.pass::<FEW>(&case, k, count)?
            } else {
                self.pass::<LANES>(&case, k, count)?
            };
            let all =
                found.get_or_insert_with(|| Sensitivities { run, columns: vec![], events: vec![] });
            all.columns.push(columns);
            all.events.extend(events);
        }
        Ok(found.expect("at least one pass"))
    }

    /// One pass for up to `P` unknowns.
    fn pass<const P: usize>(
        &self,
        case: &Case<f64>,
        pass: usize,
        count: usize,
    ) -> Result<Pass, SensitivityError> {
        let Seeded { case, signals } =
            self.unknowns.seed::<P>(pass, 0, case, &self.scenario.signals)?;
        let network = Network::compile(&case.driveline).map_err(SimulateError::from)?;
        let options = RunOptions { settings: self.settings, audit: false };
        let dual = run(&network, &signals, &case.start, self.grid, self.outputs, options)?;
        if matches!(dual.status, Status::Interrupted { .. }) {
            return Err(SimulateError::Interrupted.into());
        }
        let of_lane = |lane| dual.events.iter().map(|e| e.time.eps[lane]).collect();
        let events: Vec<Vec<f64>> = (0..count).map(of_lane).collect();
        let (run, columns) = dual.split_derivatives();
        Ok(Pass { run, columns, events })
    }
}
