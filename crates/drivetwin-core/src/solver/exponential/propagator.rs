// SPDX-License-Identifier: MIT
//! Propagator of one mode: exact step operators over samples of equal length h.
//!
//! In one mode `x' = A x + B u + c + E φ`. Over a sample the inputs are linear and a channel φ is a
//! cubic, the sum of [`N_BASIS`] with the coefficients a, so that the state at the end, the argument of
//! every channel there and its rate are linear in x, u, u', a. Channels count in their direction of
//! motion: `τ = sign · φ` over `m = sign · unit · s`.

use crate::network::smooth_law::{AffineForm, MAX_INPUTS, SmoothLaw};
use crate::network::{Mode, Network};
use crate::number::{KernelFloat, Number, Values};
use crate::solver::exponential::phi::{
    FORCING_DEGREE, ForceResponse, ForceResponses, N_BASIS, PhiFunctions, add_to_diagonal, dot,
    double_transition, doublings, forcing_response, phi_functions, span,
};
use crate::solver::simd::{Kernel, dispatch_simd};
use crate::solver::sine::Wave;
use crate::solver::tolerances::{
    MAX_SPECTRAL_STEP_LINEAR, MAX_SPECTRAL_STEP_SLIPPING, MIN_CHORD_DEVIATION_OF_RISE,
    MIN_CHORD_DEVIATION_OF_SIZE,
};
use smallvec::SmallVec;

/// Most channels that are carried at once.
pub const MAX_ACTIVE: usize = 4;
/// Most torques and speeds that are watched at once.
pub const MAX_GUARDS: usize = 12;

/// Operators over at most `N` states; unused states, channels and forms are zero.
#[derive(Clone, Debug)]
pub struct Propagator<L, const N: usize> {
    /// Number of states.
    pub states: usize,
    /// True if chords do not bound torques within a sample: the motion is too fast.
    pub is_stiff: bool,
    /// True if there are more guards than there is room for.
    pub is_overfull: bool,
    /// Largest deviation of a watched torque from its chord within a sample, relative to its rise and to
    /// its size.
    pub chord_deviation: [L; 2],
    /// Signs of the carried channels.
    pub signs: [L; MAX_ACTIVE],
    /// Columns of the transition matrix.
    pub transition: [[L; N]; N],
    /// State at the end without initial state and inputs.
    pub constant: [L; N],
    /// Inputs that act on the state.
    pub inputs: Vec<InputMap<L, N>>,
    /// Carried channels.
    pub channels: Vec<ChannelCoefficients<L, N>>,
    /// Forms that must stay within their limits.
    pub guards: Vec<SampleGuard<L, N>>,
    /// Normal loads that must stay above zero.
    pub loads: Vec<AffineForm<L>>,
}

/// Effect of one input; pairs are those of its value at the start and of its rate, per second. On rates and turns
/// of the arguments as in [`ChannelCoefficients`].
#[derive(Clone, Copy, Debug)]
pub struct InputMap<L, const N: usize> {
    /// Its index.
    pub input: usize,
    /// On the state at the end.
    pub step: [[L; N]; 2],
    /// On the arguments at the end.
    pub argument: [[L; 2]; MAX_ACTIVE],
    /// On the rates of the arguments, directly.
    pub now: [L; MAX_ACTIVE],
    /// On how they turn at the start.
    pub half_second_derivative: [[L; 2]; MAX_ACTIVE],
    /// On the watched forms.
    pub guards: [L; MAX_GUARDS],
}

