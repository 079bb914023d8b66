// SPDX-License-Identifier: MIT
//! One sample: the torques of slipping elements as cubics, predicted and corrected.

use crate::network::smooth_law::Sample;
use crate::number::{Coefficient, KernelFloat, SMALL, Values};
use crate::solver::exponential::phi::N_BASIS;
use crate::solver::exponential::propagator::{ChannelCoefficients, MAX_ACTIVE, Propagator};
use crate::solver::exponential::samples::{ChannelState, add_channels};
use crate::solver::simd::{Kernel, dispatch_simd};
use crate::solver::tolerances::{CORRECTION_RTOL, CUBIC_RTOL, MAX_LINEARIZED_DISTANCE};

/// Number of shapes that value, rate and second derivative at the start give.
const N_START: usize = 3;
/// Number of those after them, which raise the value and the slope at the end.
const N_END: usize = N_BASIS - N_START;

/// Intermediate results of one step.
struct StepWork<L: KernelFloat, const N: usize, const A: usize> {
    /// State at the end.
    end: [L; N],
    /// Arguments at the end, and the part of their rates there that comes from the state.
    argument: [L; A],
    rate: [L; A],
    /// The part of these rates that comes from the inputs.
    direct: [L; A],
    /// Half the second derivatives of the arguments at the start: part without channels and state, and part
    /// by the state.
    half_second_derivative: [L; A],
    state_half_second_derivative: [L; A],
    /// Normal loads at the start and what they rise by.
    normal: [[L; 2]; A],
    /// Torques by the values available at the start.
    cubics: [[L; N_START]; A],
    /// Size of the torques at the start.
    size: L::Values,
    /// Negative where a guard has fallen.
    guard: L::Values,
}

/// Pass one sample; returns something negative where a guard of the carried channels has fallen.
#[inline(always)]
pub fn step<L: KernelFloat, U: Coefficient<L>, const F: bool, const N: usize, const A: usize>(
    op: &Propagator<L, N>,
    sample: &Sample<U>,
    h: f64,
    x: &mut [L; N],
    carry: &mut [ChannelState<L>; A],
) -> L::Values {
    let channels: &[_; A] = op.channels.first_chunk().expect("as many as are carried");
    let none = L::splat(0.0);
    let mut sampling = StepWork {
        end: op.constant,
        argument: [none; A],
        rate: [none; A],
        direct: [none; A],
        half_second_derivative: [none; A],
        state_half_second_derivative: [none; A],
        normal: [[none; 2]; A],
        cubics: [[none; N_START]; A],
        size: none.values(),
        guard: none.values(),
    };
    sampling.apply_linear::<F, U>(op, channels, sample, h, x);
    let expansion_points = sampling.extrapolate::<F>(channels, carry);
    sampling.predict::<F>(op, channels, carry, &expansion_points);
    sampling.correct::<F>(op, channels, carry);
    *x = sampling.end;
    sampling.guard
}

