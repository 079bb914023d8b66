// SPDX-License-Identifier: MIT
//! Choice between Taylor steps and implicit steps.

use crate::number::Real;
use crate::solver::hybrid::collocation::{NewtonInverse, supports_implicit_steps};
use crate::solver::hybrid::state::HybridState;
use crate::solver::settings::Accuracy;

/// Taylor steps in a row that the motion shortens before an implicit step is tried: a fast part that decays
/// is then below round-off.
const MIN_SHORTENED: usize = 40;
/// Most of these after implicit steps have failed.
const MAX_SHORTENED: usize = 5000;
/// Length of an implicit step that is worth its work, in Taylor steps.
const WORTH_WHILE: f64 = 10.0;
/// Lengths tried before the run returns to Taylor steps.
const MAX_TRIALS: usize = 5;

/// Least factor by which an implicit step grows: as long as it keeps its length, so do its matrices.
const MIN_GROWTH: f64 = 1.5;

/// Steps of a run whose motion is stiff.
#[derive(Clone, Debug)]
pub(crate) struct Stiffness<T> {
    shortened: ShortenedSteps,
    /// Number of these before the next trial.
    wait: usize,
    /// Length of the next implicit step [s] while the run takes these.
    implicit: Option<f64>,
    /// Matrix of the last implicit step.
    kept: Option<NewtonInverse<T>>,
}

/// Taylor steps in a row that the motion shortened.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShortenedSteps {
    count: usize,
    /// Length of the last, s.
    length: f64,
}

impl ShortenedSteps {
    /// Record a Taylor step of length `h` [s] where `wish` was possible.
    pub fn note(&mut self, h: f64, wish: f64) {
        *self = Self { count: if h * WORTH_WHILE < wish { self.count + 1 } else { 0 }, length: h };
    }

    /// Record an event: the fast part of the motion may move again.
    pub fn note_event(&mut self) {
        self.count = 0;
    }

    /// Return true if an implicit step is due.
    pub fn is_stiff(&self) -> bool {
        self.count >= MIN_SHORTENED
    }
}

/// A step of the expansion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExpandedStep {
    /// Length, s.
    pub length: f64,
    /// Work, in Taylor steps.
    pub work: f64,
}

impl<T: Real> Stiffness<T> {
    /// Detector of a run that takes Taylor steps.
    pub fn new() -> Self {
        let shortened = ShortenedSteps::default();
        Self { shortened, wait: MIN_SHORTENED, implicit: None, kept: None }
    }

    /// Record an event.
    pub fn note_event(&mut self) {
        self.shortened.note_event();
        self.implicit = None;
    }

    /// Expand up to `wish` [s] by an implicit step if the motion is stiff, else by a Taylor step.
    pub fn expand(
        &mut self,
        state: &mut HybridState<'_, T>,
        wish: f64,
        accuracy: Accuracy,
    ) -> ExpandedStep {
        let mut work = 0.0;
        if let Some(length) = self.try_implicit(state, wish, accuracy, &mut work) {
            return ExpandedStep { length, work };
        }
        let length = state.expand(1, wish, accuracy);
        self.shortened.note(length, wish);
        ExpandedStep { length, work: work + 1.0 }
    }

    fn try_implicit(
        &mut self,
        state: &mut HybridState<'_, T>,
        wish: f64,
        accuracy: Accuracy,
        work: &mut f64,
    ) -> Option<f64> {
        let due = self.implicit.is_some() || self.shortened.count >= self.wait;
        let possible = accuracy.order.is_none() && supports_implicit_steps(state.network);
        let least = WORTH_WHILE * self.shortened.length;
        if !due || !possible || wish <= least {
            return None;
        }
        let mut h = divide(wish, self.implicit.unwrap_or(4.0 * least));
        for _ in 0..MAX_TRIALS {
            let step = state.collocate(h, accuracy.tolerance, &mut self.kept);
            *work += step.work;
            let change = step.change(accuracy.tolerance);
            if step.error <= accuracy.tolerance && h <= step.stable {
                let factor = if (0.9..MIN_GROWTH).contains(&change) { 1.0 } else { change };
                self.implicit = Some((factor * h).min(step.stable));
                self.wait = MIN_SHORTENED;
                if h < step.work * self.shortened.length {
                    self.retreat();
                }
                return Some(h);
            }
            h = divide(wish, (change * h).min(0.5 * h).min(step.stable));
            if h < least {
                break;
            }
        }
        self.retreat();
        None
    }

    /// Return to Taylor steps, for longer each time that this follows another.
    fn retreat(&mut self) {
        self.wait = (2 * self.wait).min(MAX_SHORTENED);
        (self.implicit, self.shortened.count) = (None, 0);
    }
}

/// Length of the equal parts of `whole` that are no longer than `most` [s].
fn divide(whole: f64, most: f64) -> f64 {
    whole / (whole / most - 1e-6).ceil().max(1.0)
}
