// SPDX-License-Identifier: MIT
//! State of one lane of a lockstep batch, and the sample blocks that lanes pass.

use crate::number::Pack;
use crate::solver::exponential::samples::Samples;
use crate::solver::hybrid::event::EventCause;
use crate::solver::hybrid::stall::StallDetector;
use crate::solver::hybrid::state::HybridState;
use crate::solver::inputs::Inputs;
use crate::solver::lane_mask::lanes_in;

/// Runs in a formation: two vectors of the narrower sets, one of the widest.
pub const LANES: usize = 8;

/// A number of every run of a formation.
pub type Lanes = Pack<LANES>;

/// Takes what the runs of a formation come by.
pub trait LaneSink {
    /// A stretch of samples that were passed in one mode with the channels `active`.
    fn write_block(
        &mut self,
        state: &HybridState<'_, Lanes>,
        active: &[usize],
        samples: Samples<'_, Lanes>,
        stretch: &SampleBlock,
    );

    /// The runs `runs`, as bits, are at samples of their own, `h` [s] after the start of the expansion.
    fn write_sample(
        &mut self,
        state: &HybridState<'_, Lanes>,
        at: (u32, &[usize; LANES]),
        h: Lanes,
    );
}

/// Where a run stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LaneStatus {
    /// At the start of its segment, to pass samples.
    AtSample,
    /// In need of an expansion.
    NeedsTaylorStep,
    /// At an event.
    Event(EventCause),
    /// At the start of a segment without length: the inputs jump.
    AtInputJump,
    /// At the end of the inputs.
    Finished,
    /// On its own from here on.
    Diverged,
}

impl LaneStatus {
    /// Whether the run is still on its way.
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
    /// Where there.
    pub status: LaneStatus,
    pub progress: StallDetector,
}

/// Samples that have been passed but not handed on.
pub struct SampleBlock {
    /// Number of the first.
    pub first: usize,
    /// How many.
    pub count: usize,
    /// Of these those at which each run stood: from one to before another.
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
