// SPDX-License-Identifier: MIT
//! Integrals of the motion of one mode over a step, by the series of its matrix: what the exact step
//! operators are made of.
//!
//! Plain loops throughout: the body of a closure would be compiled apart, for the least of all processors.
//! Matrices are written in place: of several runs side by side they are large, and copied where returned.

use crate::network::linalg::is_zero;
use crate::number::{KernelFloat, Number, Values};
use crate::solver::sine::Wave;
use crate::solver::tolerances::{MAX_SPECTRAL_STEP_LINEAR, SERIES_RTOL};

/// A square matrix by rows.
pub type Square<T, const N: usize> = [[T; N]; N];

/// [`phi_functions`], S_0 first.
pub type PhiFunctions<T, const N: usize> = [Square<T, N>; FORCING_DEGREE + 1];

/// Number of basis functions of a channel's cubic over a sample, with `t` from 0 to 1: 1, t, t², and
/// Hermite's `3t² - 2t³` and `t³ - t²`. The last two change only the value and only the slope at the end.
pub const N_BASIS: usize = 5;
/// Powers of time that a force is integrated with.
pub const FORCING_DEGREE: usize = 4;
/// Most terms of the series.
const MAX_SERIES: usize = 40;

/// Coefficients of the series of the operators but for its first factor, and their number. Those that a run
/// does not need are zero.
#[inline(always)]
fn coefficients<T: Number>(all: &mut [T::Values; MAX_SERIES + 2], h: f64, reach: T) -> usize {
    let mut left = T::Values::of(1.0);
    all[0] = left;
    let mut ended = 0;
    for i in 1..MAX_SERIES {
        left *= reach.re() / i as f64;
        ended |= left.mask_where(|left| left < SERIES_RTOL);
        if ended == T::RUNS {
            return i;
        }
        all[i] =
            (all[i - 1] * h / (i + FORCING_DEGREE) as f64).replace_where(ended, T::Values::zero_());
    }
    MAX_SERIES
}

/// `S_k = Σ_i A^i h^(i+k) / (i+k)!` for k = 0 .. CUBIC: S_0 is the transition matrix, of which the identity
/// is left out, and `k! S_(k+1) e` the response to a force `e t^k`. The highest by its series, the lower ones
/// by `S_(k-1) = I h^(k-1)/(k-1)! + A S_k`.
#[inline(always)]
pub fn phi_functions<T: Number, const F: bool, const N: usize>(
    a: &Square<T, N>,
    h: f64,
    reach: T,
    n: usize,
    all: &mut PhiFunctions<T, N>,
) {
    let mut series = [T::Values::zero_(); MAX_SERIES + 2];
    let terms = coefficients::<T>(&mut series, h, reach);
    let mut weights = [1.0; FORCING_DEGREE + 1];
    for k in 1..=FORCING_DEGREE {
        weights[k] = weights[k - 1] * h / k as f64;
    }
    let sum = &mut all[FORCING_DEGREE];
    polynomial::<T, F, N>(a, &series[..terms.next_multiple_of(3)], n, sum);
    for i in 0..span::<T, N>(n) {
        for j in 0..span::<T, N>(n) {
            sum[i][j] *= weights[FORCING_DEGREE];
        }
    }
    for k in (0..FORCING_DEGREE).rev() {
        let (lower, higher) = all.split_at_mut(k + 1);
        multiply::<T, F, N>(a, &higher[0], n, &mut lower[k]);
        if k > 0 {
            add_to_diagonal(&mut lower[k], T::of(weights[k]));
        }
    }
}

/// Double the step of the transition matrix without the identity. So the transition of slow modes keeps its
/// digits over any number of doublings (scaling and squaring).
#[inline(always)]
pub fn double_transition<T: Number, const F: bool, const N: usize>(
    transition: &mut Square<T, N>,
    n: usize,
) {
    let mut product = [[T::zero_(); N]; N];
    multiply::<T, F, N>(transition, transition, n, &mut product);
    for i in 0..span::<T, N>(n) {
        for j in 0..span::<T, N>(n) {
            transition[i][j] = product[i][j] + transition[i][j] + transition[i][j];
        }
    }
}

/// Responses of the state at the end of a step to a force `e`, to `e t`, and to a wave of that force.
#[derive(Clone, Copy, Debug)]
pub struct ForceResponse<T, const N: usize> {
    /// To `e` and to `e t`.
    pub ramp: [[T; N]; 2],
    /// To a wave of angular frequency, where there is one.
    pub wave: Option<WaveResponse<T, N>>,
}

