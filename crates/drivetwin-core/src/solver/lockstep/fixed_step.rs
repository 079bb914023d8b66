// SPDX-License-Identifier: MIT
//! Samples of several runs side by side: each joins at its own and leaves before the one in which a guard
//! could fall.

use crate::network::smooth_law::Sample;
use crate::number::{Coefficient, KernelFloat};
use crate::solver::exponential::fixed_step::{FixedSteps, step_samples};
use crate::solver::exponential::guards::StepState;
use crate::solver::exponential::propagator::Propagator;
use crate::solver::exponential::samples::{
    BLOCK, ChannelState, InputSource, SampleBuffer, SampleColumn, SharedInputs, room,
};
use crate::solver::hybrid::state::HybridState;
use crate::solver::inputs::SampleRange;
use crate::solver::lane_mask::{lane_mask, lanes_in};
use crate::solver::lockstep::inputs::PerLaneInputs;
use crate::solver::lockstep::lane::{LANES, LaneRun, LaneSink, LaneStatus, Lanes, SampleBlock};
use crate::solver::simd::{Kernel, dispatch_simd};

/// Runs before samples of one length.
pub(crate) struct FixedStepPass<'p, 'a> {
    pub state: &'p mut HybridState<'a, Lanes>,
    pub lanes: &'p mut [LaneRun<'a>],
    /// Channels that are not off.
    pub active: &'p [usize],
    /// Length of the samples, s.
    pub h: f64,
    /// Working space.
    pub columns: &'p mut Vec<SampleColumn<Lanes>>,
}

impl FixedStepPass<'_, '_> {
    /// Let all that stand before such samples pass them. Returns, as bits, those that have arrived at the end
    /// of such samples; the others are due.
    pub fn pass<const N: usize>(
        self,
        operators: &Propagator<Lanes, N>,
        record: &mut impl LaneSink,
    ) -> u32 {
        let passage = self;
        match operators.channels.len() {
            0 => dispatch_simd(PassKernel::<_, N, 0> { passage, operators, record }),
            1 => dispatch_simd(PassKernel::<_, N, 1> { passage, operators, record }),
            2 => dispatch_simd(PassKernel::<_, N, 2> { passage, operators, record }),
            _ => dispatch_simd(PassKernel::<_, N, 4> { passage, operators, record }),
        }
    }
}

/// [`FixedStepPass::pass`] with `A` channels.
struct PassKernel<'o, 'p, 'a, R, const N: usize, const A: usize> {
    passage: FixedStepPass<'p, 'a>,
    operators: &'o Propagator<Lanes, N>,
    record: &'o mut R,
}

impl<R: LaneSink, const N: usize, const A: usize> Kernel for PassKernel<'_, '_, '_, R, N, A> {
    type Output = u32;

    #[inline(always)]
    fn run<const F: bool>(self) -> u32 {
        let lanes = &*self.passage.lanes;
        let first = lanes[0].inputs;
        if lanes.iter().all(|lane| std::ptr::eq(lane.inputs, first)) {
            self.pass::<F, _>(&SharedInputs(first))
        } else {
            let of = |run: usize| lanes[if run < lanes.len() { run } else { 0 }].inputs;
            let together: PerLaneInputs<'_> = std::array::from_fn(of);
            self.pass::<F, _>(&together)
        }
    }
}

