// SPDX-License-Identifier: MIT
//! The closed set of elements, one file each: fields, checks, and the law in a few lines.

mod clutch;
mod engine_map;
mod gear;
mod inertia;
mod planetary;
mod road_load;
mod spring_damper;
mod torque;

pub use clutch::Clutch;
pub use engine_map::EngineMap;
pub use gear::{Gear, GearLoss};
pub use inertia::Inertia;
pub use planetary::Planetary;
pub use road_load::RoadLoad;
pub use spring_damper::SpringDamper;
pub use torque::Torque;

use super::error::ModelError;
use super::mechanism::Mechanism;
use crate::number::Real;
use serde::{Deserialize, Serialize};

macro_rules! elements {
    ($($kind:ident),* $(,)?) => {
        /// Any element of a driveline.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "type", rename_all = "snake_case")]
        pub enum Element<T> {
            $(#[doc = concat!("See [`", stringify!($kind), "`].")] $kind($kind<T>)),*
        }

        impl<T: Real> Element<T> {
            /// Unique name.
            pub fn name(&self) -> &str {
                match self { $(Self::$kind(e) => &e.name),* }
            }

            /// Refuse impossible values.
            pub fn check(&self) -> Result<(), ModelError> {
                match self { $(Self::$kind(e) => e.check()),* }
            }

            /// Add the element's law to the mechanism.
            pub fn state_law(&self, mechanism: &mut Mechanism<T>) {
                match self { $(Self::$kind(e) => e.state_law(mechanism)),* }
            }
        }
    };
}

elements!(Inertia, Gear, Planetary, Clutch, SpringDamper, RoadLoad, Torque, EngineMap);