/// Responses to the constant and to each input, `None` to one that does not act on the state.
pub type ForceResponses<T, const N: usize> = Vec<Option<ForceResponse<T, N>>>;

impl<T: Number, const N: usize> ForceResponse<T, N> {
    /// For a force, and for its wave of angular frequency `omega` [rad/s].
    #[inline(always)]
    pub fn of<const F: bool>(
        s: &PhiFunctions<T, N>,
        force: &[T; N],
        omega: Option<f64>,
        n: usize,
    ) -> Self {
        let ramp = [apply::<T, F, N>(&s[1], force, n), apply::<T, F, N>(&s[2], force, n)];
        Self { ramp, wave: omega.map(|omega| WaveResponse::of::<F>(s, force, omega, n)) }
    }

    /// Double the step `h` [s]; `transition` is that of the single step without the identity.
    #[inline(always)]
    pub fn double<const F: bool>(&mut self, transition: &Square<T, N>, h: f64, n: usize) {
        let [held, rising] = self.ramp;
        let moved =
            [apply::<T, F, N>(transition, &held, n), apply::<T, F, N>(transition, &rising, n)];
        for i in 0..span::<T, N>(n) {
            self.ramp[0][i] = moved[0][i] + held[i] + held[i];
            self.ramp[1][i] = held[i].fma_times::<F>(h, moved[1][i] + rising[i] + rising[i]);
        }
        if let Some(wave) = &mut self.wave {
            wave.double::<F>(transition, h, n);
        }
    }
}

/// Number of doublings of the first step whose series is summed directly.
pub fn doublings(reach: f64, waves: &[Option<Wave>], h: f64) -> i32 {
    let waves = waves.iter().flatten().map(|wave| wave.omega.abs() * h / MAX_WAVE_ANGLE);
    let own = if reach > MAX_SPECTRAL_STEP_LINEAR { reach } else { 0.0 };
    let turns = waves.fold(own, f64::max);
    if turns > 1.0 { turns.log2().ceil().min(MAX_DOUBLINGS) as i32 } else { 0 }
}

/// Most doublings; more than between the fastest and the slowest motion that numbers can tell apart.
const MAX_DOUBLINGS: f64 = 100.0;

/// Response of the state at the end of a step to a force `e cos ωt` and to `e sin(ωt)/ω`.
#[derive(Clone, Copy, Debug)]
pub struct WaveResponse<T, const N: usize> {
    /// Angular frequency, rad/s.
    omega: f64,
    /// To the cosine and to the sine.
    pub parts: [[T; N]; 2],
}

impl<T: Number, const N: usize> WaveResponse<T, N> {
    /// For a step over which the wave turns by at most [`MAX_WAVE_ANGLE`].
    pub fn of<const F: bool>(s: &PhiFunctions<T, N>, force: &[T; N], omega: f64, n: usize) -> Self {
        let mut parts = [[T::zero_(); N]; 2];
        for k in 0..2 {
            let first = apply::<T, F, N>(&s[1 + k], force, n);
            let third = apply::<T, F, N>(&s[3 + k], force, n);
            for i in 0..N {
                parts[k][i] = first[i] - third[i] * (omega * omega);
            }
        }
        Self { omega, parts }
    }

    /// Double the step `h` [s]; `transition` is that of the single step without the identity.
    pub fn double<const F: bool>(&mut self, transition: &Square<T, N>, h: f64, n: usize) {
        let [cosine, sine] = self.parts;
        let (sin, cos) = (self.omega * h).sin_cos();
        let sin_over = if self.omega == 0.0 { h } else { sin / self.omega };
        let moved =
            [apply::<T, F, N>(transition, &cosine, n), apply::<T, F, N>(transition, &sine, n)];
        for i in 0..N {
            let (c, q) = (cosine[i], sine[i]);
            self.parts[0][i] = moved[0][i] + c * (1.0 + cos) - q * (self.omega * sin);
            self.parts[1][i] = moved[1][i] + q * (1.0 + cos) + c * sin_over;
        }
    }
}

/// Angle of a wave over a step up to which three terms of its series are exact to round-off, rad.
pub const MAX_WAVE_ANGLE: f64 = 1e-3;