impl<L: KernelFloat, const N: usize, const A: usize> StepWork<L, N, A> {
    /// Apply the linear part of the propagator: state and inputs without channels.
    #[inline(always)]
    fn apply_linear<const F: bool, U: Coefficient<L>>(
        &mut self,
        op: &Propagator<L, N>,
        channels: &[ChannelCoefficients<L, N>; A],
        sample: &Sample<U>,
        h: f64,
        x: &[L; N],
    ) {
        let s = self;
        for a in 0..A {
            let c = &channels[a];
            s.argument[a] = c.argument_end.constant;
            s.direct[a] = c.rate.constant;
            s.half_second_derivative[a] = c.half_second_derivative.constant;
            let rise = sample[c.law.normal.input][1].multiply(c.load_slope);
            s.normal[a] = [c.law.normal.start::<F, U>(sample), rise];
        }
        for drive in &op.inputs {
            let [u, du] = sample[drive.input];
            let u_end = du.times(h) + u;
            for i in 0..op.rows() {
                s.end[i] = u.multiply_add::<F>(
                    drive.step[0][i],
                    du.multiply_add::<F>(drive.step[1][i], s.end[i]),
                );
            }
            for a in 0..A {
                if !L::DERIVATIVES {
                    s.argument[a] = pair::<L, U, F>(&drive.argument[a], u, du, s.argument[a]);
                }
                s.direct[a] = u_end.multiply_add::<F>(drive.now[a], s.direct[a]);
                s.half_second_derivative[a] = pair::<L, U, F>(
                    &drive.half_second_derivative[a],
                    u,
                    du,
                    s.half_second_derivative[a],
                );
            }
        }
        for j in 0..op.columns() {
            for i in 0..op.rows() {
                s.end[i] = op.transition[j][i].fma::<F>(x[j], s.end[i]);
            }
            for a in 0..A {
                let c = &channels[a];
                if !L::DERIVATIVES {
                    s.argument[a] = c.argument_end.state[j].fma::<F>(x[j], s.argument[a]);
                }
            }
        }
        for a in 0..A {
            s.state_half_second_derivative[a] =
                over_state::<L, F, N>(op, &channels[a].half_second_derivative.state, x);
        }
    }

    /// The cubics by value, rate and second derivative at the start. Returns the arguments about which the
    /// law is taken at the end, with stiction there, and leaves those of the next sample to carry.
    #[inline(always)]
    fn extrapolate<const F: bool>(
        &mut self,
        channels: &[ChannelCoefficients<L, N>; A],
        carry: &mut [ChannelState<L>; A],
    ) -> [[L; 2]; A] {
        let mut expansion_points = [[L::splat(0.0); 2]; A];
        let mut faded = [L::splat(0.0); A];
        for a in 0..A {
            let v = &carry[a].value;
            self.size = self.size.larger(v.value.values().magnitude());
            let drift = v.by_normal * self.normal[a][1];
            self.cubics[a][0] = v.value;
            self.cubics[a][1] = v.by_argument.fma::<F>(carry[a].rate, drift);
        }
        let mut farthest = L::Values::splat(0.0);
        for a in 0..A {
            let half_second_derivative = over_cubics::<L, F, A, 0, 2>(
                &channels[a].half_second_derivative.cubics,
                &self.cubics.map(|[value, slope, _]| [value, slope]),
                self.half_second_derivative[a],
            );
            let half_second_derivative =
                half_second_derivative + self.state_half_second_derivative[a];
            let (v, rate) = (&carry[a].value, carry[a].rate);
            let bent = v.half_second_derivative.fma::<F>(rate, v.mixed * self.normal[a][1]) * rate;
            self.cubics[a][2] = v.by_argument.fma::<F>(half_second_derivative, bent);
            if L::DERIVATIVES {
                continue;
            }
            expansion_points[a] = [carry[a].predicted_argument, carry[a].stiction];
            carry[a].predicted_argument =
                half_second_derivative.fma_times::<F>(4.0, rate + rate + carry[a].argument);
            let decay = expansion_points[a][0] - carry[a].predicted_argument;
            farthest = farthest.larger(decay.values().magnitude());
            faded[a] = carry[a].stiction.times_small_exp::<F>(decay);
        }
        if L::DERIVATIVES {
            return expansion_points;
        }
        let far = (L::Values::splat(SMALL) - farthest).negative_mask();
        if far != 0 {
            faded = evaluate_stiction(
                channels,
                std::array::from_fn(|a| carry[a].predicted_argument),
                faded,
                far,
            );
        }
        for a in 0..A {
            carry[a].stiction = faded[a];
        }
        expansion_points
    }

