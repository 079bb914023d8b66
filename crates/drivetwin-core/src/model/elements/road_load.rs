// SPDX-License-Identifier: MIT
//! External resistance of the vehicle (paper eq. 9): grade, rolling, aerodynamic.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_moving};
use crate::model::friction::FrictionLaw;
use crate::model::mechanism::{Account, Force, ForceLaw, Friction, Mechanism, Normal};
use crate::number::{Number, Values};

described! {
    /// External resistance of the vehicle: grade, rolling, aerodynamic.
    ///
    /// Torque against positive speed: `constant + rolling · Sgn(ω) + aero · ω|ω|`.
    pub struct RoadLoad<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Node of the wheel.
        pub node: Name = Node(),
        /// Torque independent of the direction of motion: grade, dynamometer.
        pub constant: T = Number("N·m").preset(0.0),
        /// Rolling resistance; opposes the motion and holds the vehicle at rest.
        pub rolling: T = Number("N·m").at_least(0.0).preset(0.0),
        /// Aerodynamic coefficient ½ ρ c_d A r³; a negative one drives.
        pub aero: T = Number("N·m·s²/rad²").preset(0.0),
    }
}

impl<T: Number> RoadLoad<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let node = m.node(&self.node);
        let mut force = |law| {
            let (element, account) = (self.name.clone(), Account::Load);
            m.forces.push(Force {
                element,
                nodes: Mechanism::single(node),
                law,
                lag: None,
                account,
            });
        };
        force(ForceLaw::Constant(-self.constant));
        // Also where it is zero and something is differentiated by it.
        if !self.aero.is_constant() || self.aero.re().decide(|v| v != 0.0) {
            force(ForceLaw::Quadratic { coefficient: -self.aero, node });
        }
        if self.rolling.re().decide(|v| v != 0.0) {
            let row = m.row(&[(&self.node, T::of(1.0))]);
            m.frictions.push(Friction {
                element: self.name.clone(),
                row,
                law: FrictionLaw::constant(T::of(1.0)),
                normal: Normal::Constant(self.rolling),
                peak: T::of(1.0),
                one_way: false,
            });
        }
    }
}
