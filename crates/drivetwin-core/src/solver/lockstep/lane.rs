// SPDX-License-Identifier: MIT
//! State of one lane of a lockstep batch, and the sample blocks that lanes pass.

use crate::number::SimdVector;
use crate::solver::exponential::samples::Samples;
use crate::solver::hybrid::event::EventCause;
use crate::solver::hybrid::stall::StallDetector;
use crate::solver::hybrid::state::HybridState;
use crate::solver::hybrid::stiffness::ShortenedSteps;
use crate::solver::inputs::Inputs;
use crate::solver::lane_mask::lanes_in;

/// Lanes of a batch: two vectors of the narrower instruction sets, one of the widest.
pub const LANES: usize = 8;

/// A number of every lane of a batch.
pub type Lanes = SimdVector<LANES>;

/// Consumer of the samples of a lockstep batch.
pub trait LaneSink {
    /// A stretch of samples that were passed in one mode with the channels `active`.
    fn write_block(
        &mut self,
        state: &HybridState<'_, Lanes>,
        active: &[usize],
        samples: Samples<'_, Lanes>,
        stretch: &SampleBlock,
    );

    /// The runs `runs`, as bits, are at the samples `knots`, `h` [s] after the start of the expansion.
    fn write_sample(
        &mut self,
        state: &HybridState<'_, Lanes>,
        runs: u32,
        knots: &[usize; LANES],
        h: Lanes,
    );
}

/// Status of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LaneStatus {
    /// At the start of its segment, to pass samples.
    AtSample,
    /// A Taylor step comes next.
    NeedsTaylorStep,
    /// At an event.
    Event(EventCause),
    /// At the start of a segment without length: the inputs jump.
    AtInputJump,
    /// At the end of the inputs.
    Finished,
    /// Diverged from the batch; runs again alone or in another batch.
    Diverged,
}

impl LaneStatus {
    /// Return true while the lane has not finished or diverged.
    pub(crate) fn is_open(self) -> bool {
        !matches!(self, Self::Finished | Self::Diverged)
    }
}

/// One run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneRun<'a> {
    /// Its inputs.
    pub inputs: &'a Inputs<f64>,
    /// Segment in which it stands; their number at the end.
    pub segment: usize,
    /// Status there.
    pub status: LaneStatus,
    pub progress: StallDetector,
    /// Taylor steps that its motion shortened.
    pub shortened: ShortenedSteps,
}

/// Samples that have been passed but not handed on.
pub struct SampleBlock {
    /// Number of the first.
    pub first: usize,
    /// Number of samples.
    pub count: usize,
    /// Range of these samples for each lane: first, end.
    pub spans: [(usize, usize); LANES],
}

impl SampleBlock {
    pub(crate) fn new(first: usize) -> Self {
        Self { first, count: 0, spans: [(0, 0); LANES] }
    }

    /// Samples begin for some runs, as bits.
    pub(crate) fn begin(&mut self, runs: u32) {
        lanes_in(runs).for_each(|run| self.spans[run] = (self.count, self.count));
    }

    /// More samples, for some runs, as bits.
    pub(crate) fn add(&mut self, count: usize, runs: u32) {
        self.count += count;
        lanes_in(runs).for_each(|run| self.spans[run].1 = self.count);
    }
}