    /// The end that the cubics lead to, and the channels there.
    #[inline(always)]
    fn predict<const F: bool>(
        &mut self,
        op: &Propagator<L, N>,
        channels: &[ChannelCoefficients<L, N>; A],
        carry: &mut [ChannelState<L>; A],
        expansion_points: &[[L; 2]; A],
    ) {
        add_moments::<L, F, N, A, 0, N_START>(op, channels, &self.cubics, &mut self.end);
        for a in 0..A {
            let ChannelCoefficients { argument, argument_end, rate, law, .. } = &channels[a];
            let [predicted_argument, stiction] = expansion_points[a];
            let normal = self.normal[a][1] + self.normal[a][0];
            self.rate[a] = over_state::<L, F, N>(op, &rate.state, &self.end);
            if L::DERIVATIVES {
                // Few products, by way of the state and at the argument itself, where they count for more
                // than their order.
                self.argument[a] = over_state::<L, F, N>(op, argument, &self.end);
                let stiction = law.stiction::<F>(self.argument[a]);
                carry[a].value =
                    law.expand_at::<F>(self.argument[a], stiction).value_at_center(normal);
                continue;
            }
            let (cubics, from_near) = (&self.cubics, self.argument[a] - predicted_argument);
            let distance =
                over_cubics::<L, F, A, 0, N_START>(&argument_end.cubics, cubics, from_near);
            self.argument[a] = predicted_argument + distance;
            let friction = law.expand_at::<F>(predicted_argument, stiction);
            carry[a].value = friction.value_at::<F>(distance, normal);
            let guard = L::Values::splat(MAX_LINEARIZED_DISTANCE) - distance.values().magnitude();
            self.guard = self.guard.either_negative(guard);
        }
    }

    /// The cubics through the predicted end, the channels where these lead to, the end that follows from
    /// the torques there, and the channels at it.
    #[inline(always)]
    fn correct<const F: bool>(
        &mut self,
        op: &Propagator<L, N>,
        channels: &[ChannelCoefficients<L, N>; A],
        carry: &mut [ChannelState<L>; A],
    ) {
        let mut missing = [[L::splat(0.0); N_END]; A];
        let mut raised = [L::splat(0.0); A];
        for a in 0..A {
            let (v, [a0, a1, a2]) = (&carry[a].value, self.cubics[a]);
            let known = self.rate[a] + self.direct[a];
            let rate = add_channels::<L, F, N, A>(&channels[a].rate, carry, known);
            let drift = v.by_normal * self.normal[a][1];
            raised[a] = a0 + a1 + a2;
            missing[a] =
                [v.value - raised[a], v.by_argument.fma::<F>(rate, drift - (a1 + a2 + a2))];
        }
        let size = self.size + L::Values::splat(1.0);
        let mut reached = self.argument;
        for a in 0..A {
            let (form, none) = (&channels[a].argument_end.cubics, L::splat(0.0));
            let ds = over_cubics::<L, F, A, N_START, N_END>(form, &missing, none);
            reached[a] = reached[a] + ds;
            let corrected = carry[a].value.shifted::<F>(ds);
            let correction = (corrected.value - carry[a].value.value).values().magnitude();
            let close = size.times(CORRECTION_RTOL) - correction;
            self.guard = self.guard.either_negative(close);
            carry[a].value = corrected;
        }
        for a in 0..A {
            missing[a][0] = carry[a].value.value - raised[a];
        }
        add_moments::<L, F, N, A, N_START, N_END>(op, channels, &missing, &mut self.end);
        let mut early = [L::Values::splat(0.0); A];
        for a in 0..A {
            let ChannelCoefficients { argument_end, rate_end, .. } = &channels[a];
            let (argument, rate) = (self.argument[a], self.rate[a]);
            self.rate[a] = over_cubics::<L, F, A, N_START, N_END>(rate_end, &missing, rate);
            let [value, slope] = missing[a];
            let cubic = (slope - (value + value)).values().magnitude();
            self.guard = self.guard.either_negative(size.times(CUBIC_RTOL) - cubic);
            early[a] = carry[a].rate.values().times(1.0 / 3.0) + carry[a].argument.values();
            carry[a].argument =
                over_cubics::<L, F, A, N_START, N_END>(&argument_end.cubics, &missing, argument);
            let (v, left) = (&mut carry[a].value, carry[a].argument - reached[a]);
            v.value = v.by_argument.fma::<F>(left, v.value);
        }
        for a in 0..A {
            let ChannelCoefficients { rate, law, .. } = &channels[a];
            let known = self.rate[a] + self.direct[a];
            carry[a].rate = add_channels::<L, F, N, A>(rate, carry, known);
            // Between its ends the argument stays within these (Bernstein's form of the cubic).
            let (early, end) = (early[a], carry[a].argument.values());
            let late = end - carry[a].rate.values().times(1.0 / 3.0);
            let above = early.smaller(late).smaller(end) - law.from.values();
            let below = law.to.values() - early.larger(late).larger(end);
            self.guard = self.guard.either_negative(above).either_negative(below);
        }
    }
}

