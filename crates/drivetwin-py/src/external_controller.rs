// SPDX-License-Identifier: MIT
//! Shift controllers in a library of the user, by the interface of `drivetwin_controller.h`.

#![allow(unsafe_code)] // The functions and the trace of the library are given as addresses.

use drivetwin_core::control::{Commands, Controller, Measured, RunningController};
use serde::Deserialize;
use std::sync::atomic::{AtomicU64, Ordering};

/// Tolerance [s] of times that are multiples of the task, as in the built-in controller.
const ROUND_OFF: f64 = 1e-9;
/// Numbers of a place of the trace: state, number of the call, then the inputs of the call.
const PLACE: usize = 2 + INPUTS;
/// Numbers of [`Inputs`].
const INPUTS: usize = 8;

/// Inputs of a step, as the header declares them.
#[repr(C)]
#[derive(Clone, Copy)]
struct Inputs {
    time: f64,
    offgoing_slip: f64,
    oncoming_slip: f64,
    engine_speed: f64,
    output_speed: f64,
    engine_torque: f64,
    system_pressure: f64,
    oil_temperature: f64,
}

/// Commands of a step, as the header declares them.
#[repr(C)]
struct Outputs {
    engine_torque: f64,
    offgoing_pressure: f64,
    oncoming_pressure: f64,
}

type StateSize = unsafe extern "C" fn() -> usize;
type Step = unsafe extern "C" fn(*const f64, *mut u8, *const Inputs, *mut Outputs);

/// Addresses of a loaded library, and of its trace: `places` of [`PLACE`] numbers of eight bytes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Library {
    state_size: usize,
    step: usize,
    trace: usize,
    places: usize,
}

/// Parameters of an external controller.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExternalController {
    request: f64,
    engine_torque: f64,
    system_pressure: f64,
    oil_temperature: f64,
    parameters: Vec<f64>,
}

/// External controller with its library.
#[derive(Debug)]
pub struct BoundController<'l> {
    given: &'l ExternalController,
    library: &'l Library,
}

impl ExternalController {
    /// Bind the parameters to the functions of a library.
    pub fn bind<'l>(&'l self, library: &'l Library) -> BoundController<'l> {
        BoundController { given: self, library }
    }
}

impl Controller for BoundController<'_> {
    fn start(&self) -> Box<dyn RunningController + '_> {
        // SAFETY: the caller gave the address of a function of this type in a loaded library.
        let size = unsafe { std::mem::transmute::<usize, StateSize>(self.library.state_size)() };
        let words = size.div_ceil(size_of::<u128>()).max(1);
        Box::new(Run {
            of: self,
            state: vec![0; words],
            last: Commands {
                engine_torque: self.given.engine_torque,
                offgoing: self.given.system_pressure,
                oncoming: 0.0,
            },
            place: Place::take(self.library),
        })
    }
}

/// One run of an external controller; the state begins with zeros and has the alignment of any C type.
struct Run<'l> {
    of: &'l BoundController<'l>,
    state: Vec<u128>,
    last: Commands,
    place: Option<Place<'l>>,
}

impl RunningController for Run<'_> {
    fn commands(&self) -> Commands {
        self.last
    }

    fn step(&mut self, time: f64, measured: &Measured) -> Commands {
        let given = self.of.given;
        let inputs = Inputs {
            time: time - given.request + ROUND_OFF,
            offgoing_slip: measured.slips.offgoing,
            oncoming_slip: measured.slips.oncoming,
            engine_speed: measured.engine_speed,
            output_speed: measured.output_speed,
            engine_torque: given.engine_torque,
            system_pressure: given.system_pressure,
            oil_temperature: given.oil_temperature,
        };
        let mut found = Outputs {
            engine_torque: self.last.engine_torque,
            offgoing_pressure: self.last.offgoing,
            oncoming_pressure: self.last.oncoming,
        };
        if let Some(place) = &self.place {
            place.enter(&inputs);
        }
        // SAFETY: a function of this type by its address; the state has the size that the library asked for.
        unsafe {
            let step = std::mem::transmute::<usize, Step>(self.of.library.step);
            let state = self.state.as_mut_ptr().cast();
            step(given.parameters.as_ptr(), state, &raw const inputs, &raw mut found);
        }
        if let Some(place) = &self.place {
            place.leave();
        }
        let limit = |pressure: f64| {
            if pressure.is_nan() { pressure } else { pressure.clamp(0.0, given.system_pressure) }
        };
        self.last = Commands {
            engine_torque: found.engine_torque,
            offgoing: limit(found.offgoing_pressure),
            oncoming: limit(found.oncoming_pressure),
        };
        self.last
    }
}

/// Place of a run in the trace, by which another process finds the call that did not return.
///
/// The first number is 0 for a free place, 1 for a taken one and 2 during a call.
struct Place<'l>(&'l [AtomicU64]);

impl<'l> Place<'l> {
    /// Take a free place; none where all are taken.
    fn take(library: &'l Library) -> Option<Self> {
        if library.trace == 0 {
            return None;
        }
        // SAFETY: the caller keeps this many numbers at the address while the runs last.
        let all = unsafe {
            let first = std::ptr::with_exposed_provenance::<AtomicU64>(library.trace);
            std::slice::from_raw_parts(first, library.places * PLACE)
        };
        all.chunks_exact(PLACE)
            .find(|one| one[0].compare_exchange(0, 1, Ordering::AcqRel, Ordering::Relaxed).is_ok())
            .map(Self)
    }

    fn enter(&self, inputs: &Inputs) {
        let all = [
            inputs.time,
            inputs.offgoing_slip,
            inputs.oncoming_slip,
            inputs.engine_speed,
            inputs.output_speed,
            inputs.engine_torque,
            inputs.system_pressure,
            inputs.oil_temperature,
        ];
        for (to, value) in self.0[2..].iter().zip(all) {
            to.store(value.to_bits(), Ordering::Relaxed);
        }
        self.0[1].fetch_add(1, Ordering::Relaxed);
        self.0[0].store(2, Ordering::Release);
    }

    fn leave(&self) {
        self.0[0].store(1, Ordering::Release);
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0[0].store(0, Ordering::Release);
    }
}
