// SPDX-License-Identifier: MIT
//! A coupling with play.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart};
use crate::model::mechanism::{Mechanism, Region, Spring, SpringLaw, Stop, TwistForm};
use crate::number::{Number, Values};

described! {
    /// Coupling with play.
    ///
    /// No torque while the twist lies within the gap; beyond it a spring-damper that can only push.
    pub struct Backlash<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Driving end.
        pub a: Name = Node(),
        /// Driven end, or the ground.
        pub b: Name = Node(),
        /// Stiffness in contact.
        pub stiffness: T = Number("N·m/rad").above(0.0),
        /// Damping in contact.
        pub damping: T = Number("N·m·s/rad").at_least(0.0).preset(0.0),
        /// Total play.
        pub gap: T = Number("rad").at_least(0.0),
    }
}

impl<T: Number> Backlash<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        // No other torque than that of a spring, whose twist has no borders to cross.
        let absent = |v: T| v.is_constant() && v.re().mask_where(|v| v != 0.0) == 0;
        if absent(self.gap) && absent(self.damping) {
            let law = SpringLaw::Linear { stiffness: self.stiffness, damping: self.damping };
            m.springs.push(Spring { element: self.name.clone(), row, law });
            return;
        }
        let half_gap = self.gap * 0.5;
        let stop = |side: f64| Stop { stiffness: self.stiffness, at: half_gap * side, side };
        let stops = vec![stop(1.0), stop(-1.0)];
        let law = SpringLaw::Regions { regions: self.regions(), stops };
        m.springs.push(Spring { element: self.name.clone(), row, law });
    }

    /// Free play, then for either side: spring and damper, damping limited to the spring torque while
    /// closing fast, no torque while parting so fast that the damper would pull.
    fn regions(&self) -> Vec<Region<T>> {
        let half_gap = self.gap * 0.5;
        let form = |constant, per_twist, per_rate| TwistForm { constant, per_twist, per_rate };
        let (zero, one) = (T::zero_(), T::of(1.0));
        let nothing = form(zero, zero, zero);
        let (free, forward, backward) = (0, 1, 4);
        let mut regions = vec![Region {
            torque: nothing,
            borders: vec![
                (form(half_gap, -one, zero), forward + LIMITED),
                (form(half_gap, one, zero), backward + LIMITED),
            ],
        }];
        for (side, first) in [(1.0, forward), (-1.0, backward)] {
            let rest = half_gap * side;
            // Positive while the side is in contact; the damper's part of the same sign.
            let depth = form(-half_gap, one * side, zero);
            let (k, c) = (self.stiffness, self.damping);
            let push = form(-k * half_gap, k * side, c * side);
            let margin = form(-k * half_gap, k * side, -c * side);
            regions.push(Region {
                torque: form(-k * rest, k, c),
                borders: vec![(push, first + PARTING), (margin, first + LIMITED), (depth, free)],
            });
            regions.push(Region {
                torque: form(-k * rest * 2.0, k * 2.0, zero),
                borders: vec![(depth, free), (margin.negative(), first + SPRING)],
            });
            regions.push(Region {
                torque: nothing,
                borders: vec![(depth, free), (push.negative(), first + SPRING)],
            });
        }
        regions
    }
}

/// Order of the regions of one side.
const SPRING: usize = 0;
const LIMITED: usize = 1;
const PARTING: usize = 2;
