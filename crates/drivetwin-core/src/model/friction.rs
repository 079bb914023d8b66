// SPDX-License-Identifier: MIT
//! μ over slip: the Stribeck law of a wet clutch (paper Figure 8), or a table.

use super::declare::described;
use super::described::Described;
use super::error::ModelError;
use super::field::Field;
use super::schema::FieldSchema;
use crate::number::{INVERSE, Number, Series, TERMS, Values};
use serde::{Deserialize, Serialize};

described! {
    /// Stribeck law of a wet clutch.
    ///
    /// `μ(s) = μ_c + (μ_s - μ_c) exp(-|s|/v_s) + μ_v |s|`.
    pub struct Stribeck<T> {
        /// Friction coefficient after the exponential has died out.
        pub mu_c: T = Number().at_least(0.0),
        /// Friction coefficient at zero slip.
        pub mu_s: T = Number().at_least(0.0),
        /// Slip over which the exponential falls by e.
        pub v_s: T = Number("rad/s").above(0.0),
        /// Viscous slope.
        pub mu_v: T = Number("s/rad"),
    }
}

described! {
    /// Friction coefficient μ linear between points of |slip|; beyond the last constant, or along the last
    /// piece.
    pub struct FrictionTable<T> {
        /// |slip|, increasing from 0.
        pub slip: Vec<f64> = Axis("rad/s").at_least(0.0),
        /// Friction coefficient at each slip.
        pub mu: Vec<T> = Numbers().at_least(0.0),
        /// True if the last piece continues beyond the last point.
        #[serde(default)]
        pub extend: bool = Flag().absent("false"),
    }
}

/// μ over |slip|.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "friction takes mu_c, mu_s, v_s and mu_v of a Stribeck law, or slip and mu of a table"
)]
pub enum FrictionLaw<T> {
    /// Exponential plus viscous.
    Stribeck(Stribeck<T>),
    /// Piecewise linear.
    Table(FrictionTable<T>),
}

/// Taylor coefficients in time of `E = exp(-|s|/v_s)`.
#[derive(Clone, Debug)]
pub struct Decay<T> {
    /// -1/v_s, s/rad.
    rate: T,
    /// Coefficients of the exponent, times their order.
    slopes: Series<T>,
    values: Series<T>,
}

impl<T: Number> Default for Decay<T> {
    fn default() -> Self {
        let zero = [T::zero_(); TERMS];
        Self { rate: T::zero_(), slopes: zero, values: zero }
    }
}

impl<T: Number> Decay<T> {
    /// Fill in coefficient `k`, order by order: `E' = -(|s|'/v_s) E`.
    #[inline(always)]
    fn term(&mut self, slip: &Series<T>, v_s: T, k: usize) -> T {
        if k == 0 {
            self.rate = -v_s.recip();
            self.values[0] = (slip[0] * self.rate).exp();
        } else {
            self.slopes[k] = slip[k] * self.rate * k as f64;
            let mut sum = T::zero_();
            for i in 1..=k {
                sum += self.slopes[i] * self.values[k - i];
            }
            self.values[k] = sum * INVERSE[k];
        }
        self.values[k]
    }
}

impl<T: Number> Described<T> for FrictionLaw<T> {
    type Over<U> = FrictionLaw<U>;

    fn map<U>(&self, f: &impl Fn(&T) -> U) -> FrictionLaw<U> {
        match self {
            Self::Stribeck(law) => FrictionLaw::Stribeck(law.map(f)),
            Self::Table(table) => FrictionLaw::Table(table.map(f)),
        }
    }

    fn number_mut(&mut self, path: &[&str]) -> Option<&mut T> {
        match self {
            Self::Stribeck(law) => law.number_mut(path),
            Self::Table(table) => table.number_mut(path),
        }
    }

    #[inline]
    fn check_range(&self, element: &str, field: &Field) -> Result<(), ModelError> {
        match self {
            Self::Stribeck(law) => law.check_range(element, field),
            Self::Table(table) => table.check_range(element, field),
        }
    }

