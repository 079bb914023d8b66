// SPDX-License-Identifier: MIT
//! Results as plain tuples for Python.

use drivetwin_core::simulate::{EnergyAudit, Trajectory};
use drivetwin_core::solver::EventKind;

/// Time [s], element, kind.
pub type Event = (f64, String, &'static str);
/// Source, stored, friction, gear loss, shaft, load, converter, created, error [J].
pub type Audit = (f64, f64, f64, f64, f64, f64, f64, f64, f64);

/// Events with the names of their elements.
pub fn events_of(run: &Trajectory<f64>) -> Vec<Event> {
    let events = run.events.iter();
    events.map(|e| (e.time, run.elements[e.element].clone(), kind_name(e.kind))).collect()
}

/// The audit in the order of its type.
pub fn as_tuple(a: EnergyAudit) -> Audit {
    (a.source, a.stored, a.friction, a.gear_loss, a.shaft, a.load, a.converter, a.created, a.error)
}

fn kind_name(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Lock => "lock",
        EventKind::BreakAway => "break_away",
        EventKind::Reverse => "reverse",
        EventKind::ClutchFilled => "fill",
        EventKind::ClutchVented => "vent",
    }
}