/// A linear form over state, constant and cubics.
#[derive(Clone, Copy, Debug)]
pub struct StepForm<L, const N: usize> {
    /// Over the state at the start.
    pub state: [L; N],
    /// Constant.
    pub constant: L,
    /// Over the cubics of the carried channels.
    pub cubics: [[L; N_BASIS]; MAX_ACTIVE],
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

/// Coefficients of a channel and its argument. Rates are per sample: the rise over a sample at constant
/// rate.
#[derive(Clone, Copy, Debug)]
pub struct ChannelCoefficients<L, const N: usize> {
    /// Response of the state at the end to the coefficients of the cubic.
    pub forcing_response: [[L; N]; N_BASIS],
    /// Argument `m` at any instant, over the state.
    pub argument: [L; N],
    /// Argument at the end.
    pub argument_end: StepForm<L, N>,
    /// Contribution of the cubics of the carried channels, through the state, to its rate at the end.
    pub rate_end: [[L; N_BASIS]; MAX_ACTIVE],
    /// Rate of the argument at any instant.
    pub rate: Form<L, N>,
    /// Half the second derivative of the argument at the start, over a sample.
    pub half_second_derivative: StepForm<L, N>,
    /// Its law.
    pub law: SmoothLaw<L>,
    /// Rise of the normal load in a sample, over the rate of its input.
    pub load_slope: L,
}

/// A guard, over the torques of the carried channels.
#[derive(Clone, Copy, Debug)]
pub struct SampleGuard<L, const N: usize> {
    /// A torque, or what a speed rises by in a third of a sample at its rate.
    pub form: Form<L, N>,
    /// Condition that must hold.
    pub bound: Bound<L, N>,
}

/// Condition of a guard.
#[derive(Clone, Copy, Debug)]
pub enum Bound<L, const N: usize> {
    /// A torque stays within a limit over an input: `limit(u) - |form|` where both signs are bounded and
    /// `side` is 1, else `limit(u) + form` and it is -1.
    Within {
        /// The limit.
        limit: AffineForm<L>,
        /// 1 if both signs are bounded, -1 if only the negative one is.
        side: L,
    },
    /// A speed over the states stays above zero.
    Above([L; N]),
    /// `limit(u) + side · form` stays above zero in a motion of any speed.
    Rising {
        /// The limit.
        limit: AffineForm<L>,
        /// 1 or -1.
        side: L,
        /// Rise of `side · form` in a third of a sample at the rate of the states, over these.
        third: Form<L, N>,
        /// Rise of `side · form` over the inputs that act on the state.
        inputs: [L; MAX_INPUTS],
    },
}

impl<T: Number, const N: usize> Propagator<T, N> {
    /// Build for steps of length `h` [s] with the channels `active` under `laws`; `None` where the step
    /// is too long for the mode. Nothing is watched yet.
    pub fn build(
        network: &Network<T>,
        mode: &Mode<T>,
        active: &[usize],
        laws: &[SmoothLaw<T>],
        waves: &[Option<Wave>],
        h: f64,
    ) -> Option<Self> {
        dispatch_simd(BuildKernel { network, mode, active, laws, waves, h })
    }

    /// Add the active channel number `slot`.
    #[inline(always)]
    fn carry<const F: bool>(
        &mut self,
        slot: usize,
        kernel: &BuildKernel<'_, T, N>,
        forcing_response: &[[[T; N]; N_BASIS]],
    ) {
        let BuildKernel { network, mode, active, laws, h, .. } = *kernel;
        let (law, n) = (laws[slot], network.states());
        let mut argument = [T::zero_(); N];
        for (to, &c) in argument.iter_mut().zip(&network.channels[active[slot]].arguments[0]) {
            *to = c * law.sign * law.unit;
        }
        let now = over_basis::<T, F, N>(network, mode, &argument, h);
        let mut rate = [T::zero_(); N];
        rate[..network.states()].copy_from_slice(&now[..network.states()]);
        let second = over_basis::<T, F, N>(network, mode, &rate, 0.5 * h);
        for drive in &mut self.inputs {
            let ([held, load_slope], input) = (&drive.step, network.first_input() + drive.input);
            drive.argument[slot] =
                [dot::<T, F, N>(&argument, held, n), dot::<T, F, N>(&argument, load_slope, n)];
            drive.now[slot] = now[input];
            drive.half_second_derivative[slot] = [second[input], now[input] * (0.5 * h)];
        }
        let argument_end = self.at_end::<F>(&argument, forcing_response);
        let rate_end = over_moments::<T, F, N>(&rate, forcing_response, n);
        let rate = Form::over(network, active, &self.signs, &now);
        let Form { state, constant, channels } = Form::over(network, active, &self.signs, &second);
        let mut half_second_derivative = StepForm { state, constant, ..StepForm::idle() };
        for other in 0..MAX_ACTIVE {
            half_second_derivative.cubics[other][0] = channels[other];
            half_second_derivative.cubics[other][1] = rate.channels[other] * 0.5;
        }
        self.channels.push(ChannelCoefficients {
            forcing_response: forcing_response[slot],
            argument,
            argument_end,
            rate_end,
            rate,
            half_second_derivative,
            law,
            load_slope: law.normal.gain * h,
        });
    }