/// Stiction of the runs `far`, as bits, by the law. Apart, so that the samples without it stay one run of
/// instructions, which the compiler keeps in vectors.
#[cold]
#[inline(never)]
fn evaluate_stiction<L: KernelFloat, const N: usize, const A: usize>(
    channels: &[ChannelCoefficients<L, N>; A],
    predicted_argument: [L; A],
    faded: [L; A],
    far: u32,
) -> [L; A] {
    dispatch_simd(StictionKernel { channels, predicted_argument, faded, far })
}

/// [`evaluate_stiction`], to be dispatched.
struct StictionKernel<'c, L, const N: usize, const A: usize> {
    channels: &'c [ChannelCoefficients<L, N>; A],
    predicted_argument: [L; A],
    faded: [L; A],
    far: u32,
}

impl<L: KernelFloat, const N: usize, const A: usize> Kernel for StictionKernel<'_, L, N, A> {
    type Output = [L; A];

    #[inline(always)]
    fn run<const F: bool>(mut self) -> [L; A] {
        for a in 0..A {
            let stiction = self.channels[a].law.stiction::<F>(self.predicted_argument[a]);
            self.faded[a] = self.faded[a].replace_where(self.far, stiction);
        }
        self.faded
    }
}

#[inline(always)]
fn pair<L: KernelFloat, U: Coefficient<L>, const F: bool>(
    coefficients: &[L; 2],
    u: U,
    du: U,
    sum: L,
) -> L {
    u.multiply_add::<F>(coefficients[0], du.multiply_add::<F>(coefficients[1], sum))
}

#[inline(always)]
fn add_moments<
    L: KernelFloat,
    const F: bool,
    const N: usize,
    const A: usize,
    const FROM: usize,
    const COUNT: usize,
>(
    op: &Propagator<L, N>,
    channels: &[ChannelCoefficients<L, N>; A],
    cubics: &[[L; COUNT]; A],
    end: &mut [L; N],
) {
    for k in 0..COUNT {
        for a in 0..A {
            for i in 0..op.rows() {
                end[i] = channels[a].forcing_response[FROM + k][i].fma::<F>(cubics[a][k], end[i]);
            }
        }
    }
}

/// Value of a form over the state.
#[inline(always)]
fn over_state<L: KernelFloat, const F: bool, const N: usize>(
    op: &Propagator<L, N>,
    form: &[L; N],
    x: &[L; N],
) -> L {
    // Two chains of products, half as long.
    let mut sums = [form[0] * x[0], form[1] * x[1]];
    for i in 2..op.columns() {
        sums[i % 2] = form[i].fma::<F>(x[i], sums[i % 2]);
    }
    sums[0] + sums[1]
}

#[inline(always)]
fn over_cubics<
    L: KernelFloat,
    const F: bool,
    const A: usize,
    const FROM: usize,
    const COUNT: usize,
>(
    form: &[[L; N_BASIS]; MAX_ACTIVE],
    cubics: &[[L; COUNT]; A],
    sum: L,
) -> L {
    let mut sum = sum;
    for k in 0..COUNT {
        for a in 0..A {
            sum = form[a][FROM + k].fma::<F>(cubics[a][k], sum);
        }
    }
    sum
}
