// SPDX-License-Identifier: MIT
//! A compliant shaft whose stiffness depends on its twist.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart};
use crate::model::mechanism::{Mechanism, Region, Spring, SpringLaw, Stop, TwistForm};
use crate::number::{Number, Values};

described! {
    /// Compliant shaft whose stiffness depends on its twist.
    ///
    /// `twist' = ω_a - ω_b`; torque on `b` linear between points of the twist, plus `damping · twist'`.
    pub struct SpringTable<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Driving end.
        pub a: Name = Node(),
        /// Driven end, or the ground.
        pub b: Name = Node(),
        /// Twist: at least two points, increasing through 0; the first and last piece go on beyond the table.
        pub twist: Vec<f64> = Axis("rad"),
        /// Torque at each twist, not falling; 0 at twist 0.
        pub torque: Vec<T> = Numbers("N·m"),
        /// Damping.
        pub damping: T = Number("N·m·s/rad").at_least(0.0).preset(0.0),
    }
}

impl<T: Number> SpringTable<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        let fault = |problem| {
            let element = self.name.to_string();
            Err(ModelError::Table { element, table: "spring table", problem })
        };
        if self.twist.len() < 2 || self.twist.len() != self.torque.len() {
            return fault("needs as many twists as torques, at least two");
        }
        if !self.twist.iter().all(|twist| twist.is_finite())
            || !self.twist.windows(2).all(|w| w[0] < w[1])
        {
            return fault("must have finite twists that increase");
        }
        if !self.torque.iter().all(|torque| torque.re().decide(f64::is_finite)) {
            return fault("has a torque that is not finite");
        }
        let falls = |w: &[T]| w[1].re().decide_with(w[0].re(), |next, torque| next < torque);
        if self.torque.windows(2).any(falls) {
            return fault("must have torques that do not fall");
        }
        let rest = self.twist.iter().position(|&twist| twist == 0.0);
        if !rest.is_some_and(|rest| self.torque[rest].re().decide(|torque| torque == 0.0)) {
            return fault("must contain twist 0 with torque 0");
        }
        Ok(())
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let law = SpringLaw::Regions { regions: self.regions(), stops: self.stops() };
        m.springs.push(Spring { element: self.name.clone(), row, law });
    }

    /// Stiffness of piece `i`.
    fn slope(&self, i: usize) -> T {
        (self.torque[i + 1] - self.torque[i]) / (self.twist[i + 1] - self.twist[i])
    }

    fn regions(&self) -> Vec<Region<T>> {
        let last = self.twist.len() - 2;
        let border = |at: f64, side: f64| TwistForm {
            constant: T::of(-at * side),
            per_twist: T::of(side),
            per_rate: T::zero_(),
        };
        let region = |i: usize| {
            let slope = self.slope(i);
            let mut borders = Vec::with_capacity(2);
            if i > 0 {
                borders.push((border(self.twist[i], 1.0), i - 1));
            }
            if i < last {
                borders.push((border(self.twist[i + 1], -1.0), i + 1));
            }
            let constant = self.torque[i] - slope * self.twist[i];
            Region {
                torque: TwistForm { constant, per_twist: slope, per_rate: self.damping },
                borders,
            }
        };
        (0..=last).map(region).collect()
    }

    /// The energy of the table as that of stops: one per change of stiffness, outwards from 0.
    fn stops(&self) -> Vec<Stop<T>> {
        let rest = self.twist.iter().position(|&twist| twist == 0.0).unwrap_or(0);
        let pieces = self.twist.len() - 1;
        let mut stops = Vec::with_capacity(pieces + 1);
        let mut inner = T::zero_();
        for i in rest..pieces {
            let at = T::of(self.twist[i]);
            stops.push(Stop { stiffness: self.slope(i) - inner, at, side: 1.0 });
            inner = self.slope(i);
        }
        inner = T::zero_();
        for i in (0..rest).rev() {
            let at = T::of(self.twist[i + 1]);
            stops.push(Stop { stiffness: self.slope(i) - inner, at, side: -1.0 });
            inner = self.slope(i);
        }
        // At an end of the table the adjacent piece goes on through 0.
        if rest == 0 || rest == pieces {
            let (piece, side) = if rest == 0 { (0, -1.0) } else { (pieces - 1, 1.0) };
            stops.push(Stop { stiffness: self.slope(piece), at: T::zero_(), side });
        }
        stops
    }
}
