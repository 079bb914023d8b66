// SPDX-License-Identifier: MIT
//! Energy balance of a run.

use crate::model::mechanism::{Account, ForceLaw, SpringLaw, Stop};
use crate::network::nonlinear_torque::form;
use crate::network::{GearState, Network};
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

/// Nodes and weights of Gauss-Legendre quadrature with four points on [0, 1].
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Accumulates the audit step by step.
pub(super) struct EnergyBalance {
    audit: EnergyAudit,
    start: f64,
}

impl EnergyBalance {
    /// Begin at state `x`.
    pub fn new<T: Real>(network: &Network<T>, x: &[T]) -> Self {
        Self { audit: EnergyAudit::default(), start: stored_energy(network, x) }
    }

    /// Add the work of one step.
    pub fn add<T: Real>(&mut self, run: &Integrator<'_, T>, step: &Step<T>) {
        let mut basis = Vec::new();
        for (node, weight) in GAUSS {
            run.state.expansion.basis_at(run.state.network, step.length * node, &mut basis);
            self.add_powers(run, &basis, weight * step.length.re());
        }
    }

    fn add_powers<T: Real>(&mut self, run: &Integrator<'_, T>, basis: &[T], width: f64) {
        let network = run.state.network;
        let speed = |node| form(&network.over_basis(&[(node, T::of(1.0))]), basis);
        let audit = &mut self.audit;
        for (j, row) in network.frictions.iter().enumerate() {
            let torque = basis[network.first_channel() + j];
            audit.friction += (torque * form(&row.slip, basis)).re() * width;
        }
        for force in &network.mechanism.forces {
            if let ForceLaw::Constant(torque) = force.law {
                audit.load -= (torque * speed(force.node)).re() * width;
            }
        }
        for drive in &network.applied_torques {
            let along = drive
                .nodes
                .iter()
                .fold(T::zero_(), |sum, &(node, direction)| sum + direction * speed(node));
            let work = (basis[drive.basis] * along).re() * width;
            match drive.account {
                Some(Account::Source) => audit.source += work,
                Some(Account::Load) => audit.load -= work,
                Some(Account::Converter) => audit.converter -= work,
                None => audit.shaft -= work,
            }
        }
        for (i, spring) in network.mechanism.springs.iter().enumerate() {
            let rate = form(network.twist_rates.row(i), basis);
            let twist = basis[network.speeds() + i];
            audit.shaft += width
                * match &spring.law {
                    SpringLaw::Linear { damping, .. } => (*damping * rate * rate).re(),
                    // The work of the channel less what the stops store.
                    SpringLaw::Regions { stops, .. } => {
                        let stored =
                            |stop: &Stop<T>| depth(stop, twist) * stop.stiffness * stop.side;
                        -stops.iter().map(|stop| (stored(stop) * rate).re()).sum::<f64>()
                    }
                };
        }
        for (i, (speed, _)) in network.prescribed.iter().enumerate() {
            let reaction =
                form(run.state.mode.stuck_torque.row(run.state.mode.stuck.len() + i), basis);
            audit.source -= (reaction * form(speed, basis)).re() * width;
        }
        self.add_gear_losses(run, basis, width);
    }

    fn add_gear_losses<T: Real>(&mut self, run: &Integrator<'_, T>, basis: &[T], width: f64) {
        for (i, gear) in run.state.network.losses.iter().enumerate() {
            let torque = form(run.state.mode.gear_torque(run.state.network).row(i), basis);
            let speed = form(&gear.speed, basis);
            let lost = match run.state.gears[i] {
                GearState::Locked => 0.0,
                GearState::Meshing { sign, power_reversed } => {
                    (gear.loss.loss_torque(torque, sign, power_reversed) * speed).re() * width
                }
            };
            self.audit.gear_loss += lost;
            self.audit.created += (-lost).max(0.0);
        }
    }

    /// Close the balance at the state reached.
    pub fn close<T: Real>(mut self, state: &HybridState<'_, T>) -> EnergyAudit {
        let a = &mut self.audit;
        a.source += state.starting_impulse.source.re();
        a.impulse = state.starting_impulse.lost.re();
        a.stored = stored_energy(state.network, &state.x) - self.start;
        let taken =
            a.stored + a.friction + a.gear_loss + a.shaft + a.load + a.converter + a.impulse;
        a.error = a.source - taken;
        self.audit
    }
}

/// Compression of a stop, rad.
fn depth<T: Real>(stop: &Stop<T>, twist: T) -> T {
    let depth = (twist - stop.at) * stop.side;
    if depth.re() > 0.0 { depth } else { T::zero_() }
}

fn stored_energy<T: Real>(network: &Network<T>, x: &[T]) -> f64 {
    let mut energy = 0.0;
    for i in 0..network.speeds() {
        energy += 0.5 * (x[i] * form(network.mass.row(i), x)).re();
    }
    for (spring, &twist) in network.mechanism.springs.iter().zip(&x[network.speeds()..]) {
        energy += match &spring.law {
            SpringLaw::Linear { stiffness, .. } => 0.5 * (*stiffness * twist * twist).re(),
            SpringLaw::Regions { stops, .. } => {
                let stored = |stop: &Stop<T>| {
                    let depth = depth(stop, twist);
                    depth * depth * stop.stiffness * 0.5
                };
                stops.iter().map(|stop| stored(stop).re()).sum()
            }
        };
    }
    energy
}