    fn alternatives() -> Vec<Vec<FieldSchema>> {
        [Stribeck::<T>::alternatives(), FrictionTable::<T>::alternatives()].concat()
    }
}

impl<T: Number> FrictionLaw<T> {
    /// μ independent of slip.
    pub fn constant(mu: T) -> Self {
        Self::Table(FrictionTable { slip: vec![0.0], mu: vec![mu], extend: false })
    }

    /// μ at a slip of magnitude `s` ≥ 0 [rad/s].
    pub fn at(&self, s: T) -> T {
        match self {
            Self::Stribeck(law) => {
                let stiction = (law.mu_s - law.mu_c) * (-s / law.v_s).exp();
                law.mu_c + stiction + law.mu_v * s
            }
            Self::Table(table) => table.piece(s.re().decide(|s| table.cell(s))).0.at(s),
        }
    }

    /// Taylor coefficient `k` of μ in time along the coefficients of |slip|, on piece `piece` of a table.
    /// `decay` is that of a Stribeck law.
    #[inline(always)]
    pub fn series_term(&self, slip: &Series<T>, piece: usize, decay: &mut Decay<T>, k: usize) -> T {
        match self {
            Self::Table(table) => {
                let (Piece { from, value, slope }, _) = table.piece(piece);
                if k == 0 { value + slope * (slip[0] - from) } else { slope * slip[k] }
            }
            Self::Stribeck(Stribeck { mu_c, mu_s, v_s, mu_v }) => {
                let mu = (*mu_s - *mu_c) * decay.term(slip, *v_s, k) + *mu_v * slip[k];
                if k == 0 { mu + *mu_c } else { mu }
            }
        }
    }

    /// Refuse tables that are no friction: μ must be finite and not negative where it is tabulated.
    pub(crate) fn check(&self, element: &str) -> Result<(), ModelError> {
        match self {
            Self::Stribeck(_) => Ok(()),
            Self::Table(table) => table.check(element),
        }
    }
}

/// One linear piece of a table: `value + slope (s - from)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<T> {
    /// Left end of the piece.
    pub from: f64,
    /// Value at the left end.
    pub value: T,
    /// Slope.
    pub slope: T,
}

impl<T: Number> Piece<T> {
    /// Value at `s`.
    pub fn at(&self, s: T) -> T {
        self.value + self.slope * (s - self.from)
    }
}

impl<T: Number> FrictionTable<T> {
    /// Index of the piece that holds |slip| `s`.
    pub fn cell(&self, s: f64) -> usize {
        let last =
            if self.extend { self.slip.len().saturating_sub(2) } else { self.slip.len() - 1 };
        self.slip.partition_point(|&x| x <= s).saturating_sub(1).min(last)
    }

    /// Piece `i` and its span of |slip| [rad/s].
    pub fn piece(&self, i: usize) -> (Piece<T>, (f64, f64)) {
        let from = self.slip[i];
        let Some(&next) = self.slip.get(i + 1) else {
            let flat = Piece { from, value: self.mu[i], slope: T::zero_() };
            return (flat, (from, f64::INFINITY));
        };
        let slope = (self.mu[i + 1] - self.mu[i]) / (next - from);
        let unbounded = self.extend && i + 2 == self.slip.len();
        let to = if unbounded { f64::INFINITY } else { next };
        (Piece { from, value: self.mu[i], slope }, (from, to))
    }

    fn check(&self, element: &str) -> Result<(), ModelError> {
        let fault = |problem| {
            Err(ModelError::Table { element: element.to_owned(), table: "friction table", problem })
        };
        if self.slip.is_empty() || self.slip.len() != self.mu.len() {
            return fault("needs as many slips as values, at least one");
        }
        if self.slip[0] != 0.0 || !self.slip.windows(2).all(|w| w[0] < w[1]) {
            return fault("must have slips that increase from 0");
        }
        if !self.slip.iter().all(|s| s.is_finite()) {
            return fault("has a slip that is not finite");
        }
        if !self.mu.iter().all(|mu| mu.re().decide(|v| v.is_finite() && v >= 0.0)) {
            return fault("has a value that is negative or not finite");
        }
        Ok(())
    }
}
