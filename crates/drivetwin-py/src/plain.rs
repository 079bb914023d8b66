// SPDX-License-Identifier: MIT
//! Results as plain tuples for Python.

use drivetwin_core::simulate::{EnergyAudit, Trajectory};
use drivetwin_core::solver::EventKind;

/// Time [s], element, kind, energy lost in an impulse [J].
pub type Event = (f64, String, &'static str, f64);
/// Source, stored, friction, gear loss, shaft, load, converter, impulse, created, error [J].
pub type Audit = [f64; 10];

/// Events with the names of their elements.
pub fn events_of(run: &Trajectory<f64>) -> Vec<Event> {
    let events = run.events.iter();
    events.map(|e| (e.time, run.elements[e.element].clone(), kind_name(e.kind), e.energy)).collect()
}

/// The audit in the order of its type.
pub fn as_array(a: EnergyAudit) -> Audit {
    let heat = [a.friction, a.gear_loss, a.shaft, a.load, a.converter, a.impulse];
    let [friction, gear_loss, shaft, load, converter, impulse] = heat;
    let (created, error) = (a.created, a.error);
    [a.source, a.stored, friction, gear_loss, shaft, load, converter, impulse, created, error]
}

/// Describe the status, with the first event that only grazes: no derivatives after it.
pub fn status_of(run: &Trajectory<f64>) -> String {
    match &run.grazing {
        Some((time, element)) => {
            format!("{}; {element} grazes its event at {time:.9} s", run.status)
        }
        None => run.status.to_string(),
    }
}

fn kind_name(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Lock => "lock",
        EventKind::BreakAway => "break_away",
        EventKind::Reverse => "reverse",
        EventKind::ClutchFilled => "fill",
        EventKind::ClutchVented => "vent",
        EventKind::Impulse => "impulse",
    }
}
