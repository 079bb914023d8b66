// SPDX-License-Identifier: MIT
//! External resistance of the vehicle (paper eq. 9): grade, rolling, aerodynamic.

use crate::model::Name;
use crate::model::error::{ModelError, require, require_moving};
use crate::model::friction::FrictionLaw;
use crate::model::mechanism::{Account, Force, ForceLaw, Friction, Mechanism, Normal};
use crate::number::{Number, Values};
use serde::{Deserialize, Serialize};

/// Torque against positive speed: `constant + rolling · Sgn(ω) + aero · ω|ω|`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoadLoad<T> {
    /// Unique name.
    pub name: Name,
    /// Node of the wheel.
    pub node: Name,
    /// Independent of the direction of motion (grade, dynamometer), N·m.
    pub constant: T,
    /// Rolling resistance, opposes the motion and holds the vehicle at rest, N·m. Must be >= 0.
    pub rolling: T,
    /// ½ ρ c_d A r³, N·m·s²/rad²; one below zero drives.
    pub aero: T,
}

impl<T: Number> RoadLoad<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)?;
        require(&self.name, "constant", self.constant.re(), |_| true, "finite")?;
        require(&self.name, "rolling", self.rolling.re(), |v| v >= 0.0, ">= 0 N m")?;
        require(&self.name, "aero", self.aero.re(), |_| true, "finite")
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
