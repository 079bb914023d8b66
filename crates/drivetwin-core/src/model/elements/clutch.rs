// SPDX-License-Identifier: MIT
//! A friction clutch, or a brake where one side is the ground (paper eqs. 4-6).

use crate::model::error::{ModelError, require, require_apart};
use crate::model::friction::FrictionLaw;
use crate::model::mechanism::{Friction, Inertia, Mechanism, Normal};
use crate::model::{DragTable, Name};
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// Slip `s = ω_a - ω_b`; torque `cap · Sgn(s)` on `b`, opposite on `a`;
/// `cap = μ(|s|) · gain · max(0, P - P0)`, static `peak · μ(0) · gain · max(0, P - P0)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clutch<T> {
    /// Unique name.
    pub name: Name,
    /// Driving side.
    pub a: Name,
    /// Driven side, or the ground for a brake.
    pub b: Name,
    /// μ over |slip|.
    pub friction: FrictionLaw<T>,
    /// N·D·A·r: surfaces, de-rating, area, effective radius, m³. Must be >= 0.
    pub gain: T,
    /// Pressure at which the fill ends, Pa.
    pub p0: T,
    /// Static over kinetic capacity at zero slip. Must be >= 1.
    pub peak: T,
    /// Name of the pressure input, Pa.
    pub pressure: Name,
    /// Inertia that turns with the slip (a brake's drum in the dual-clutch picture,
    /// THEORY section 2), kg·m². Must be >= 0.
    pub drum_inertia: T,
    /// Drag torque over the slip, beside the friction; none if absent.
    #[serde(default)]
    pub drag: Option<DragTable>,
}

impl<T: Number> Clutch<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        self.friction.check(&self.name)?;
        self.drag.as_ref().map_or(Ok(()), |drag| drag.check(&self.name))?;
        require(&self.name, "gain", self.gain.re(), |v| v >= 0.0, ">= 0 m^3")?;
        require(&self.name, "p0", self.p0.re(), |_| true, "finite")?;
        require(&self.name, "peak", self.peak.re(), |v| v >= 1.0, ">= 1")?;
        require(&self.name, "drum_inertia", self.drum_inertia.re(), |v| v >= 0.0, ">= 0 kg m^2")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let normal =
            Normal::Pressure { input: m.input(&self.pressure), gain: self.gain, p0: self.p0 };
        if let Some(drag) = &self.drag {
            m.add_loss(&self.name, row.clone(), None, drag.map());
        }
        m.inertias.push(Inertia {
            element: self.name.clone(),
            row: row.clone(),
            inertia: self.drum_inertia,
        });
        m.frictions.push(Friction {
            element: self.name.clone(),
            row,
            law: self.friction.clone(),
            normal,
            peak: self.peak,
            one_way: false,
        });
    }
}
