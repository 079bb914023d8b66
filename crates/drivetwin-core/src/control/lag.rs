// SPDX-License-Identifier: MIT
//! Second-order lag with different time constants for rising and falling pressure.
//!
//! With e = p - w, the distance of the pressure p from a held input w:
//! T²·e'' + 2·ζ·T·e' + e = 0, where T is that of rising pressure for e < 0 and that of falling pressure for
//! e > 0. Pieces without a crossing e = 0 are exact.

/// Distance [Pa] from the input below which the pressure is at rest on it.
const REST: f64 = 1e-6;
/// Value of |ζ² - 1| below which the damping counts as critical.
const CRITICAL: f64 = 1e-6;
/// Longest piece in time constants: the distance changes its sign at most once in it.
const LONGEST: f64 = 2.0;
/// Difference [s] below which two lengths of pieces are equal.
const SAME: f64 = 1e-12;

/// Distance from the input [Pa] and rate of the pressure [Pa/s] after a piece, over those before it.
type Operator = [[f64; 2]; 2];

/// Second-order lag in motion.
#[derive(Clone, Debug)]
pub(super) struct Lag {
    damping: f64,
    /// Reciprocals of the time constants [1/s]: rising, falling.
    frequencies: [f64; 2],
    /// Usual length of a piece [s], and the operators of it: rising, falling.
    usual: f64,
    operators: [Operator; 2],
    input: f64,
    offset: f64,
    rate: f64,
}

impl Lag {
    /// Lag at rest on an input [Pa]; time constants [s], usual length of a piece [s].
    pub fn new(rising: f64, falling: f64, damping: f64, input: f64, usual: f64) -> Self {
        let frequencies = [1.0 / rising, 1.0 / falling];
        let operators = frequencies.map(|frequency| operator(frequency, damping, usual));
        Self { damping, frequencies, usual, operators, input, offset: 0.0, rate: 0.0 }
    }

    /// Pressure [Pa].
    pub fn pressure(&self) -> f64 {
        self.input + self.offset
    }

    /// Set the input [Pa].
    pub fn set_input(&mut self, input: f64) {
        self.offset += self.input - input;
        self.input = input;
    }

    /// Let a time [s] pass.
    pub fn pass(&mut self, time: f64) {
        let mut left = time;
        while left > 0.0 {
            let falls = self.offset > 0.0 || (self.offset == 0.0 && self.rate > 0.0);
            let side = usize::from(falls);
            let frequency = self.frequencies[side];
            if self.offset.abs() + self.rate.abs() / frequency < REST {
                (self.offset, self.rate) = (0.0, 0.0);
                return;
            }
            let piece = left.min(LONGEST / frequency);
            let (offset, rate) = self.moved(side, piece);
            if offset * self.offset < 0.0 {
                let crossing = self.find_crossing(frequency).min(piece);
                (self.offset, self.rate) = (0.0, self.moved(side, crossing).1);
                left -= crossing;
            } else {
                (self.offset, self.rate) = (offset, rate);
                left -= piece;
            }
        }
    }

    fn moved(&self, side: usize, time: f64) -> (f64, f64) {
        let usual = (time - self.usual).abs() < SAME;
        let own = if usual {
            self.operators[side]
        } else {
            operator(self.frequencies[side], self.damping, time)
        };
        let [to_offset, to_rate] = own;
        (
            to_offset[0] * self.offset + to_offset[1] * self.rate,
            to_rate[0] * self.offset + to_rate[1] * self.rate,
        )
    }

    /// Time [s] to the first zero of the distance from the input, which is not zero now.
    fn find_crossing(&self, frequency: f64) -> f64 {
        let slope = self.rate + self.damping * frequency * self.offset;
        let excess = self.damping * self.damping - 1.0;
        if excess.abs() <= CRITICAL {
            return -self.offset / slope;
        }
        let root = frequency * excess.abs().sqrt();
        if excess < 0.0 {
            return (-self.offset).atan2(slope / root).rem_euclid(std::f64::consts::PI) / root;
        }
        (-self.offset * root / slope).atanh() / root
    }
}

fn operator(frequency: f64, damping: f64, time: f64) -> Operator {
    let (decay, excess) = (damping * frequency, damping * damping - 1.0);
    let root = frequency * excess.abs().sqrt();
    let (even, odd) = if excess.abs() <= CRITICAL {
        let even = (-decay * time).exp();
        (even, time * even)
    } else if excess < 0.0 {
        let even = (-decay * time).exp();
        (even * (root * time).cos(), even * (root * time).sin() / root)
    } else {
        let (slow, fast) = (((root - decay) * time).exp(), (-(root + decay) * time).exp());
        (0.5 * (slow + fast), 0.5 * (slow - fast) / root)
    };
    [[even + decay * odd, odd], [-frequency * frequency * odd, even - decay * odd]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pressure by many short steps of the midpoint rule.
    fn integrate(lag: &Lag, time: f64) -> f64 {
        let (mut offset, mut rate) = (lag.offset, lag.rate);
        let count = 200_000;
        let h = time / f64::from(count);
        for _ in 0..count {
            let side = usize::from(offset > 0.0 || (offset == 0.0 && rate > 0.0));
            let w = lag.frequencies[side];
            let turn = |offset: f64, rate: f64| -w * w * offset - 2.0 * lag.damping * w * rate;
            let middle = (offset + 0.5 * h * rate, rate + 0.5 * h * turn(offset, rate));
            offset += h * middle.1;
            rate += h * turn(middle.0, middle.1);
        }
        lag.input + offset
    }

    #[test]
    fn pieces_of_any_length_follow_the_differential_equation_through_crossings() {
        for damping in [0.3, 0.7, 1.0, 1.8] {
            let mut lag = Lag::new(0.02, 0.05, damping, 0.0, 1e-3);
            lag.set_input(4e5);
            for time in [1e-3, 0.0137, 0.04, 0.11] {
                let expected = integrate(&lag, time);
                lag.pass(time);
                assert!((lag.pressure() - expected).abs() < 1.0, "{damping} {time}");
            }
            lag.set_input(1e5);
            let expected = integrate(&lag, 0.06);
            (0..60).for_each(|_| lag.pass(1e-3));
            assert!((lag.pressure() - expected).abs() < 1.0, "{damping}");
        }
    }
}
