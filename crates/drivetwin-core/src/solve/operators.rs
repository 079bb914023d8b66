// SPDX-License-Identifier: MIT
//! Exact step operators of one mode over samples of equal length h.
//!
//! In one mode `x' = A x + B u + c + E φ`. Over a sample the inputs are linear and a channel φ is a
//! cubic, the sum of [`SHAPES`] with the coefficients a, so that the state at the end, the argument of
//! every channel there and its rate are linear in x, u, u', a. Channels count in their direction of
//! motion: `τ = sign · φ` over `m = sign · s`.

use super::lanes::{Task, dispatch};
use crate::network::smooth::{Law, Line};
use crate::network::{Mode, Network};
use crate::number::{Lane, Real};

/// Powers of time that a force is integrated with.
const CUBIC: usize = 4;
/// What a channel's cubic over a sample is a sum of, with `t` from 0 to 1 over it: 1, t, t², and Hermite's
/// `3t² - 2t³` and `t³ - t²`, which raise the value and the slope at its end and nothing else.
pub const SHAPES: usize = 5;
/// Most channels that are carried at once.
pub const MAX_ACTIVE: usize = 4;
/// Most torques and speeds that are watched at once.
pub const MAX_WATCHED: usize = 12;

/// Operators over at most `N` states; unused states, channels and forms are zero.
#[derive(Clone, Debug)]
pub struct Operators<L, const N: usize> {
    /// Number of states.
    pub states: usize,
    /// What a watched form may deviate from its chord within a sample, relative to its rise and to its
    /// size.
    pub bow: [L; 2],
    /// Signs of the carried channels.
    pub signs: [L; MAX_ACTIVE],
    /// Columns of the transition matrix.
    pub transition: [[L; N]; N],
    /// What is there without state and inputs.
    pub constant: [L; N],
    /// Inputs that act on the state.
    pub drives: Vec<Drive<L, N>>,
    /// Carried channels.
    pub channels: Vec<Carried<L, N>>,
    /// Forms that must stay within their limits.
    pub watched: Vec<Watched<L, N>>,
    /// Normal loads that must stay above zero.
    pub loads: Vec<Line<L>>,
}

/// Effect of one input; pairs are those of its value at the start and of its rate.
#[derive(Clone, Copy, Debug)]
pub struct Drive<L, const N: usize> {
    /// Its index.
    pub input: usize,
    /// On the state at the end.
    pub step: [[L; N]; 2],
    /// On the arguments at the end.
    pub argument: [[L; 2]; MAX_ACTIVE],
    /// On the part of their rates there that comes from the state.
    pub rate: [[L; 2]; MAX_ACTIVE],
    /// On the rates of the arguments, directly.
    pub now: [L; MAX_ACTIVE],
    /// On their second derivatives at the start, by the state.
    pub second: [L; MAX_ACTIVE],
    /// On the watched forms.
    pub watched: [L; MAX_WATCHED],
}

/// A linear form over state, constant and cubics.
#[derive(Clone, Copy, Debug)]
pub struct StepForm<L, const N: usize> {
    /// Over the state at the start.
    pub state: [L; N],
    /// Constant.
    pub constant: L,
    /// Over the cubics of the carried channels.
    pub cubics: [[L; SHAPES]; MAX_ACTIVE],
}

/// A linear form over state, constant and channels at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Form<L, const N: usize> {
    /// Over the state.
    pub state: [L; N],
    /// Constant.
    pub constant: L,
    /// Over the carried channels.
    pub channels: [L; MAX_ACTIVE],
}

/// A channel and what its argument does.
#[derive(Clone, Copy, Debug)]
pub struct Carried<L, const N: usize> {
    /// Response of the state at the end to the coefficients of the cubic.
    pub moments: [[L; N]; SHAPES],
    /// Argument `m = sign · s` at any instant, over the state.
    pub argument: [L; N],
    /// Argument at the end.
    pub argument_end: StepForm<L, N>,
    /// Rate of the argument at the end as far as it comes from the state.
    pub rate_end: StepForm<L, N>,
    /// Rate of the argument at any instant.
    pub rate: Form<L, N>,
    /// Second derivative at the start but for the rates of inputs and channels.
    pub second: Form<L, N>,
    /// Its law.
    pub law: Law<L>,
}

