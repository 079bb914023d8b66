// SPDX-License-Identifier: MIT
//! Steady-state map of a torque converter over the speed ratio (paper section "Driveline modeling").

use super::declare::described;
use super::error::ModelError;

described! {
    /// Map of a torque converter over the speed ratio ν = ω_t / ω_p.
    ///
    /// Pump torque `capacity(ν) ω_p²` and turbine torque `torque_ratio(ν) capacity(ν) ω_p²`, both factors
    /// linear between points and held beyond the ends. Overrun is the part of the map with ν > 1, where the
    /// capacity is negative. A pump that turns backwards takes the opposite torques.
    pub struct ConverterMap {
        /// Speed ratio ν: at least two, increasing; overrun is the part beyond 1.
        pub speed_ratio: Vec<f64> = Axis(),
        /// Pump torque over squared pump speed; negative in overrun.
        pub capacity: Vec<f64> = Axis("N·m·s²/rad²"),
        /// Turbine torque over pump torque.
        pub torque_ratio: Vec<f64> = Axis(),
    }
}

/// One cell: `capacity = c0 + c1 ν`, `torque ratio = m0 + m1 ν` within a span of ν.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConverterCell {
    /// Coefficients of the capacity.
    pub c: [f64; 2],
    /// Coefficients of the torque ratio.
    pub m: [f64; 2],
    /// Span of ν.
    pub span: (f64, f64),
}

impl ConverterMap {
    /// Index of the cell that holds speed ratio `nu`: 0 lies below the first point.
    pub fn cell_index(&self, nu: f64) -> usize {
        self.speed_ratio.partition_point(|&x| x <= nu)
    }

    /// Cell `i`.
    pub fn cell(&self, i: usize) -> ConverterCell {
        let last = self.speed_ratio.len() - 1;
        if i == 0 || i > last {
            let at = if i == 0 { 0 } else { last };
            let end = self.speed_ratio[at];
            let span = if i == 0 { (f64::NEG_INFINITY, end) } else { (end, f64::INFINITY) };
            return ConverterCell {
                c: [self.capacity[at], 0.0],
                m: [self.torque_ratio[at], 0.0],
                span,
            };
        }
        let span = (self.speed_ratio[i - 1], self.speed_ratio[i]);
        let line = |values: &[f64]| {
            let slope = (values[i] - values[i - 1]) / (span.1 - span.0);
            [values[i - 1] - slope * span.0, slope]
        };
        ConverterCell { c: line(&self.capacity), m: line(&self.torque_ratio), span }
    }

    pub(crate) fn check(&self, element: &str) -> Result<(), ModelError> {
        let fault = |problem| {
            Err(ModelError::Table { element: element.to_owned(), table: "converter map", problem })
        };
        let n = self.speed_ratio.len();
        if n < 2 || self.capacity.len() != n || self.torque_ratio.len() != n {
            return fault(
                "needs as many capacities and torque ratios as speed ratios, at least two",
            );
        }
        if !self.speed_ratio.windows(2).all(|w| w[0] < w[1]) {
            return fault("must have speed ratios that increase");
        }
        if !self.capacity.iter().chain(&self.torque_ratio).all(|v| v.is_finite()) {
            return fault("has a value that is not finite");
        }
        Ok(())
    }
}
