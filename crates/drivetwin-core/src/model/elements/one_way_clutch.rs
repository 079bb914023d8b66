// SPDX-License-Identifier: MIT
//! A one-way clutch (freewheel), with a friction clutch beside it where a pressure is named.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart};
use crate::model::friction::FrictionLaw;
use crate::model::mechanism::{Friction, Mechanism, Normal};
use crate::number::Number;

described! {
    /// One-way clutch (freewheel), with a friction clutch in parallel where stated.
    ///
    /// `a` can drive `b` forward with any torque and cannot overrun it: slip `ω_a - ω_b ≤ 0`.
    /// Against the free direction acts the capacity of the parallel clutch.
    pub struct OneWayClutch<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Driving side.
        pub a: Name = Node(),
        /// Driven side, or the ground.
        pub b: Name = Node(),
        /// Parallel clutch.
        pub clutch: Option<ParallelClutch<T>> = Group().absent("none"),
    }
}

described! {
    /// Friction clutch parallel to a one-way clutch.
    pub struct ParallelClutch<T> {
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
    }
}

impl<T: Number> OneWayClutch<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        self.clutch.as_ref().map_or(Ok(()), |clutch| clutch.friction.check(&self.name))
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let (law, normal, peak) = match &self.clutch {
            Some(c) => {
                let input = m.input(&c.pressure);
                (c.friction.clone(), Normal::Pressure { input, gain: c.gain, p0: c.p0 }, c.peak)
            }
            None => (FrictionLaw::constant(T::of(1.0)), Normal::Constant(T::zero_()), T::of(1.0)),
        };
        let element = self.name.clone();
        m.frictions.push(Friction { element, row, law, normal, peak, one_way: true });
    }
}
