// SPDX-License-Identifier: MIT
//! A hydrodynamic torque converter by its steady-state map.

use crate::model::Name;
use crate::model::converter_map::ConverterMap;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::number::Number;
use std::marker::PhantomData;

described! {
    /// Hydrodynamic torque converter by its steady-state map.
    ///
    /// Couples pump and turbine, in drive and in overrun; the lock-up clutch is a clutch in parallel.
    pub struct TorqueConverter<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Node of the pump (impeller).
        pub pump: Name = Node(),
        /// Node of the turbine.
        pub turbine: Name = Node(),
        /// Steady-state map.
        pub map: ConverterMap = Group(),
        /// The map has no number with derivatives.
        #[serde(skip)]
        pub number: PhantomData<T> = Hidden(),
    }
}

impl<T: Number> TorqueConverter<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.pump, &self.turbine)?;
        require_moving(&self.name, &self.pump)?;
        require_moving(&self.name, &self.turbine)?;
        self.map.check(&self.name)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let (pump, turbine) = (m.node(&self.pump), m.node(&self.turbine));
        for (node, at_turbine) in [(pump, false), (turbine, true)] {
            let map = self.map.clone();
            let law = ForceLaw::Converter { pump, turbine, map, at_turbine };
            let (element, account) = (self.name.clone(), Account::Converter);
            m.forces.push(Force {
                element,
                nodes: Mechanism::single(node),
                law,
                lag: None,
                account,
            });
        }
    }
}
