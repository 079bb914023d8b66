// SPDX-License-Identifier: MIT
//! Exact step operators of one mode over samples of equal length.
//!
//! In one mode `x' = A x + B u + c + E φ`. Over a sample of length h the inputs are linear and a channel
//! φ is a cubic in time, so that the state at the end is linear in the step vector
//! `y = (x, u at the start, u at the end, 1, a0 .. a3 of every active channel)`.

use crate::network::{Mode, Network};
use crate::number::Real;

/// Coefficients of a channel's cubic over a step.
pub const CUBIC: usize = 4;

/// A square matrix by rows.
type Square<T, const N: usize> = [[T; N]; N];

/// Operators of a mode and a set of active channels for steps of length `h`.
#[derive(Clone, Debug)]
pub struct Operators<T> {
    /// Step length, s.
    pub h: f64,
    /// Channels that are not off.
    pub active: Vec<usize>,
    /// Columns of the state at the end over y, each padded to the stride.
    pub step: Vec<T>,
    /// For every active channel its argument at the end over y with the first two coefficients of
    /// the channels only, and the same for what of its rate comes from the state.
    pub argument: Vec<Vec<T>>,
    /// See `argument`.
    pub rate: Vec<Vec<T>>,
    /// For every active channel the rate of its argument over the basis (x, u, 1, φ).
    pub rate_now: Vec<Vec<T>>,
}

/// Largest `ρ(A) h` for which a cubic follows a slipping element.
const MAX_SLIPPING: f64 = 0.7;
/// Largest `ρ(A) h` for which the series of the operators is summed directly.
const MAX_LINEAR: f64 = 3.0;
/// Terms of that series.
const SERIES: usize = 26;

impl<T: Real> Operators<T> {
    /// Build for at most `N` states; `None` where the step is too long for the mode.
    pub fn build<const N: usize>(
        network: &Network<T>,
        mode: &Mode<T>,
        active: &[usize],
        h: f64,
    ) -> Option<Self> {
        let n = network.states();
        let a: Square<T, N> =
            std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    if i < n && j < n { mode.derivative[(i, j)] } else { T::zero_() }
                })
            });
        let limit = if active.is_empty() { MAX_LINEAR } else { MAX_SLIPPING };
        if radius(&a) * h > limit {
            return None;
        }
        let s = integrals(&a, h);
        let forcing = |column: usize| -> [T; N] {
            std::array::from_fn(|i| if i < n { mode.derivative[(i, column)] } else { T::zero_() })
        };
        let mut columns: Vec<[T; N]> =
            (0..n).map(|j| std::array::from_fn(|i| s[0][i][j])).collect();
        let inputs = network.mechanism.inputs.len();
        let held: Vec<[T; N]> =
            (0..inputs).map(|i| apply(&s[1], &forcing(network.first_input() + i))).collect();
        let ramp: Vec<[T; N]> =
            (0..inputs).map(|i| apply(&s[2], &forcing(network.first_input() + i))).collect();
        for (held, ramp) in held.iter().zip(&ramp) {
            columns.push(std::array::from_fn(|i| held[i] - ramp[i] / h));
        }
        columns.extend(ramp.iter().map(|ramp| ramp.map(|r| r / h)));
        columns.push(apply(&s[1], &forcing(network.one())));
        let mut factorial = 1.0;
        let channels: Vec<[T; N]> =
            active.iter().map(|&j| forcing(network.first_channel() + j)).collect();
        let mut moments: Vec<Vec<[T; N]>> = Vec::new();
        for k in 0..CUBIC {
            factorial *= k.max(1) as f64;
            let moment = |e: &[T; N]| apply(&s[k + 1], e).map(|v| v * factorial);
            moments.push(channels.iter().map(moment).collect());
        }
        for j in 0..active.len() {
            columns.extend(moments.iter().map(|moment| moment[j]));
        }
        Some(Self::with_rows(network, mode, active, (h, &columns)))
    }

    fn with_rows<const N: usize>(
        network: &Network<T>,
        mode: &Mode<T>,
        active: &[usize],
        (h, columns): (f64, &[[T; N]]),
    ) -> Self {
        let n = network.states();
        let over_step = |row: &[T]| -> Vec<T> {
            let dot = |c: &[T; N]| (0..n).fold(T::zero_(), |sum, i| sum + row[i] * c[i]);
            columns.iter().map(dot).collect()
        };
        let (mut argument, mut rate, mut rate_now) = (Vec::new(), Vec::new(), Vec::new());
        for &j in active {
            let row = &network.channels[j].arguments[0];
            let mut now = vec![T::zero_(); network.basis()];
            for (i, &c) in row.iter().enumerate() {
                for (sum, &d) in now.iter_mut().zip(mode.derivative.row(i)) {
                    *sum += c * d;
                }
            }
            argument.push(over_step(row));
            rate.push(over_step(&now[..n]));
            rate_now.push(now);
        }
        let step = columns.iter().flatten().copied().collect();
        Self { h, active: active.to_vec(), step, argument, rate, rate_now }
    }
}

