// SPDX-License-Identifier: MIT
//! A viscous coupling by its torque over the slip.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart};
use crate::model::loss_table::starts_above_zero;
use crate::model::mechanism::{Mechanism, Region, Spring, SpringLaw, TwistForm};
use crate::number::{Number, Values};

described! {
    /// Viscous coupling: torque over the slip, without stiction.
    ///
    /// Slip `s = ω_a - ω_b`; torque `T(|s|) · sgn s` on `b`, opposite on `a`. T is linear from 0 at zero slip
    /// through the points; the last piece goes on beyond the table.
    pub struct ViscousCoupling<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Driving side.
        pub a: Name = Node(),
        /// Driven side, or the ground.
        pub b: Name = Node(),
        /// Magnitude of the slip, increasing.
        pub slip: Vec<f64> = Axis("rad/s").above(0.0),
        /// Torque at each slip, not falling.
        pub torque: Vec<T> = Numbers("N·m").at_least(0.0),
    }
}

impl<T: Number> ViscousCoupling<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        let fault = |problem| {
            let element = self.name.to_string();
            Err(ModelError::Table { element, table: "viscous coupling", problem })
        };
        if !starts_above_zero(&self.slip) {
            return fault("must have slips that increase from one above 0");
        }
        if self.torque.len() != self.slip.len() {
            return fault("needs as many torques as slips");
        }
        if !self.torque.iter().all(|t| t.re().decide(|t| t.is_finite() && t >= 0.0)) {
            return fault("has a torque that is negative or not finite");
        }
        let falls = |w: &[T]| w[1].re().decide_with(w[0].re(), |next, torque| next < torque);
        if self.torque.windows(2).any(falls) {
            return fault("must have torques that do not fall");
        }
        Ok(())
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let law = SpringLaw::Regions { regions: self.regions(), stops: Vec::new() };
        m.springs.push(Spring { element: self.name.clone(), row, law });
    }

    /// The first piece of both signs, then the others for positive and for negative slips.
    fn regions(&self) -> Vec<Region<T>> {
        let pieces = self.slip.len();
        let mut first = self.region(0, 1.0, 0);
        first.borders.extend(self.end_border(0, -1.0, pieces));
        let mut regions = vec![first];
        for (side, start) in [(1.0, 0), (-1.0, pieces - 1)] {
            regions.extend((1..pieces).map(|i| self.region(i, side, start)));
        }
        regions
    }

    /// Piece `i` on a side whose piece 1 is the region after `start`.
    fn region(&self, i: usize, side: f64, start: usize) -> Region<T> {
        let (from, value) =
            if i == 0 { (0.0, T::zero_()) } else { (self.slip[i - 1], self.torque[i - 1]) };
        let slope = (self.torque[i] - value) / (self.slip[i] - from);
        let constant = (value - slope * from) * side;
        let torque = TwistForm { constant, per_twist: T::zero_(), per_rate: slope };
        let inner = if i == 1 { 0 } else { start + i.saturating_sub(1) };
        let begin = (i > 0).then(|| (border(-from, side), inner));
        let borders = begin.into_iter().chain(self.end_border(i, side, start + i + 1)).collect();
        Region { torque, borders }
    }

    /// Border at the end of piece `i`, and the region beyond; the last piece has none.
    fn end_border(&self, i: usize, side: f64, next: usize) -> Option<(TwistForm<T>, usize)> {
        (i + 1 < self.slip.len()).then(|| (border(self.slip[i], -side), next))
    }
}

/// `constant + side · slip`.
fn border<T: Number>(constant: f64, side: f64) -> TwistForm<T> {
    TwistForm { constant: T::of(constant), per_twist: T::zero_(), per_rate: T::of(side) }
}