/// A guard, over the torques of the carried channels: `limit(u) - |form|` where both signs are bounded,
/// else `limit(u) + form`. In lanes that do not watch it the limit is 1 and the form 0.
#[derive(Clone, Copy, Debug)]
pub struct Watched<L, const N: usize> {
    /// Torque or speed.
    pub form: Form<L, N>,
    /// Its limit, over an input.
    pub limit: Line<L>,
    /// 1 where both signs are bounded, else -1.
    pub side: L,
    /// What is watched: the number of the friction element, or after these of a gear's power and speed.
    pub id: usize,
}

/// A square matrix by rows.
type Square<T, const N: usize> = [[T; N]; N];

/// Largest `ρ(A) h` for which a cubic follows a slipping element.
pub const MAX_SLIPPING: f64 = 0.7;
/// Largest `ρ(A) h` for which the series of the operators is summed directly.
const MAX_LINEAR: f64 = 3.0;
/// What may be left of the series, relative to its first term; generous, as A is badly scaled.
const REMAINDER: f64 = 1e-24;
/// Most terms of the series.
const MAX_SERIES: usize = 40;

impl<T: Real, const N: usize> Operators<T, N> {
    /// Build for steps of length `h` [s] with the channels `active` under `laws`; `None` where the step
    /// is too long for the mode. Nothing is watched yet.
    pub fn build(
        network: &Network<T>,
        mode: &Mode<T>,
        (active, laws): (&[usize], &[Law<T>]),
        h: f64,
    ) -> Option<Self> {
        dispatch(Build { network, mode, active, laws, h })
    }

    /// Add a channel; `argument` is its argument over the states.
    fn carry(
        &mut self,
        slot: usize,
        (network, mode): (&Network<T>, &Mode<T>),
        (active, moments): (&[usize], &[[[T; N]; SHAPES]]),
        (argument, law): ([T; N], Law<T>),
    ) {
        let now = over_basis(network, mode, &argument);
        let rate: [T; N] =
            std::array::from_fn(|i| if i < network.states() { now[i] } else { T::zero_() });
        let second = over_basis(network, mode, &rate);
        for drive in &mut self.drives {
            let [held, ramp] = &drive.step;
            drive.argument[slot] = [dot(&argument, held), dot(&argument, ramp)];
            drive.rate[slot] = [dot(&rate, held), dot(&rate, ramp)];
            drive.now[slot] = now[network.first_input() + drive.input];
            drive.second[slot] = second[network.first_input() + drive.input];
        }
        let step_form = |row: &[T; N]| {
            let mut cubics = [[T::zero_(); SHAPES]; MAX_ACTIVE];
            for (cubic, moments) in cubics.iter_mut().zip(moments) {
                *cubic = std::array::from_fn(|k| dot(row, &moments[k]));
            }
            let state = std::array::from_fn(|j| dot(row, &self.transition[j]));
            StepForm { state, constant: dot(row, &self.constant), cubics }
        };
        let carried = Carried {
            moments: moments[slot],
            argument,
            argument_end: step_form(&argument),
            rate_end: step_form(&rate),
            rate: Form::over(network, (active, &self.signs), &now),
            second: Form::over(network, (active, &self.signs), &second),
            law,
        };
        self.channels.push(carried);
    }

    /// Watch a form over the basis (x, u, 1, φ): see [`Watched`].
    pub fn watch(
        &mut self,
        network: &Network<T>,
        active: &[usize],
        row: &[T],
        (id, limit, both): (usize, Line<T>, bool),
    ) {
        let place = self.watched.len();
        for drive in &mut self.drives {
            drive.watched[place] =
                row.get(network.first_input() + drive.input).map_or(T::zero_(), |&c| c);
        }
        let form = Form::over(network, (active, &[T::of(1.0); MAX_ACTIVE]), row);
        let side = T::of(if both { 1.0 } else { -1.0 });
        self.watched.push(Watched { form, limit, side, id });
    }
}

/// [`Operators::build`], to be dispatched.
struct Build<'b, T, const N: usize> {
    network: &'b Network<T>,
    mode: &'b Mode<T>,
    active: &'b [usize],
    laws: &'b [Law<T>],
    h: f64,
}

