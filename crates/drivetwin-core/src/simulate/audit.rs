// SPDX-License-Identifier: MIT
//! Where the energy of a run went.

use crate::model::mechanism::{Account, ForceLaw};
use crate::network::Network;
use crate::network::channel::form;
use crate::number::{Real, Series, evaluate};
use crate::solve::{Integrator, Step};

/// Work over a run, J: `source = stored + friction + gear_loss + shaft + load + error`.
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
    /// Energy that gears created, as a positive number; part of `gear_loss`.
    pub created: f64,
    /// What is missing in the balance.
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
pub(super) struct Auditor {
    audit: EnergyAudit,
    start: f64,
}

impl Auditor {
    /// Begin at state `x`.
    pub fn new<T: Real>(network: &Network<T>, x: &[T]) -> Self {
        Self { audit: EnergyAudit::default(), start: stored_energy(network, x) }
    }

    /// Add the work of one step.
    pub fn add<T: Real>(&mut self, run: &Integrator<'_, T>, step: &Step<T>) {
        let network = run.network;
        let gear_torques: Vec<Series<T>> = (0..network.losses.len())
            .map(|i| run.expansion.form(network, run.mode.gear_torque.row(i)))
            .collect();
        let mut x = run.x.clone();
        for (node, weight) in GAUSS {
            let h = step.length * node;
            let width = weight * step.length.re();
            run.expansion.state_at(h, &mut x);
            self.add_forces(run, &x, h, width);
            for channel in &run.expansion.channels[..network.frictions.len()] {
                let torque = evaluate(&channel.torque, run.expansion.order, h);
                let slip = evaluate(&channel.speed, run.expansion.order, h);
                self.audit.friction += (torque * slip).re() * width;
            }
            for (spring, i) in network.mechanism.springs.iter().zip(0..) {
                let rate = form(network.twist_rates.row(i), &x);
                self.audit.shaft += (spring.damping * rate * rate).re() * width;
            }
            for (i, loss) in network.losses.iter().enumerate() {
                let torque = evaluate(&gear_torques[i], run.expansion.order, h);
                let power = (torque * form(&loss.speed, &x)).re();
                let eta = loss.eta.re();
                let backward = network.is_directional(i) && power < 0.0;
                let lost = power * (1.0 - if backward { eta.recip() } else { eta }) * width;
                self.audit.gear_loss += lost;
                self.audit.created += (-lost).max(0.0);
            }
        }
    }

    fn add_forces<T: Real>(&mut self, run: &Integrator<'_, T>, x: &[T], h: T, width: f64) {
        let network = run.network;
        let n = &network.coordinates.speeds;
        let mut channel = network.frictions.len();
        for force in &network.mechanism.forces {
            let torque = match force.law {
                ForceLaw::Input(i) => {
                    let [value, rate] = run.expansion.inputs[i];
                    value + rate * h
                }
                ForceLaw::Constant(torque) => torque,
                ForceLaw::Quadratic(_) | ForceLaw::Map { .. } => {
                    channel += 1;
                    let series = &run.expansion.channels[channel - 1].torque;
                    evaluate(series, run.expansion.order, h)
                }
            };
            let work = (torque * form(n.row(force.node), x)).re() * width;
            match force.account {
                Account::Source => self.audit.source += work,
                Account::Load => self.audit.load -= work,
            }
        }
    }

    /// Close the balance at state `x`.
    pub fn close<T: Real>(mut self, network: &Network<T>, x: &[T]) -> EnergyAudit {
        let a = &mut self.audit;
        a.stored = stored_energy(network, x) - self.start;
        a.error = a.source - a.stored - a.friction - a.gear_loss - a.shaft - a.load;
        self.audit
    }
}

fn stored_energy<T: Real>(network: &Network<T>, x: &[T]) -> f64 {
    let mut energy = 0.0;
    for i in 0..network.speeds() {
        energy += 0.5 * (x[i] * form(network.mass.row(i), x)).re();
    }
    for (spring, twist) in network.mechanism.springs.iter().zip(&x[network.speeds()..]) {
        energy += 0.5 * (spring.stiffness * *twist * *twist).re();
    }
    energy
}