/// `Σ c_i A^i` over whole threes of coefficients, by Horner's rule over the cube: less than half as many
/// products of matrices as over A (Paterson and Stockmeyer 1973).
#[inline(always)]
fn polynomial<T: Number, const F: bool, const N: usize>(
    a: &Square<T, N>,
    coefficients: &[T::Values],
    n: usize,
    sum: &mut Square<T, N>,
) {
    let [mut square, mut cube, mut product] = [[[T::zero_(); N]; N]; 3];
    multiply::<T, F, N>(a, a, n, &mut square);
    multiply::<T, F, N>(a, &square, n, &mut cube);
    for at in (0..coefficients.len()).step_by(3).rev() {
        if at + 3 < coefficients.len() {
            multiply::<T, F, N>(&cube, sum, n, &mut product);
        }
        for i in 0..span::<T, N>(n) {
            for j in 0..span::<T, N>(n) {
                let low = a[i][j].fma_values::<F>(coefficients[at + 1], product[i][j]);
                sum[i][j] = square[i][j].fma_values::<F>(coefficients[at + 2], low);
            }
        }
        add_to_diagonal(sum, T::promote(coefficients[at]));
    }
}

#[inline(always)]
pub fn add_to_diagonal<T: Number, const N: usize>(a: &mut Square<T, N>, value: T) {
    for i in 0..N {
        a[i][i] += value;
    }
}

/// Product of two matrices, in place of what is in `out`. Plain numbers go by rows, and a left factor may be
/// sparse: that of a chain of inertias is.
#[inline(always)]
fn multiply<T: Number, const F: bool, const N: usize>(
    a: &Square<T, N>,
    b: &Square<T, N>,
    n: usize,
    out: &mut Square<T, N>,
) {
    for i in 0..span::<T, N>(n) {
        if T::DERIVATIVES || T::RUNS > 1 {
            for j in 0..n {
                let mut sum = T::zero_();
                for k in 0..n {
                    sum = a[i][k].fma::<F>(b[k][j], sum);
                }
                out[i][j] = sum;
            }
            continue;
        }
        let mut row = [T::zero_(); N];
        for k in 0..N {
            if !is_zero(a[i][k]) {
                for j in 0..N {
                    row[j] = a[i][k].fma::<F>(b[k][j], row[j]);
                }
            }
        }
        out[i] = row;
    }
}

/// A matrix times a vector.
#[inline(always)]
pub fn apply<T: Number, const F: bool, const N: usize>(
    a: &Square<T, N>,
    v: &[T; N],
    n: usize,
) -> [T; N] {
    let mut out = [T::zero_(); N];
    for i in 0..span::<T, N>(n) {
        out[i] = dot::<T, F, N>(&a[i], v, n);
    }
    out
}

/// Scalar product.
#[inline(always)]
pub fn dot<T: Number, const F: bool, const N: usize>(a: &[T; N], b: &[T; N], n: usize) -> T {
    let mut sum = T::zero_();
    for i in 0..span::<T, N>(n) {
        sum = a[i].fma::<F>(b[i], sum);
    }
    sum
}

/// Entries of a row or column that are in use: `N`, so that the loop unrolls, but the number of `states` where
/// a number is a vector already. The compiler would take several entries of an unrolled loop at once, and
/// gather these.
#[inline(always)]
pub fn span<T: Number, const N: usize>(states: usize) -> usize {
    if T::DERIVATIVES || T::RUNS > 1 { states } else { N }
}

/// Response of the state at the end to a force `e` times each of the [`N_BASIS`].
#[inline(always)]
pub fn forcing_response<T: Number, const F: bool, const N: usize>(
    s: &PhiFunctions<T, N>,
    force: &[T; N],
    h: f64,
    n: usize,
) -> [[T; N]; N_BASIS] {
    // Those to 1, t, t² and t³ first.
    let mut all = [[T::zero_(); N]; N_BASIS];
    let mut weight = 1.0;
    for k in 0..FORCING_DEGREE {
        weight *= k.max(1) as f64 / if k > 0 { h } else { 1.0 };
        let response = apply::<T, F, N>(&s[k + 1], force, n);
        for i in 0..span::<T, N>(n) {
            all[k][i] = response[i] * weight;
        }
    }
    for i in 0..span::<T, N>(n) {
        let (square, cube) = (all[2][i], all[3][i]);
        all[3][i] = square * 3.0 - cube * 2.0;
        all[4][i] = cube - square;
    }
    all
}