    /// A form over the states, at the end of a sample.
    #[inline(always)]
    fn at_end<const F: bool>(
        &self,
        row: &[T; N],
        forcing_response: &[[[T; N]; N_BASIS]],
    ) -> StepForm<T, N> {
        let mut form = StepForm::idle();
        for j in 0..span::<T, N>(self.states) {
            form.state[j] = dot::<T, F, N>(row, &self.transition[j], self.states);
        }
        form.constant = dot::<T, F, N>(row, &self.constant, self.states);
        form.cubics = over_moments::<T, F, N>(row, forcing_response, self.states);
        form
    }
}

/// [`Propagator::build`], to be dispatched.
struct BuildKernel<'b, T, const N: usize> {
    network: &'b Network<T>,
    mode: &'b Mode<T>,
    active: &'b [usize],
    laws: &'b [SmoothLaw<T>],
    waves: &'b [Option<Wave>],
    h: f64,
}

impl<T: Number, const N: usize> BuildKernel<'_, T, N> {
    /// Responses to the constant and to the inputs, at the first step; `None` to inputs that do not act on the
    /// state.
    #[inline(always)]
    fn responses<const F: bool>(&self, s: &PhiFunctions<T, N>) -> ForceResponses<T, N> {
        let Self { network, mode, waves, .. } = *self;
        let (n, inputs) = (network.states(), network.mechanism.inputs.len());
        let mut responses = vec![None; 1 + inputs];
        responses[0] = Some(ForceResponse::of::<F>(s, &forcing(mode, network.one()), None, n));
        for input in 0..inputs {
            if network.is_driven_by(input) {
                let force = forcing(mode, network.first_input() + input);
                let omega = waves.get(input).copied().flatten().map(|wave| wave.omega);
                responses[1 + input] = Some(ForceResponse::of::<F>(s, &force, omega, n));
            }
        }
        responses
    }

    /// Effects of the constant and of the inputs that act on the state.
    #[inline(always)]
    fn add_inputs(&self, operators: &mut Propagator<T, N>, responses: &ForceResponses<T, N>) {
        operators.constant = responses[0].map_or(operators.constant, |response| response.ramp[0]);
        for (input, response) in responses[1..].iter().enumerate() {
            let Some(ForceResponse { ramp: mut step, wave }) = *response else { continue };
            if let Some(wave) = wave {
                // The offset is there throughout, and the wave is what the input is off it.
                let offset = self.waves[input].map_or(0.0, |wave| wave.offset);
                for i in 0..N {
                    operators.constant[i] += (step[0][i] - wave.parts[0][i]) * offset;
                }
                step = wave.parts;
            }
            operators.inputs.push(InputMap::new(input, step));
        }
    }
}

