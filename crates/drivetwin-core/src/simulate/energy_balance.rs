// SPDX-License-Identifier: MIT
//! Energy balance of a run.

use super::element_power::{GAUSS, PowerKind, spring_energy, visit_powers};
use crate::network::Network;
use crate::network::nonlinear_torque::form;
use crate::number::Real;
use crate::solver::{HybridState, Integrator, Step};

/// Work over a run, J: `source = stored + friction + gear_loss + shaft + load + converter + impulse + error`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyAudit {
    /// Work of the sources.
    pub source: f64,
    /// Gain of kinetic and elastic energy.
    pub stored: f64,
    /// Friction heat of clutches, brakes and rolling.
    pub friction: f64,
    /// Loss in gears; negative where the `paper` law creates energy.
    pub gear_loss: f64,
    /// Heat of dampers.
    pub shaft: f64,
    /// Work against loads.
    pub load: f64,
    /// Heat of torque converters.
    pub converter: f64,
    /// Energy lost in the impulse of the start.
    pub impulse: f64,
    /// Energy that gears created, as a positive number; part of `gear_loss`.
    pub created: f64,
    /// Residual of the balance.
    pub error: f64,
}

/// Accumulates the audit step by step.
pub(super) struct EnergyBalance {
    audit: EnergyAudit,
    start: f64,
    scale: BalanceScale,
    /// Speed that the run does not distinguish from zero, relative to the largest speed and 1 rad/s.
    resolution: f64,
}

/// Energies that the error of a balance is judged by, J.
#[derive(Clone, Copy, Debug)]
pub(super) struct BalanceScale {
    /// Largest energy stored and largest work of an account.
    pub largest: f64,
    /// Energy of all members and work of all torques at the speed that the run does not distinguish from zero.
    pub unresolved: f64,
}

impl EnergyBalance {
    /// Begin at state `x`, in a run that resolves speeds to `resolution` of the largest and 1 rad/s.
    pub fn new<T: Real>(network: &Network<T>, x: &[T], resolution: f64) -> Self {
        let start = stored_energy(network, x);
        let mass = (0..network.speeds()).map(|i| network.mass[(i, i)].re());
        let unresolved = resolution * speed_scale(network, x);
        let unresolved = 0.5 * mass.sum::<f64>() * unresolved * unresolved;
        let scale = BalanceScale { largest: start, unresolved };
        Self { audit: EnergyAudit::default(), start, scale, resolution }
    }

    /// Add the work of one step.
    pub fn add<T: Real>(&mut self, run: &Integrator<'_, T>, step: &Step<T>) {
        let mut basis = Vec::new();
        for (node, weight) in GAUSS {
            run.state.expansion.basis_at(run.state.network, step.length * node, &mut basis);
            self.add_powers(run, &basis, weight * step.length.re());
        }
        let a = &self.audit;
        let scale = &mut self.scale;
        let works = [a.source, a.friction, a.gear_loss, a.shaft, a.load, a.converter];
        let stored = stored_energy(run.state.network, &run.state.x);
        scale.largest = works.iter().fold(scale.largest.max(stored), |most, w| most.max(w.abs()));
    }

    fn add_powers<T: Real>(&mut self, run: &Integrator<'_, T>, basis: &[T], width: f64) {
        let HybridState { network, mode, .. } = &run.state;
        let held = (0..mode.stuck.len()).map(|i| form(mode.stuck_torque.row(i), basis).re().abs());
        let mut torques = held.sum::<f64>();
        let audit = &mut self.audit;
        visit_powers(&run.state, basis, None, |kind, torque, speed| {
            torques += torque.re().abs();
            let work = (torque * speed).re() * width;
            match kind {
                PowerKind::Source => audit.source += work,
                PowerKind::Load => audit.load += work,
                PowerKind::Friction => audit.friction += work,
                PowerKind::Damper => audit.shaft += work,
                PowerKind::Converter => audit.converter += work,
                PowerKind::Gear => {
                    audit.gear_loss += work;
                    audit.created += (-work).max(0.0);
                }
            }
        });
        self.scale.unresolved += self.resolution * speed_scale(network, basis) * torques * width;
    }

    /// Close the balance at the state reached.
    pub fn close<T: Real>(mut self, state: &HybridState<'_, T>) -> (EnergyAudit, BalanceScale) {
        let a = &mut self.audit;
        a.source += state.starting_impulse.source.re();
        a.impulse = state.starting_impulse.lost.re();
        a.stored = stored_energy(state.network, &state.x) - self.start;
        let taken =
            a.stored + a.friction + a.gear_loss + a.shaft + a.load + a.converter + a.impulse;
        a.error = a.source - taken;
        let impulse = a.impulse.abs().max(state.starting_impulse.source.re().abs());
        self.scale.largest = self.scale.largest.max(impulse);
        (self.audit, self.scale)
    }
}

/// Scale of the speeds at an instant: the largest, at least 1 rad/s.
fn speed_scale<T: Real>(network: &Network<T>, x: &[T]) -> f64 {
    x[..network.speeds()].iter().fold(1.0, |largest, speed| speed.re().abs().max(largest))
}

fn stored_energy<T: Real>(network: &Network<T>, x: &[T]) -> f64 {
    let kinetic = (0..network.speeds()).map(|i| 0.5 * (x[i] * form(network.mass.row(i), x)).re());
    let springs = network.mechanism.springs.iter().zip(&x[network.speeds()..]);
    kinetic.sum::<f64>()
        + springs.map(|(spring, &twist)| spring_energy(&spring.law, twist).re()).sum::<f64>()
}