impl<T: Real, const N: usize> Task for Build<'_, T, N> {
    type Output = Option<Operators<T, N>>;

    #[inline(always)]
    fn run<const F: bool>(self) -> Option<Operators<T, N>> {
        let Self { network, mode, active, laws, h } = self;
        let n = network.states();
        let derivative = |i: usize, column: usize| {
            if i < n { mode.derivative[(i, column)] } else { T::zero_() }
        };
        let forcing = |column: usize| -> [T; N] { std::array::from_fn(|i| derivative(i, column)) };
        let a: Square<T, N> = std::array::from_fn(|i| {
            std::array::from_fn(|j| if j < n { derivative(i, j) } else { T::zero_() })
        });
        let reach = mode.radius * h;
        if reach > if active.is_empty() { MAX_LINEAR } else { MAX_SLIPPING } {
            return None;
        }
        let s = integrals::<T, F, N>(&a, h, terms(reach));
        let transition = std::array::from_fn(|j| std::array::from_fn(|i| s[0][i][j]));
        let constant = apply(&s[1], &forcing(network.one()));
        let drive = |input: usize| {
            let force = forcing(network.first_input() + input);
            Drive::new(input, [apply(&s[1], &force), apply(&s[2], &force)])
        };
        let inputs = 0..network.mechanism.inputs.len();
        let drives = inputs.filter(|&input| network.is_driven_by(input)).map(drive).collect();
        let mut signs = [T::zero_(); MAX_ACTIVE];
        signs.iter_mut().zip(laws).for_each(|(sign, law)| *sign = law.sign);
        let forces = active
            .iter()
            .zip(signs)
            .map(|(&j, sign)| forcing(network.first_channel() + j).map(|f| f * sign));
        let moments: Vec<[[T; N]; SHAPES]> = forces.map(|force| moments(&s, &force, h)).collect();
        // A motion that turns by ρh within the sample bends by (ρh)²/8; twice that, and never nothing.
        let bow = [reach.max(0.05), (0.25 * reach * reach).max(0.005)].map(T::of);
        let mut operators = Operators {
            states: n,
            bow,
            signs,
            transition,
            constant,
            drives,
            channels: vec![],
            watched: vec![],
            loads: vec![],
        };
        for (slot, &j) in active.iter().enumerate() {
            let argument: [T; N] = std::array::from_fn(|i| {
                network.channels[j].arguments[0].get(i).map_or(T::zero_(), |&c| c * signs[slot])
            });
            operators.carry(slot, (network, mode), (active, &moments), (argument, laws[slot]));
        }
        // Inner loops exist for 0, 1, 2 and 4 channels.
        if operators.channels.len() == 3 {
            operators.channels.push(Carried::idle());
        }
        Some(operators)
    }
}

impl<L: Lane, const N: usize> Drive<L, N> {
    fn new(input: usize, step: [[L; N]; 2]) -> Self {
        Self { input, step, ..Self::idle() }
    }

    /// Without effect.
    pub fn idle() -> Self {
        let none = L::all(0.0);
        Self {
            input: 0,
            step: [[none; N]; 2],
            argument: [[none; 2]; MAX_ACTIVE],
            rate: [[none; 2]; MAX_ACTIVE],
            now: [none; MAX_ACTIVE],
            second: [none; MAX_ACTIVE],
            watched: [none; MAX_WATCHED],
        }
    }
}

impl<L: Lane, const N: usize> Carried<L, N> {
    /// Without torque.
    pub fn idle() -> Self {
        let none = L::all(0.0);
        let step_form =
            StepForm { state: [none; N], constant: none, cubics: [[none; SHAPES]; MAX_ACTIVE] };
        Self {
            moments: [[none; N]; SHAPES],
            argument: [none; N],
            argument_end: step_form,
            rate_end: step_form,
            rate: Form::idle(),
            second: Form::idle(),
            law: Law::idle(),
        }
    }
}

impl<L: Lane, const N: usize> Watched<L, N> {
    /// Never falls.
    pub fn idle() -> Self {
        Self { form: Form::idle(), limit: Line::idle(), side: L::all(1.0), id: 0 }
    }
}

impl<L: Lane, const N: usize> Form<L, N> {
    /// Always zero.
    fn idle() -> Self {
        let none = L::all(0.0);
        Self { state: [none; N], constant: none, channels: [none; MAX_ACTIVE] }
    }
}

impl<T: Real, const N: usize> Form<T, N> {
    /// Of a row over the basis or over the states alone.
    fn over(
        network: &Network<T>,
        (active, signs): (&[usize], &[T; MAX_ACTIVE]),
        row: &[T],
    ) -> Self {
        let at = |position: usize| row.get(position).map_or(T::zero_(), |&c| c);
        let state = |i: usize| if i < network.states() { at(i) } else { T::zero_() };
        let mut channels = [T::zero_(); MAX_ACTIVE];
        for ((channel, &j), &sign) in channels.iter_mut().zip(active).zip(signs) {
            *channel = at(network.first_channel() + j) * sign;
        }
        Self { state: std::array::from_fn(state), constant: at(network.one()), channels }
    }
}