impl<T: Number, const N: usize> Kernel for BuildKernel<'_, T, N> {
    type Output = Option<Propagator<T, N>>;

    #[inline(always)]
    fn run<const F: bool>(self) -> Option<Propagator<T, N>> {
        let Self { network, mode, active, laws, waves, h } = self;
        let reach = mode.spectral_radius * h;
        let longest = match active.is_empty() {
            true if T::RUNS == 1 => f64::INFINITY,
            true => MAX_SPECTRAL_STEP_LINEAR,
            false => MAX_SPECTRAL_STEP_SLIPPING,
        };
        if reach.re().decide(|reach| reach > longest) {
            return None;
        }
        let doublings = if T::RUNS == 1 { doublings(reach.re().run_value(0), waves, h) } else { 0 };
        if doublings > 0 && !active.is_empty() {
            return None;
        }
        let first = h * 0.5_f64.powi(doublings);
        let n = network.states();
        let mut a = [[T::zero_(); N]; N];
        for i in 0..n {
            a[i][..n].copy_from_slice(&mode.derivative.row(i)[..n]);
        }
        let mut s = [[[T::zero_(); N]; N]; FORCING_DEGREE + 1];
        phi_functions::<T, F, N>(&a, first, reach * (first / h), n, &mut s);
        let mut responses = self.responses::<F>(&s);
        let mut length = first;
        for _ in 0..doublings {
            for response in responses.iter_mut().flatten() {
                response.double::<F>(&s[0], length, n);
            }
            double_transition::<T, F, N>(&mut s[0], n);
            length *= 2.0;
        }
        add_to_diagonal(&mut s[0], T::of(1.0));
        let mut operators = Propagator::empty(n, reach);
        operators.inputs.reserve_exact(network.mechanism.inputs.len());
        operators.channels.reserve_exact(active.len());
        for i in 0..span::<T, N>(n) {
            for j in 0..span::<T, N>(n) {
                operators.transition[j][i] = s[0][i][j];
            }
        }
        self.add_inputs(&mut operators, &responses);
        let mut forced: SmallVec<[[[T; N]; N_BASIS]; 2]> = SmallVec::new();
        for (slot, &j) in active.iter().enumerate() {
            operators.signs[slot] = laws[slot].sign;
            let mut force = forcing(mode, network.first_channel() + j);
            for i in 0..span::<T, N>(n) {
                force[i] *= laws[slot].sign;
            }
            forced.push(forcing_response::<T, F, N>(&s, &force, h, n));
        }
        for slot in 0..active.len() {
            operators.carry::<F>(slot, &self, &forced);
        }
        // Inner loops exist for 0, 1, 2 and 4 channels.
        if operators.channels.len() == 3 {
            operators.channels.push(ChannelCoefficients::idle());
        }
        Some(operators)
    }
}

/// A form over the states, over the cubics of the carried channels at the end of a sample.
#[inline(always)]
fn over_moments<T: Number, const F: bool, const N: usize>(
    row: &[T; N],
    forcing_response: &[[[T; N]; N_BASIS]],
    n: usize,
) -> [[T; N_BASIS]; MAX_ACTIVE] {
    let mut cubics = [[T::zero_(); N_BASIS]; MAX_ACTIVE];
    for (cubic, forcing_response) in cubics.iter_mut().zip(forcing_response) {
        for k in 0..N_BASIS {
            cubic[k] = dot::<T, F, N>(row, &forcing_response[k], n);
        }
    }
    cubics
}

/// Rates of the states by one entry of the basis.
#[inline(always)]
fn forcing<T: Number, const N: usize>(mode: &Mode<T>, column: usize) -> [T; N] {
    let mut force = [T::zero_(); N];
    for i in 0..mode.derivative.rows {
        force[i] = mode.derivative[(i, column)];
    }
    force
}