/// Estimate of the spectral radius [1/s] from `A^16`, of which a bad scaling of the states counts only
/// by its sixteenth root.
fn radius<T: Real, const N: usize>(a: &Square<T, N>) -> f64 {
    let mut power: [[f64; N]; N] = std::array::from_fn(|i| std::array::from_fn(|j| a[i][j].re()));
    let mut scale = 0.0;
    for _ in 0..4 {
        let size = power.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        if size == 0.0 {
            return 0.0;
        }
        scale = 2.0 * (scale + size.ln());
        let unit = power.map(|row| row.map(|v| v / size));
        power = multiply(&unit, &unit);
    }
    let size = power.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    ((scale + size.max(f64::MIN_POSITIVE).ln()) / 16.0).exp()
}

/// `S_k = Σ_i A^i h^(i+k) / (i+k)!` for k = 0 .. CUBIC: S_0 is the transition matrix, and
/// `k! S_(k+1) e` the response to a force `e t^k`. The highest by its series, the lower ones by
/// `S_(k-1) = I h^(k-1)/(k-1)! + A S_k`.
fn integrals<T: Real, const N: usize>(a: &Square<T, N>, h: f64) -> [Square<T, N>; CUBIC + 1] {
    let ah = a.map(|row| row.map(|v| v * h));
    let identity = |value: f64| -> Square<T, N> {
        std::array::from_fn(|i| std::array::from_fn(|j| T::of(if i == j { value } else { 0.0 })))
    };
    let mut sum = identity(1.0);
    for i in (1..SERIES).rev() {
        let scaled = ah.map(|row| row.map(|v| v / (i + CUBIC) as f64));
        sum = multiply(&scaled, &sum);
        (0..N).for_each(|d| sum[d][d] += 1.0);
    }
    let mut weight = 1.0;
    let weights: Vec<f64> = (0..=CUBIC)
        .map(|k| {
            weight *= if k > 0 { h / k as f64 } else { 1.0 };
            weight
        })
        .collect();
    let mut all = [identity(0.0); CUBIC + 1];
    all[CUBIC] = sum.map(|row| row.map(|v| v * weights[CUBIC]));
    for k in (0..CUBIC).rev() {
        all[k] = multiply(a, &all[k + 1]);
        (0..N).for_each(|d| all[k][d][d] += weights[k]);
    }
    all
}

fn multiply<T: Real, const N: usize>(a: &Square<T, N>, b: &Square<T, N>) -> Square<T, N> {
    let mut out = [[T::zero_(); N]; N];
    for i in 0..N {
        for k in 0..N {
            for j in 0..N {
                out[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    out
}

fn apply<T: Real, const N: usize>(a: &Square<T, N>, v: &[T; N]) -> [T; N] {
    std::array::from_fn(|i| (0..N).fold(T::zero_(), |sum, j| sum + a[i][j] * v[j]))
}