impl<L: Copy, const N: usize> Operators<L, N> {
    /// Columns worth a product: few are taken as they are, so that their loop unrolls.
    #[inline(always)]
    pub fn columns(&self) -> usize {
        if N <= 4 { N } else { self.states }
    }
}

/// Response of the state at the end to a force `e` times each of the [`SHAPES`].
fn moments<T: Real, const N: usize>(
    s: &[Square<T, N>; CUBIC + 1],
    force: &[T; N],
    h: f64,
) -> [[T; N]; SHAPES] {
    let mut weight = 1.0;
    let [m0, m1, m2, m3]: [[T; N]; CUBIC] = std::array::from_fn(|k| {
        weight *= k.max(1) as f64 / if k > 0 { h } else { 1.0 };
        apply(&s[k + 1], force).map(|v| v * weight)
    });
    let value = std::array::from_fn(|i| m2[i] * 3.0 - m3[i] * 2.0);
    let slope = std::array::from_fn(|i| m3[i] - m2[i]);
    [m0, m1, m2, value, slope]
}

/// A form over the states, differentiated: over the basis.
fn over_basis<T: Real, const N: usize>(
    network: &Network<T>,
    mode: &Mode<T>,
    row: &[T; N],
) -> Vec<T> {
    let mut out = vec![T::zero_(); network.basis()];
    for i in 0..network.states() {
        for (sum, &d) in out.iter_mut().zip(mode.derivative.row(i)) {
            *sum += row[i] * d;
        }
    }
    out
}

/// Terms that the series of the operators needs.
fn terms(reach: f64) -> usize {
    let mut left = 1.0;
    (1..MAX_SERIES)
        .find(|&k| {
            left *= reach / k as f64;
            left < REMAINDER
        })
        .unwrap_or(MAX_SERIES)
}

/// `S_k = Σ_i A^i h^(i+k) / (i+k)!` for k = 0 .. CUBIC: S_0 is the transition matrix, and
/// `k! S_(k+1) e` the response to a force `e t^k`. The highest by its series, the lower ones by
/// `S_(k-1) = I h^(k-1)/(k-1)! + A S_k`.
#[inline(always)]
fn integrals<T: Real, const F: bool, const N: usize>(
    a: &Square<T, N>,
    h: f64,
    terms: usize,
) -> [Square<T, N>; CUBIC + 1] {
    let ah = a.map(|row| row.map(|v| v * h));
    let identity = |value: f64| -> Square<T, N> {
        std::array::from_fn(|i| std::array::from_fn(|j| T::of(if i == j { value } else { 0.0 })))
    };
    let mut sum = identity(1.0);
    for i in (1..terms).rev() {
        let weight = 1.0 / (i + CUBIC) as f64;
        sum = multiply::<T, F, N>(&ah, &sum).map(|row| row.map(|v| v * weight));
        (0..N).for_each(|d| sum[d][d] += 1.0);
    }
    let mut weights = [1.0; CUBIC + 1];
    for k in 1..=CUBIC {
        weights[k] = weights[k - 1] * h / k as f64;
    }
    let mut all = [identity(0.0); CUBIC + 1];
    all[CUBIC] = sum.map(|row| row.map(|v| v * weights[CUBIC]));
    for k in (0..CUBIC).rev() {
        all[k] = multiply::<T, F, N>(a, &all[k + 1]);
        (0..N).for_each(|d| all[k][d][d] += weights[k]);
    }
    all
}

#[inline(always)]
fn multiply<T: Real, const F: bool, const N: usize>(
    a: &Square<T, N>,
    b: &Square<T, N>,
) -> Square<T, N> {
    let mut out = [[T::zero_(); N]; N];
    for i in 0..N {
        for k in 0..N {
            for j in 0..N {
                out[i][j] = a[i][k].fma::<F>(b[k][j], out[i][j]);
            }
        }
    }
    out
}

#[inline(always)]
fn apply<T: Real, const N: usize>(a: &Square<T, N>, v: &[T; N]) -> [T; N] {
    std::array::from_fn(|i| dot(&a[i], v))
}

#[inline(always)]
fn dot<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    (0..N).fold(T::zero_(), |sum, i| sum + a[i] * b[i])
}
