// SPDX-License-Identifier: MIT
//! A gear pair, with a lumped efficiency where stated (THEORY section 3).

use crate::model::error::{ModelError, require, require_apart};
use crate::model::mechanism::{Constraint, Loss, LossLaw, Mechanism};
use crate::number::Real;
use serde::{Deserialize, Serialize};

/// Lumped efficiency of a gear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GearLoss<T> {
    /// Law by name.
    pub law: LossLaw,
    /// Efficiency. Must be > 0; at most 1.5, so that fits may stray.
    pub eta: T,
}

/// `ω_a = ratio · ω_b`; the torque T_g that enters at `a` leaves at `b` as `ratio · φ(T_g)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gear<T> {
    /// Unique name.
    pub name: String,
    /// Driving node.
    pub a: String,
    /// Driven node.
    pub b: String,
    /// Speed of `a` over speed of `b`. Must not be 0.
    pub ratio: T,
    /// Loss; none if absent.
    #[serde(default = "Option::default")]
    pub loss: Option<GearLoss<T>>,
}

impl<T: Real> Gear<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        require(&self.name, "ratio", self.ratio.re(), |v| v != 0.0, "not 0")?;
        match &self.loss {
            Some(loss) => {
                require(&self.name, "eta", loss.eta.re(), |v| v > 0.0 && v <= 1.5, "in (0, 1.5]")
            }
            None => Ok(()),
        }
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, -self.ratio)]);
        let driving = m.node(&self.a);
        let loss = self.loss.as_ref().map(|l| Loss { law: l.law, eta: l.eta, driving });
        m.constraints.push(Constraint { element: self.name.clone(), row, loss });
    }
}