impl<T: Number, const N: usize> Propagator<T, N> {
    /// Of `n` states that turn by `reach` within a step, without any effect.
    fn empty(n: usize, reach: T) -> Self {
        let (reach, none) = (reach.re(), T::zero_());
        // A motion that turns by ρh within the sample bends by (ρh)²/8; twice that, and never nothing.
        let chord_deviation = [
            reach.larger(T::Values::of(MIN_CHORD_DEVIATION_OF_RISE)),
            (reach * 0.25 * reach).larger(T::Values::of(MIN_CHORD_DEVIATION_OF_SIZE)),
        ]
        .map(T::promote);
        Self {
            states: n,
            is_overfull: false,
            is_stiff: reach.decide(|reach| reach > MAX_SPECTRAL_STEP_LINEAR),
            chord_deviation,
            signs: [none; MAX_ACTIVE],
            transition: [[none; N]; N],
            constant: [none; N],
            inputs: Vec::new(),
            channels: Vec::new(),
            guards: Vec::new(),
            loads: Vec::new(),
        }
    }
}

impl<L: KernelFloat, const N: usize> InputMap<L, N> {
    fn new(input: usize, step: [[L; N]; 2]) -> Self {
        Self { input, step, ..Self::idle() }
    }

    /// Create an input without effect.
    pub fn idle() -> Self {
        let none = L::splat(0.0);
        Self {
            input: 0,
            step: [[none; N]; 2],
            argument: [[none; 2]; MAX_ACTIVE],
            now: [none; MAX_ACTIVE],
            half_second_derivative: [[none; 2]; MAX_ACTIVE],
            guards: [none; MAX_GUARDS],
        }
    }
}

impl<L: KernelFloat, const N: usize> ChannelCoefficients<L, N> {
    /// Create a channel without torque.
    pub fn idle() -> Self {
        let none = L::splat(0.0);
        Self {
            forcing_response: [[none; N]; N_BASIS],
            argument: [none; N],
            argument_end: StepForm::idle(),
            rate_end: [[none; N_BASIS]; MAX_ACTIVE],
            rate: Form::idle(),
            half_second_derivative: StepForm::idle(),
            law: SmoothLaw::idle(),
            load_slope: none,
        }
    }
}

impl<L: KernelFloat, const N: usize> StepForm<L, N> {
    /// Always zero.
    fn idle() -> Self {
        let none = L::splat(0.0);
        Self { state: [none; N], constant: none, cubics: [[none; N_BASIS]; MAX_ACTIVE] }
    }
}

impl<L: KernelFloat, const N: usize> Form<L, N> {
    /// Always zero.
    fn idle() -> Self {
        let none = L::splat(0.0);
        Self { state: [none; N], constant: none, channels: [none; MAX_ACTIVE] }
    }
}

impl<T: Number, const N: usize> Form<T, N> {
    /// Of a row over the basis or over the states alone.
    pub(super) fn over(
        network: &Network<T>,
        active: &[usize],
        signs: &[T; MAX_ACTIVE],
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

impl<L: KernelFloat, const N: usize> Propagator<L, N> {
    /// Columns worth a product: few are taken as they are, so that their loop unrolls.
    #[inline(always)]
    pub fn columns(&self) -> usize {
        if N <= 4 { N } else { self.states }
    }
    /// Rows worth a product: all of plain numbers, which go together, and those in use of vectors.
    #[inline(always)]
    pub fn rows(&self) -> usize {
        if L::DERIVATIVES { self.columns() } else { N }
    }
}

/// A form over the states, differentiated and scaled: over the basis.
#[inline(always)]
pub(super) fn over_basis<T: Number, const F: bool, const N: usize>(
    network: &Network<T>,
    mode: &Mode<T>,
    row: &[T; N],
    scale: f64,
) -> Vec<T> {
    let mut out = vec![T::zero_(); network.basis()];
    for i in 0..network.states() {
        let rates = mode.derivative.row(i);
        for j in 0..rates.len() {
            out[j] = row[i].fma::<F>(rates[j], out[j]);
        }
    }
    for entry in &mut out {
        *entry *= scale;
    }
    out
}
