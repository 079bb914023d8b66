// SPDX-License-Identifier: MIT
//! Known failure modes of fast clutch simulators (guards at sample ends, a frozen neighbour, drifting
//! locks, creeping lock-up). Each case compares default accuracy with round-off accuracy.

mod common;

use common::{clutch, compile, inertia, shaft, start, torque};
use drivetwin_core::model::elements::{Clutch, Element, OneWayClutch};
use drivetwin_core::model::{FrictionLaw, Stribeck};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{Output, RunOptions, Start, Trajectory, run};
use drivetwin_core::solver::{EventKind, Settings, Signal, Status};

type Column = (&'static str, Vec<f64>);

fn both(
    network: &Network<f64>,
    time: &[f64],
    columns: &[Column],
    start: &Start<f64>,
    output: &Output,
) -> [Trajectory<f64>; 2] {
    [Settings::default(), Settings::exact()].map(|settings| {
        let signals: Vec<(&str, Signal<'_, f64>)> =
            columns.iter().map(|(name, values)| (*name, Signal::samples(time, values))).collect();
        let outputs = std::slice::from_ref(output);
        let run =
            run(network, &signals, start, time, outputs, RunOptions { settings, audit: false })
                .unwrap();
        assert_eq!(run.status, Status::Completed);
        run
    })
}

fn samples(h: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| i as f64 * h).collect()
}

fn stribeck(name: &str, a: &str, b: &str) -> Clutch<f64> {
    let law = Stribeck { mu_c: 0.12, mu_s: 0.16, v_s: 3.0, mu_v: 1e-4 };
    Clutch { friction: FrictionLaw::Stribeck(law), ..clutch(name, a, b) }
}

fn kinds(run: &Trajectory<f64>) -> Vec<EventKind> {
    run.events.iter().map(|event| event.kind).collect()
}

fn worst(runs: &[Trajectory<f64>; 2]) -> f64 {
    let pairs = runs[0].columns[0].iter().zip(&runs[1].columns[0]);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// 1: a locked slip that drifts by round-off ends in loops of break-away and lock.
#[test]
fn a_long_lock_stays_one_lock_with_exactly_no_slip() {
    let time = samples(1e-3, 5000);
    let elements = vec![
        inertia("a", 2.0),
        inertia("b", 7.0),
        torque("a", "T"),
        Element::Clutch(clutch("C", "a", "b")),
    ];
    let pull: Vec<f64> = time.iter().map(|t| 40.0 * (9.0 * t).sin()).collect();
    let columns = [("T", pull), ("P C", vec![100.0; time.len()])];
    let begin = start(&[("a", 60.0), ("b", 0.0)], &[]);
    for run in both(&compile(elements), &time, &columns, &begin, &Output::Slip("C".into())) {
        assert_eq!(kinds(&run), [EventKind::Lock]);
        let locked = time.iter().zip(&run.columns[0]).filter(|(t, _)| **t > run.events[0].time);
        assert!(locked.map(|(_, slip)| slip.abs()).fold(0.0, f64::max) < 1e-10);
    }
}

/// 2: the torque changes its sign and the clutch empties within one sample: each sign has its guard.
#[test]
fn a_holding_torque_that_changes_sign_breaks_away_when_its_own_bound_is_reached() {
    let time = samples(1e-3, 40);
    let elements = vec![
        inertia("a", 1.0),
        inertia("b", 1.0),
        torque("a", "T"),
        Element::Clutch(clutch("C", "a", "b")),
    ];
    // Within the sample the clutch carries T/2 = 50 - 150 s and can carry 100 - 110 s: s = 15/26.
    let step = |k: usize, before: f64, after: f64| if k <= 20 { before } else { after };
    let columns = [
        ("T", (0..=40).map(|k| step(k, 100.0, -200.0)).collect()),
        ("P C", (0..=40).map(|k| step(k, 100.0, -10.0)).collect()),
    ];
    let begin = start(&[("a", 0.0), ("b", 0.0)], &["C"]);
    for run in both(&compile(elements), &time, &columns, &begin, &Output::Slip("C".into())) {
        assert_eq!(kinds(&run), [EventKind::BreakAway, EventKind::ClutchVented]);
        assert!(
            (run.events[0].time - (0.020 + 1e-3 * 15.0 / 26.0)).abs() < 1e-12,
            "{:?}",
            run.events
        );
    }
}

/// 3: with the other clutch's torque frozen over the step the order is lost while both slip.
#[test]
fn the_fourth_order_holds_while_two_clutches_slip() {
    let error = |h: f64| {
        let time = samples(h, (0.24 / h).round() as usize);
        let elements = vec![
            inertia("a", 0.4),
            inertia("b", 0.5),
            inertia("c", 3.0),
            torque("a", "T"),
            Element::Clutch(stribeck("C", "a", "b")),
            Element::Clutch(stribeck("D", "b", "c")),
        ];
        let ramp = |from: f64, rise: f64| time.iter().map(|t| from + rise * t).collect::<Vec<_>>();
        let columns =
            [("T", ramp(38.0, 0.0)), ("P C", ramp(300.0, 20.0)), ("P D", ramp(300.0, 0.0))];
        let begin = start(&[("a", 60.0), ("b", 52.0), ("c", 46.0)], &[]);
        let runs = both(&compile(elements), &time, &columns, &begin, &Output::Speed("b".into()));
        assert!(runs.iter().all(|run| run.events.is_empty()));
        worst(&runs)
    };
    let (coarse, fine) = (error(8e-3), error(4e-3));
    assert!(coarse > 1e-9, "nothing to measure: {coarse:.1e}");
    assert!(fine < coarse / 10.0, "{coarse:.1e} at 8 ms, {fine:.1e} at 4 ms");
}

/// 4: with μ falling over slip the motion creeps into lock under negative damping.
#[test]
fn a_creeping_lock_is_found_in_time() {
    let time = samples(1e-3, 1500);
    let elements = vec![
        inertia("a", 1.5),
        inertia("b", 0.3),
        inertia("c", 9.0),
        shaft("b", "c", 2.0e3, 1.0),
        torque("a", "T"),
        Element::Clutch(stribeck("C", "a", "b")),
    ];
    let columns =
        [("T", vec![50.0; time.len()]), ("P C", time.iter().map(|t| 520.0 + 30.0 * t).collect())];
    let begin = start(&[("a", 12.0), ("b", 0.0), ("c", 0.0)], &[]);
    let runs = both(&compile(elements), &time, &columns, &begin, &Output::Speed("a".into()));
    assert_eq!(kinds(&runs[0]), kinds(&runs[1]));
    assert!(kinds(&runs[0]).contains(&EventKind::Lock), "{:?}", runs[0].events);
    for (quick, exact) in runs[0].events.iter().zip(&runs[1].events) {
        assert!((quick.time - exact.time).abs() < 1e-6, "{quick:?} against {exact:?}");
    }
    assert!(worst(&runs) < 1e-4);
}

/// 5: a torque that exceeds the capacity between two samples and is back at the next.
#[test]
fn an_excursion_within_one_sample_breaks_away() {
    // Half a swing of the shaft fits one sample; its torque peaks in the middle.
    let (stiffness, member) = (8.0e3, 2.0);
    let omega = (stiffness / member * (1.0 + member / 1e6_f64)).sqrt();
    let h = 0.5 * std::f64::consts::PI / omega;
    let time = samples(h, 40);
    let elements = vec![
        inertia("a", 1e6),
        inertia("b", member),
        shaft("a", "b", stiffness, 0.0),
        Element::Clutch(clutch("C", "ground", "a")),
    ];
    let peak = 100.0;
    // At the samples the torque is at most cos(π/4) of its peak.
    let phase = 0.25 * std::f64::consts::PI;
    let mut begin = start(&[("a", 0.0), ("b", peak / stiffness * omega * phase.sin())], &["C"]);
    begin.twists = vec![("shaft a b".into(), peak / stiffness * phase.cos())];
    let columns = [("P C", vec![0.9 * peak; time.len()])];
    let runs = both(&compile(elements), &time, &columns, &begin, &Output::Slip("C".into()));
    for run in &runs {
        assert_eq!(run.events[0].kind, EventKind::BreakAway, "{:?}", run.events);
        assert!(run.events[0].time < 4.0 * h);
    }
    assert!((runs[0].events[0].time - runs[1].events[0].time).abs() < 1e-7);
}

/// A freewheel that is taken along for an eighth of a sample, at the crest of a swing far from standstill: at the
/// samples its slip is small and neither rises nor falls.
#[test]
fn a_touch_within_one_sample_takes_a_freewheel_along() {
    let (stiffness, member, crest) = (8.0e3, 2.0, 20.0);
    let omega = (stiffness / member * (1.0 + member / 1e6_f64)).sqrt();
    let h = 0.5 / omega;
    let time = samples(h, 40);
    let (a, b) = ("b".into(), "c".into());
    let elements = vec![
        inertia("a", 1e6),
        inertia("b", member),
        inertia("c", 1e6),
        shaft("a", "b", stiffness, 0.0),
        Element::OneWayClutch(OneWayClutch { name: "F".into(), a, b, clutch: None }),
    ];
    let phase = -3.5 * omega * h;
    let speeds = [("a", 0.0), ("b", crest * phase.cos()), ("c", 0.9995 * crest)];
    let mut begin = start(&speeds, &[]);
    begin.twists = vec![("shaft a b".into(), -crest / omega * phase.sin())];
    let runs = both(&compile(elements), &time, &[], &begin, &Output::Speed("b".into()));
    for run in &runs {
        assert_eq!(run.events[0].kind, EventKind::Lock, "{:?}", run.events);
        assert!((3.0 * h..3.5 * h).contains(&run.events[0].time));
    }
    assert!((runs[0].events[0].time - runs[1].events[0].time).abs() < 1e-7);
    assert!(worst(&runs) < 1e-4);
}

/// Samples far apart beside a stiff shaft, and chains of many masses: both are passed by exact operators
/// over parts of a sample, to the same accuracy.
#[test]
fn coarse_samples_and_long_chains_are_followed_as_closely() {
    for (h, masses) in [(2e-2, 1), (1e-2, 3), (1e-3, 9)] {
        let time = samples(h, (1.0 / h).round() as usize);
        let mut elements = vec![
            inertia("a", 2.0),
            inertia("b", 1.0),
            torque("a", "T"),
            Element::Clutch(stribeck("C", "a", "b")),
        ];
        let mut speeds = vec![("a", 80.0), ("b", 50.0)];
        let mut last = "b";
        for name in ["m1", "m2", "m3", "m4", "m5", "m6", "m7", "m8", "m9"].iter().take(masses) {
            elements.push(inertia(name, 8.0));
            elements.push(shaft(last, name, 2e4, 30.0));
            speeds.push((name, 50.0));
            last = name;
        }
        let torque: Vec<f64> = time.iter().map(|t| 60.0 + 25.0 * (9.0 * t).sin()).collect();
        let pressure: Vec<f64> = time.iter().map(|t| 500.0 + 1500.0 * t).collect();
        let columns = [("T", torque), ("P C", pressure)];
        let output = Output::Slip("C".into());
        let runs = both(&compile(elements), &time, &columns, &start(&speeds, &[]), &output);
        assert_eq!(kinds(&runs[0]), kinds(&runs[1]));
        assert_eq!(kinds(&runs[0]).last(), Some(&EventKind::Lock), "{masses} masses");
        assert!(worst(&runs) < 1e-6, "{h} s, {masses} masses: {}", worst(&runs));
    }
}

/// Outputs between the samples of inputs that come late: every point of the grid is met, by exact
/// operators over the pieces that recur.
#[test]
fn outputs_between_late_samples_are_those_of_the_exact_motion() {
    let time = samples(5e-3, 300);
    let grid: Vec<f64> = (0..1000).map(|i| 0.1 + 1.3e-3 * f64::from(i)).collect();
    let elements = vec![
        inertia("a", 2.0),
        inertia("b", 9.0),
        torque("a", "T"),
        Element::Clutch(stribeck("C", "a", "b")),
    ];
    let network = compile(elements);
    let torque: Vec<f64> = time.iter().map(|t| 60.0 + 25.0 * (9.0 * t).sin()).collect();
    let pressure: Vec<f64> = time.iter().map(|t| 500.0 + 1500.0 * t).collect();
    let late = Signal::Samples { times: &time, values: &torque, delay: 1.7e-3 };
    let signals = [("T", late), ("P C", Signal::samples(&time, &pressure))];
    let begin = start(&[("a", 80.0), ("b", 50.0)], &[]);
    let outputs = [Output::Speed("a".into())];
    let runs = [Settings::default(), Settings::exact()].map(|settings| {
        run(&network, &signals, &begin, &grid, &outputs, RunOptions { settings, audit: false })
            .unwrap()
    });
    assert!(runs.iter().all(|run| run.time == grid && run.status == Status::Completed));
    assert_eq!(kinds(&runs[0]), [EventKind::Lock]);
    assert!((runs[0].events[0].time - runs[1].events[0].time).abs() < 1e-8);
    assert!(worst(&runs) < 1e-6, "{}", worst(&runs));
}
