// SPDX-License-Identifier: MIT
//! 3 The hybrid solver. It operates on friction elements, capacities and modes, not on components.
//!
//! Per mode the motion is analytic between input samples, so a step is a Taylor expansion in time
//! of the whole state; guards are polynomials of the same expansion and their first roots are the
//! events. The box-constrained programme of THEORY section 1 decides which elements stick.
//!
//! `hybrid` holds modes, events and Taylor steps, `exponential` the propagators of whole input
//! samples, `lockstep` several runs in the lanes of SIMD vectors.

mod banded;
mod cache;
mod exponential;
mod hybrid;
mod input_error;
mod inputs;
mod integrator;
mod interrupt;
mod lane_mask;
mod lockstep;
mod settings;
mod simd;
mod sine;
mod single;
mod status;
mod tolerances;
mod whitening;

pub use banded::BandedFactor;
pub use cache::SolverCache;
pub use exponential::plan::{supports_fixed_step, supports_lockstep};
pub use exponential::samples::{BLOCK, Samples};
pub use hybrid::event::{Event, EventKind, FrictionState};
pub use hybrid::state::HybridState;
pub use hybrid::taylor::TaylorExpansion;
pub use input_error::InputError;
pub use inputs::{Inputs, NO_POINT, SampleRange, Signal};
pub use integrator::Integrator;
pub use interrupt::with_interrupt;
pub(crate) use interrupt::{asks, token, with_token};
pub use lane_mask::lane_mask;
pub use lockstep::batch::run_lockstep;
pub use lockstep::lane::{LANES, LaneSink, Lanes, SampleBlock};
pub use settings::{Settings, Step};
pub(crate) use simd::{Kernel, dispatch_simd};
pub use single::SampleSink;
pub use status::Status;
pub use tolerances::MAX_SPECTRAL_STEP_SLIPPING;
pub use whitening::Whitening;
