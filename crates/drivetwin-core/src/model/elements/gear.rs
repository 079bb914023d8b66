// SPDX-License-Identifier: MIT
//! A gear pair, with a lumped efficiency where stated (THEORY section 3).

use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart, require_moving};
use crate::model::mechanism::{Constraint, Loss, LossLaw, Mechanism};
use crate::model::{LossTable, Name};
use crate::number::{Number, Values};

described! {
    /// Lumped efficiency of a gear.
    pub struct GearLoss<T> {
        /// Loss law: `paper` applies `eta` in either direction of power, `dissipative` by direction.
        pub law: LossLaw = Text().one_of(LossLaw::NAMES),
        // At most 1.5 rather than 1, so that a fit may pass through impossible values.
        /// Efficiency with power from `a` to `b`.
        pub eta: T = Number().above(0.0).at_most(1.5),
        /// Efficiency with power from `b` to `a`. A low value makes the gear self-locking.
        pub eta_backward: Option<T> = Number().above(0.0).at_most(1.5).absent("eta"),
        /// Drag torque at `a` with power from `a` to `b`.
        pub drag: Option<T> = Number("N·m").at_least(0.0).absent("0"),
        /// Drag torque at `a` with power from `b` to `a`.
        pub drag_backward: Option<T> = Number("N·m").at_least(0.0).absent("drag"),
    }
}

impl<T: Number> GearLoss<T> {
    /// A loss by its efficiency alone.
    pub fn by_efficiency(law: LossLaw, eta: T) -> Self {
        Self { law, eta, eta_backward: None, drag: None, drag_backward: None }
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

described! {
    /// Gear pair, with losses where stated.
    ///
    /// `ω_a = ratio · ω_b`; the torque T_g that enters at `a` leaves at `b` as `ratio · φ(T_g)`.
    pub struct Gear<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Driving node.
        pub a: Name = Node(),
        /// Driven node.
        pub b: Name = Node(),
        /// Speed of `a` over speed of `b`.
        pub ratio: T = Number().not(&[0.0]),
        /// Lumped efficiency.
        pub loss: Option<GearLoss<T>> = Group().absent("no loss"),
        /// Loss torque at `a` over its speed and the torque that enters there; taken off before `loss`.
        pub losses: Option<LossTable> = Group().absent("no loss"),
    }
}

impl<T: Number> Gear<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
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
