// SPDX-License-Identifier: MIT
//! A gear pair, with a lumped efficiency where stated (THEORY section 3).

use crate::model::error::{ModelError, require, require_apart, require_moving};
use crate::model::mechanism::{Constraint, Loss, LossLaw, Mechanism};
use crate::model::{LossTable, Name};
use crate::number::{Number, Values};
use serde::{Deserialize, Serialize};

/// Lumped efficiency of a gear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GearLoss<T> {
    /// Law by name.
    pub law: LossLaw,
    /// Efficiency with power from `a` to `b`. Must be > 0; at most 1.5, so that fits may stray.
    pub eta: T,
    /// Efficiency with power from `b` to `a`; as `eta` if absent. A low value makes the gear
    /// self-locking.
    #[serde(default = "Option::default")]
    pub eta_backward: Option<T>,
    /// Drag torque at `a` with power from `a` to `b`, N·m; none if absent. Must be >= 0.
    #[serde(default = "Option::default")]
    pub drag: Option<T>,
    /// Drag torque at `a` with power from `b` to `a`, N·m; as `drag` if absent. Must be >= 0.
    #[serde(default = "Option::default")]
    pub drag_backward: Option<T>,
}

impl<T: Number> GearLoss<T> {
    /// A loss by its efficiency alone.
    pub fn by_efficiency(law: LossLaw, eta: T) -> Self {
        Self { law, eta, eta_backward: None, drag: None, drag_backward: None }
    }

    fn check(&self, element: &str) -> Result<(), ModelError> {
        let efficient = |v: f64| v > 0.0 && v <= 1.5;
        require(element, "eta", self.eta.re(), efficient, "in (0, 1.5]")?;
        let backward = self.eta_backward.unwrap_or(self.eta);
        require(element, "eta_backward", backward.re(), efficient, "in (0, 1.5]")?;
        for drag in [self.drag, self.drag_backward].into_iter().flatten() {
            require(element, "drag", drag.re(), |v| v >= 0.0, ">= 0 N m")?;
        }
        Ok(())
    }

    fn state(&self, driving: usize) -> Loss<T> {
        let eta_backward = self.eta_backward.unwrap_or(self.eta);
        let drag = self.drag.unwrap_or(T::zero_());
        let drag_backward = self.drag_backward.unwrap_or(drag);
        // Lines that are parallel meet nowhere: the larger loss counts whatever the torque, as it does at any
        // given one where they all but are.
        let parallel = (self.eta - eta_backward.recip()).re().decide(|slope| slope == 0.0);
        let least = drag.re().decide_with(drag_backward.re(), |forward, back| forward < back);
        let (drag, drag_backward) = match (parallel, least) {
            (true, true) => (drag_backward, drag_backward),
            (true, false) => (drag, drag),
            (false, _) => (drag, drag_backward),
        };
        Loss { law: self.law, eta: self.eta, eta_backward, drag, drag_backward, driving }
    }
}

/// `ω_a = ratio · ω_b`; the torque T_g that enters at `a` leaves at `b` as `ratio · φ(T_g)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gear<T> {
    /// Unique name.
    pub name: Name,
    /// Driving node.
    pub a: Name,
    /// Driven node.
    pub b: Name,
    /// Speed of `a` over speed of `b`. Must not be 0.
    pub ratio: T,
    /// Loss; none if absent.
    #[serde(default = "Option::default")]
    pub loss: Option<GearLoss<T>>,
    /// Loss torque at `a` over its speed and the torque that enters there; taken off before
    /// `loss`.
    #[serde(default)]
    pub losses: Option<LossTable>,
}

impl<T: Number> Gear<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        require(&self.name, "ratio", self.ratio.re(), |v| v != 0.0, "not 0")?;
        self.loss.as_ref().map_or(Ok(()), |loss| loss.check(&self.name))?;
        let Some(losses) = &self.losses else { return Ok(()) };
        require_moving(&self.name, &self.a)?;
        losses.check(&self.name)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, -self.ratio)]);
        let driving = m.node(&self.a);
        let loss = self.loss.as_ref().map(|loss| loss.state(driving));
        if let Some(losses) = &self.losses {
            let slip = Mechanism::single(driving);
            m.add_loss(&self.name, slip, Some(m.constraints.len()), losses.map());
        }
        m.constraints.push(Constraint { element: self.name.clone(), row, loss });
    }
}
