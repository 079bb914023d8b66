// SPDX-License-Identifier: MIT
//! A friction clutch, or a brake where one side is the ground (paper eqs. 4-6).

use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart};
use crate::model::friction::FrictionLaw;
use crate::model::mechanism::{Friction, Inertia, Mechanism, Normal};
use crate::model::{DragTable, Name};
use crate::number::Number;

described! {
    /// Friction clutch, or a brake where `b` is the ground.
    ///
    /// Slip `s = ω_a - ω_b`; torque `cap · Sgn(s)` on `b`, opposite on `a`;
    /// `cap = μ(|s|) · gain · max(0, P - P0)`, static `peak · μ(0) · gain · max(0, P - P0)`.
    pub struct Clutch<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Driving side.
        pub a: Name = Node(),
        /// Driven side, or the ground for a brake.
        pub b: Name = Node(),
        /// Friction coefficient over the magnitude of the slip.
        pub friction: FrictionLaw<T> = Group(),
        /// Product of surfaces, de-rating, area and effective radius.
        pub gain: T = Number("m³").at_least(0.0).preset(1.0),
        /// Pressure at which the fill ends.
        pub p0: T = Number("Pa").preset(0.0),
        /// Static over kinetic capacity at zero slip.
        pub peak: T = Number().at_least(1.0).preset(1.0),
        /// Pressure input.
        pub pressure: Name = Input("Pa"),
        /// Inertia that turns with the slip (docs/theory.md, section 2), such as the drum of a brake.
        pub drum_inertia: T = Number("kg·m²").at_least(0.0).preset(0.0),
        /// Drag torque over the slip, beside the friction.
        pub drag: Option<DragTable> = Group().absent("no drag"),
    }
}

impl<T: Number> Clutch<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        self.friction.check(&self.name)?;
        self.drag.as_ref().map_or(Ok(()), |drag| drag.check(&self.name))
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
