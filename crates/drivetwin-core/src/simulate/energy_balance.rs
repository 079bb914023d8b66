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
    /// Largest energy stored and largest work of an account so far, J.
    largest: f64,
}

impl EnergyBalance {
    /// Begin at state `x`.
    pub fn new<T: Real>(network: &Network<T>, x: &[T]) -> Self {
        let start = stored_energy(network, x);
        Self { audit: EnergyAudit::default(), start, largest: start }
    }

    /// Add the work of one step.
    pub fn add<T: Real>(&mut self, run: &Integrator<'_, T>, step: &Step<T>) {
        let mut basis = Vec::new();
        for (node, weight) in GAUSS {
            run.state.expansion.basis_at(run.state.network, step.length * node, &mut basis);
            self.add_powers(run, &basis, weight * step.length.re());
        }
        let a = &self.audit;
        let works = [a.source, a.friction, a.gear_loss, a.shaft, a.load, a.converter];
        let stored = stored_energy(run.state.network, &run.state.x);
        self.largest = works.iter().fold(self.largest.max(stored), |most, w| most.max(w.abs()));
    }

    fn add_powers<T: Real>(&mut self, run: &Integrator<'_, T>, basis: &[T], width: f64) {
        let audit = &mut self.audit;
        visit_powers(&run.state, basis, None, |kind, power| {
            let work = power.re() * width;
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
    }

    /// Close the balance at the state reached; return it and the largest energy of the run, J.
    pub fn close<T: Real>(mut self, state: &HybridState<'_, T>) -> (EnergyAudit, f64) {
        let a = &mut self.audit;
        a.source += state.starting_impulse.source.re();
        a.impulse = state.starting_impulse.lost.re();
        a.stored = stored_energy(state.network, &state.x) - self.start;
        let taken =
            a.stored + a.friction + a.gear_loss + a.shaft + a.load + a.converter + a.impulse;
        a.error = a.source - taken;
        let impulse = a.impulse.abs().max(state.starting_impulse.source.re().abs());
        (self.audit, self.largest.max(impulse))
    }
}

fn stored_energy<T: Real>(network: &Network<T>, x: &[T]) -> f64 {
    let kinetic = (0..network.speeds()).map(|i| 0.5 * (x[i] * form(network.mass.row(i), x)).re());
    let springs = network.mechanism.springs.iter().zip(&x[network.speeds()..]);
    kinetic.sum::<f64>()
        + springs.map(|(spring, &twist)| spring_energy(&spring.law, twist).re()).sum::<f64>()
}