impl<R: LaneSink, const N: usize, const A: usize> PassKernel<'_, '_, '_, R, N, A> {
    #[inline(always)]
    fn pass<const F: bool, U: InputSource<Lanes>>(self, source: &U) -> u32 {
        let Self { passage, operators, record } = self;
        let FixedStepPass { state, lanes, active, h, columns } = passage;
        let mut pending_mask = lanes_at_samples(lanes);
        let segments_of_lanes = segments_of_lanes(lanes);
        let mut segment = next_segment(&segments_of_lanes, pending_mask);
        let inputs = lanes[0].inputs;
        let (last, end) = (inputs.segments(), segment + inputs.equal_from(segment));
        let mut trail = SampleBuffer::in_columns(std::mem::take(columns), A);
        let mut stretch = SampleBlock::new(segment);
        let mut front = StepState::<Lanes, N, A>::idle();
        let (mut active_mask, mut room) = (0, room());
        while segment < end {
            let joining_mask = pending_mask & lanes_at_segment(&segments_of_lanes, segment);
            if joining_mask != 0 {
                let sample = source.read(segment, &mut room);
                front.join::<F, _>(operators, joining_mask, &state.x, sample);
                active_mask |= joining_mask;
                pending_mask &= !joining_mask;
                stretch.begin(joining_mask);
            }
            let until = next_segment(&segments_of_lanes, pending_mask).min(end);
            if active_mask == 0 || stretch.count == BLOCK {
                record.write_block(state, active, trail.samples(), &stretch);
                segment = if active_mask == 0 { until } else { segment };
                stretch = SampleBlock::new(segment);
                continue;
            }
            let count = (until - segment).min(BLOCK - stretch.count);
            let steps = FixedSteps { range: SampleRange { first: segment, count }, h };
            let (count, fallen) = step_samples::<U, Lanes, F, N, A, 1>(
                operators,
                source,
                steps,
                &mut front,
                &mut trail,
                stretch.count,
                active_mask,
            );
            stretch.add(count, active_mask);
            segment += count;
            if fallen != 0 {
                for run in lanes_in(fallen) {
                    let x = |i: usize| trail.states(i)[stretch.count].0[run];
                    leave(state, &mut lanes[run], run, segment, x);
                    lanes[run].status = LaneStatus::NeedsTaylorStep;
                }
                // Those that have not fallen have passed the sample in which others did.
                active_mask &= !fallen;
                stretch.add(1, active_mask);
                segment += 1;
            }
        }
        for run in lanes_in(active_mask) {
            leave(state, &mut lanes[run], run, segment, |i: usize| front.x[i].0[run]);
        }
        if segment == last {
            stretch.add(1, active_mask);
        }
        record.write_block(state, active, trail.samples(), &stretch);
        *columns = trail.into_columns();
        active_mask
    }
}

impl<const N: usize, const A: usize> StepState<Lanes, N, A> {
    /// Add lanes (mask) with their states.
    #[inline(always)]
    fn join<const F: bool, U: Coefficient<Lanes, Values: Coefficient<Lanes>>>(
        &mut self,
        operators: &Propagator<Lanes, N>,
        runs: u32,
        x: &[Lanes],
        sample: &Sample<U>,
    ) {
        for (to, &from) in self.x.iter_mut().zip(x) {
            *to = to.replace_where(runs, from);
        }
        let fresh: [_; A] = ChannelState::start::<F, N, A, _>(operators, sample, &self.x);
        let first = operators.guards::<_, F, A>(sample, &self.x, &fresh);
        for a in 0..A {
            self.carry[a] = self.carry[a].replace_where(runs, &fresh[a]);
        }
        for (to, &from) in self.guards.as_flattened_mut().iter_mut().zip(first.as_flattened()) {
            *to = to.replace_where(runs, from);
        }
    }
}

/// Write the state of a lane at the start of a segment back.
fn leave(
    state: &mut HybridState<'_, Lanes>,
    lane: &mut LaneRun<'_>,
    run: usize,
    segment: usize,
    x: impl Fn(usize) -> f64,
) {
    for (i, to) in state.x.iter_mut().enumerate() {
        to.0[run] = x(i);
    }
    state.t.0[run] = lane.inputs.knot(segment);
    lane.segment = segment;
}

/// Runs that stand before samples, as bits.
fn lanes_at_samples(lanes: &[LaneRun<'_>]) -> u32 {
    lane_mask(lanes.iter().map(|lane| lane.status == LaneStatus::AtSample))
}

/// Segments of the runs, side by side.
fn segments_of_lanes(lanes: &[LaneRun<'_>]) -> [usize; LANES] {
    std::array::from_fn(|run| lanes.get(run).map_or(usize::MAX, |lane| lane.segment))
}

/// Runs at a segment, as bits.
fn lanes_at_segment(segments_of_lanes: &[usize; LANES], segment: usize) -> u32 {
    lane_mask(segments_of_lanes.iter().map(|&place| place == segment))
}

/// The first segment at which one of these runs stands.
fn next_segment(segments_of_lanes: &[usize; LANES], runs: u32) -> usize {
    lanes_in(runs).map(|run| segments_of_lanes[run]).min().unwrap_or(usize::MAX)
}
