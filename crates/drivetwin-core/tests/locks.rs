// SPDX-License-Identifier: MIT
//! Locks that hold (THEORY section 1): redundant locks, tie-up, grazing, pass-through.

mod common;

use common::{
    clutch, compile, constant, gear, grid, inertia, shaft, simulate, simulate_by, start, torque,
};
use drivetwin_core::model::elements::{Clutch, Element, Gear, GearLoss, OneWayClutch};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::simulate::{Output, RunOptions};
use drivetwin_core::solver::{EventKind, Settings, Status};

fn friction_torque(name: &str) -> Output {
    Output::FrictionTorque(name.into())
}

fn speed(node: &str) -> Output {
    Output::Speed(node.into())
}

/// One shaft held by two parallel brakes.
fn two_brakes() -> Vec<Element<f64>> {
    vec![
        inertia("shaft", 2.0),
        torque("shaft", "T"),
        Element::Clutch(clutch("A", "shaft", "ground")),
        Element::Clutch(clutch("B", "shaft", "ground")),
    ]
}

#[test]
fn redundant_locks_split_by_least_squares_of_their_utilisation() {
    let network = compile(two_brakes());
    let signals =
        [constant("T", 50.0, 1.0), constant("P A", 100.0, 1.0), constant("P B", 200.0, 1.0)];
    let outputs = [friction_torque("A"), friction_torque("B"), speed("shaft")];
    let run =
        simulate(&network, &signals, &start(&[("shaft", 0.0)], &[]), &grid(1.0, 11), &outputs);
    assert_eq!(run.status, Status::Completed);
    for i in 0..11 {
        // minimise (a/100)² + (b/200)² with a + b = 50
        assert!((run.columns[0][i] - 10.0).abs() < 1e-9, "{}", run.columns[0][i]);
        assert!((run.columns[1][i] - 40.0).abs() < 1e-9);
        assert!(run.columns[2][i].abs() < 1e-12);
    }
}

#[test]
fn a_redundant_lock_at_its_capacity_leaves_the_rest_to_the_other() {
    // The unbounded split of 10.5 would load B (capacity 10) with 10.4.
    let network = compile(two_brakes());
    let signals = [constant("T", 10.5, 1.0), constant("P A", 1.0, 1.0), constant("P B", 10.0, 1.0)];
    let outputs = [friction_torque("A"), friction_torque("B"), speed("shaft")];
    let run =
        simulate(&network, &signals, &start(&[("shaft", 0.0)], &[]), &grid(1.0, 11), &outputs);
    assert_eq!(run.status, Status::Completed);
    assert!((run.columns[0][5] - 0.5).abs() < 1e-9, "{}", run.columns[0][5]);
    assert!((run.columns[1][5] - 10.0).abs() < 1e-9);
    assert!(run.columns[2][10].abs() < 1e-12);
}

#[test]
fn redundant_locks_let_go_together_when_their_sum_is_exceeded() {
    let network = compile(two_brakes());
    let ramp = ("T", vec![0.0, 1.0], vec![0.0, 40.0]);
    let signals = [ramp, constant("P A", 10.0, 1.0), constant("P B", 20.0, 1.0)];
    let outputs = [speed("shaft"), friction_torque("A"), friction_torque("B")];
    let run =
        simulate(&network, &signals, &start(&[("shaft", 0.0)], &[]), &grid(1.0, 101), &outputs);
    assert_eq!(run.status, Status::Completed);
    let released: Vec<_> = run.events.iter().filter(|e| e.kind == EventKind::BreakAway).collect();
    assert_eq!(released.len(), 2);
    assert!(released.iter().all(|e| (e.time - 0.75).abs() < 1e-9), "{:?}", run.events);
    // 2 ω' = 40 (t - 0.75)
    let expected = 0.5 * 40.0 * 0.25 * 0.25 / 2.0;
    assert!((run.columns[0][100] - expected).abs() < 1e-9);
}

#[test]
fn a_brake_that_has_grown_stronger_takes_over_from_one_that_fades() {
    let network = compile(two_brakes());
    let signals = [
        constant("T", 50.0, 1.0),
        ("P A", vec![0.0, 1.0], vec![-20.0, 80.0]),
        ("P B", vec![0.0, 1.0], vec![80.0, 5.0]),
    ];
    let outputs = [friction_torque("A"), friction_torque("B"), speed("shaft")];
    let run =
        simulate(&network, &signals, &start(&[("shaft", 0.0)], &[]), &grid(1.0, 101), &outputs);
    // Their capacities, 80 - 75 t and from 0.2 s on 100 t - 20, are 65 together at least: enough for 50.
    assert!(run.events.iter().all(|e| e.kind != EventKind::BreakAway), "{:?}", run.events);
    for (k, t) in run.time.iter().enumerate() {
        let [one, two] = [run.columns[0][k], run.columns[1][k]];
        assert!((one + two - 50.0).abs() < 1e-9, "{one} + {two} at {t} s");
        assert!(one.abs() < (100.0 * t - 20.0).max(0.0) + 1e-9, "{one} at {t} s");
        assert!(two.abs() < 80.0 - 75.0 * t + 1e-9, "{two} at {t} s");
        assert!(run.columns[2][k].abs() < 1e-12);
    }
}

/// Engine and vehicle joined by two clutches of ratios 1 and 2 (two gears at once).
fn two_gears() -> Vec<Element<f64>> {
    vec![
        inertia("engine", 1.0),
        inertia("vehicle", 10.0),
        torque("engine", "T"),
        gear("low", "vehicle", 2.0),
        Element::Clutch(clutch("direct", "engine", "vehicle")),
        Element::Clutch(clutch("reduced", "engine", "low")),
    ]
}

#[test]
fn in_a_tie_up_one_element_slips_against_the_motion() {
    let network = compile(two_gears());
    let signals = [
        constant("T", 0.0, 8.0),
        constant("P direct", 50.0, 8.0),
        ("P reduced", vec![0.0, 0.5, 1.0, 8.0], vec![0.0, 0.0, 200.0, 200.0]),
    ];
    let moving = start(&[("engine", 20.0), ("vehicle", 20.0)], &["direct"]);
    let outputs = [
        speed("engine"),
        speed("vehicle"),
        Output::Slip("direct".into()),
        Output::Slip("reduced".into()),
        friction_torque("direct"),
        friction_torque("reduced"),
    ];
    let run = simulate(&network, &signals, &moving, &grid(8.0, 2001), &outputs);
    assert_eq!(run.status, Status::Completed);
    let audit = run.audit.unwrap();
    assert!(audit.friction > 0.0 && audit.error.abs() < 1e-9 * audit.friction);
    for i in 0..run.time.len() {
        let (direct, reduced) = (run.columns[2][i], run.columns[3][i]);
        let moves = run.columns[1][i].abs() > 1e-6;
        assert!(!(moves && direct.abs() < 1e-9 && reduced.abs() < 1e-9));
        assert!(direct * run.columns[4][i] >= -1e-9, "friction opposes slip");
        assert!(reduced * run.columns[5][i] >= -1e-9, "friction opposes slip");
    }
    // Both hold together only at rest: the tie-up brakes the vehicle to standstill.
    assert!(run.columns[1][2000].abs() < 1e-9);
}

#[test]
fn both_elements_hold_at_standstill() {
    let network = compile(two_gears());
    let signals = [
        constant("T", 30.0, 1.0),
        constant("P direct", 100.0, 1.0),
        constant("P reduced", 100.0, 1.0),
    ];
    let rest = start(&[("engine", 0.0), ("vehicle", 0.0)], &[]);
    let outputs = [speed("engine"), friction_torque("direct"), friction_torque("reduced")];
    let run = simulate(&network, &signals, &rest, &grid(1.0, 11), &outputs);
    assert_eq!(run.status, Status::Completed);
    assert!(run.columns[0].iter().all(|w| w.abs() < 1e-12));
    // Engine: d + r = 30; vehicle: d + 2 r = 0.
    assert!((run.columns[1][5] - 60.0).abs() < 1e-9);
    assert!((run.columns[2][5] + 30.0).abs() < 1e-9);
}

#[test]
fn a_twisted_shaft_between_locked_members_drives_no_power_through_a_lossy_gear() {
    // Two clutches hold against the shaft; all of it and the gear coast together.
    let signals = [constant("P A", 60.0, 1.0), constant("P B", 80.0, 1.0)];
    for i in 1..60 {
        let (w, i) = (30.0, f64::from(i));
        let ratio = 3.0 * i.sin();
        let Element::Gear(plain) = gear("left", "far", ratio) else { unreachable!() };
        let loss = GearLoss {
            eta_backward: Some(0.3),
            ..GearLoss::by_efficiency(LossLaw::Dissipative, 0.8)
        };
        let network = compile(vec![
            inertia("left", 1.1 + i.cos()),
            inertia("right", 2.4),
            inertia("far", 0.3),
            shaft("left", "right", 1950.0, 17.0),
            Element::Clutch(clutch("A", "right", "left")),
            Element::Clutch(clutch("B", "right", "left")),
            Element::Gear(Gear { loss: Some(loss), ..plain }),
        ]);
        let mut coasting = start(&[("left", w), ("right", w), ("far", w / ratio)], &["A", "B"]);
        coasting.twists = vec![("shaft left right".to_owned(), 1e-3 * i)];
        let run = simulate(&network, &signals, &coasting, &grid(1.0, 11), &[speed("left")]);
        assert_eq!(run.status, Status::Completed, "case {i}");
        assert!(run.columns[0].iter().all(|left| (left - w).abs() < 1e-9), "case {i}");
    }
}

#[test]
fn a_load_that_only_touches_the_capacity_does_not_break_away() {
    let network = compile(vec![
        inertia("shaft", 1.0),
        torque("shaft", "T"),
        Element::Clutch(clutch("brake", "shaft", "ground")),
    ]);
    let touch = ("T", vec![0.0, 0.5, 1.0], vec![0.0, 10.0, 0.0]);
    let signals = [touch, constant("P brake", 10.0, 1.0)];
    let rest = start(&[("shaft", 0.0)], &[]);
    let run = simulate(&network, &signals, &rest, &grid(1.0, 11), &[speed("shaft")]);
    assert_eq!(run.status, Status::Completed);
    assert!(run.columns[0].iter().all(|w| w.abs() < 1e-12), "{:?}", run.columns[0]);
}

#[test]
fn capacities_that_pass_through_nothing_together_leave_the_lock_as_it_is() {
    let network = compile(vec![
        inertia("a", 3.508),
        inertia("b", 0.561),
        inertia("c", 1.559),
        torque("a", "T"),
        Element::Clutch(Clutch { peak: 1.322, ..clutch("held", "b", "c") }),
        Element::Clutch(clutch("slipping", "b", "a")),
    ]);
    let through = |values: [f64; 5]| (vec![0.0, 0.25, 0.5, 0.75, 1.0], values.to_vec());
    let ((t, drive), (_, held), (_, slipping)) = (
        through([0.0, 0.0, 41.0, 0.0, 0.0]),
        through([50.0, 50.0, 0.0, 62.7, 0.0]),
        through([0.0, 62.9, 0.0, 94.3, 0.0]),
    );
    let signals =
        [("T", t.clone(), drive), ("P held", t.clone(), held), ("P slipping", t, slipping)];
    // The lock passes on 1.559 / 2.12 of the slipping torque, at most 0.84 of what it can hold.
    let start = start(&[("a", -38.5), ("b", 0.0), ("c", 0.0)], &[]);
    let slip = [Output::Slip("held".into())];
    let how = RunOptions { settings: Settings::default(), audit: false };
    let run = simulate_by(how, &network, &signals, &start, &grid(1.0, 501), &slip);
    assert_eq!(run.status, Status::Completed);
    assert!(run.events.iter().all(|e| e.kind != EventKind::BreakAway), "{:?}", run.events);
    assert!(run.columns[0].iter().all(|slip| slip.abs() < 1e-9));
}

#[test]
fn break_away_is_at_the_static_peak_and_slip_at_the_kinetic_level() {
    let network = compile(vec![
        inertia("shaft", 1.0),
        torque("shaft", "T"),
        Element::Clutch(Clutch { peak: 1.25, ..clutch("brake", "shaft", "ground") }),
    ]);
    let ramp = ("T", vec![0.0, 1.0], vec![0.0, 20.0]);
    let signals = [ramp, constant("P brake", 8.0, 1.0)];
    let rest = start(&[("shaft", 0.0)], &[]);
    let run = simulate(&network, &signals, &rest, &grid(1.0, 101), &[speed("shaft")]);
    assert_eq!(run.events.len(), 1);
    assert!((run.events[0].time - 0.5).abs() < 1e-12);
    // ω = ∫ (20 t - 8) dt from 0.5 to 1
    assert!((run.columns[0][100] - (7.5 - 4.0)).abs() < 1e-9);
}

#[test]
fn what_is_let_go_beside_redundant_locks_has_overcome_its_static_capacity() {
    let network = compile(vec![
        inertia("a", 1.0),
        inertia("b", 1.0),
        torque("a", "T"),
        Element::Clutch(Clutch { peak: 1.25, ..clutch("between", "a", "b") }),
        Element::Clutch(clutch("strong", "b", "ground")),
        Element::Clutch(clutch("weak", "b", "ground")),
    ]);
    // Both brakes hold 9; the clutch holds 10 until it slips, and only 8 from then on.
    let signals = [
        ("T", vec![0.0, 1.0], vec![0.0, 9.9]),
        constant("P between", 8.0, 1.0),
        constant("P strong", 8.99, 1.0),
        constant("P weak", 0.01, 1.0),
    ];
    let rest = start(&[("a", 0.0), ("b", 0.0)], &[]);
    let run = simulate(&network, &signals, &rest, &grid(1.0, 101), &[speed("a"), speed("b")]);
    let let_go = run.events.iter().filter(|event| event.kind == EventKind::BreakAway);
    let let_go: Vec<_> = let_go.map(|event| (event.element, event.time)).collect();
    assert_eq!(let_go.iter().map(|&(element, _)| element).collect::<Vec<_>>(), [1, 2]);
    assert!(let_go.iter().all(|(_, time)| (time - 9.0 / 9.9).abs() < 1e-9), "{let_go:?}");
    assert!((run.columns[0][100] - run.columns[1][100]).abs() < 1e-9);
}

#[test]
fn a_load_that_ends_at_nothing_is_vented_there() {
    let brake = clutch("brake", "shaft", "ground");
    for (p0, knots) in [(0.0, 5), (0.0, 101), (0.0, 1001), (7.1, 5), (7.1, 101), (7.1, 1001)] {
        let network = compile(vec![
            inertia("shaft", 1.0),
            torque("shaft", "T"),
            Element::Clutch(Clutch { gain: 0.37, p0, ..brake.clone() }),
        ]);
        let time = grid(1.0, knots);
        // Down to the fill pressure at 0.5 s, up again from 0.75 s on.
        let pressure = |t: &f64| p0 + 80.0 * (0.5 - t).max(0.0) + 160.0 * (t - 0.75).max(0.0);
        let pressure = ("P brake", time.clone(), time.iter().map(pressure).collect());
        let signals = [constant("T", 1.0, 1.0), pressure];
        let start = start(&[("shaft", 20.0)], &[]);
        for settings in [Settings::default(), Settings::exact()] {
            let how = RunOptions { settings, audit: false };
            let run = simulate_by(how, &network, &signals, &start, &time, &[speed("shaft")]);
            let kinds: Vec<_> = run.events.iter().map(|event| event.kind).collect();
            assert_eq!(
                kinds,
                [EventKind::ClutchVented, EventKind::ClutchFilled],
                "{p0} {knots} {settings:?}"
            );
            assert!((run.events[0].time - 0.5).abs() < 1e-12, "{p0} {knots} {settings:?}");
            assert!((run.events[1].time - 0.75).abs() < 1e-12);
        }
    }
}

#[test]
fn a_brake_too_weak_to_hold_lets_the_slip_pass_through_zero() {
    let network = compile(vec![
        inertia("shaft", 1.0),
        torque("shaft", "T"),
        Element::Clutch(clutch("brake", "shaft", "ground")),
    ]);
    let signals = [constant("T", 10.0, 1.0), constant("P brake", 4.0, 1.0)];
    let run = simulate(
        &network,
        &signals,
        &start(&[("shaft", -7.0)], &[]),
        &grid(1.0, 101),
        &[speed("shaft")],
    );
    assert_eq!(run.events.len(), 1);
    assert_eq!(run.events[0].kind, EventKind::Reverse);
    // -7 + 14 t = 0 at 0.5, then 6 (t - 0.5)
    assert!((run.events[0].time - 0.5).abs() < 1e-12);
    assert!((run.columns[0][100] - 3.0).abs() < 1e-9);
}

#[test]
fn an_element_without_pressure_transmits_nothing_even_at_zero_slip() {
    let network = compile(vec![
        inertia("shaft", 1.0),
        torque("shaft", "T"),
        Element::Clutch(clutch("brake", "shaft", "ground")),
    ]);
    let signals = [constant("T", 1.0, 1.0), constant("P brake", 0.0, 1.0)];
    let rest = start(&[("shaft", 0.0)], &["brake"]);
    let run = simulate(&network, &signals, &rest, &grid(1.0, 11), &[speed("shaft")]);
    assert!((run.columns[0][10] - 1.0).abs() < 1e-12);
    assert!(run.events.is_empty());
}

#[test]
fn a_freewheel_that_hardly_lets_go_leaves_its_torque_to_the_clutch_beside_it() {
    let freewheel = OneWayClutch { name: "F".into(), a: "a".into(), b: "b".into(), clutch: None };
    let network = compile(vec![
        inertia("a", 1.75),
        inertia("b", 0.16),
        inertia("c", 0.38),
        Element::Clutch(clutch("C", "a", "b")),
        Element::OneWayClutch(freewheel),
        shaft("c", "b", 1340.0, 18.0),
    ]);
    // What swings decays below what the freewheel holds by round-off of fast shafts.
    let start = start(&[("a", 180.0), ("b", 180.0), ("c", 170.0)], &["C"]);
    let outputs = [Output::Slip("C".into()), friction_torque("F")];
    for settings in [Settings::default(), Settings::exact()] {
        let signals = [constant("P C", 500.0, 4.0)];
        let how = RunOptions { settings, audit: false };
        let run = simulate_by(how, &network, &signals, &start, &grid(4.0, 4001), &outputs);
        assert_eq!(run.status, Status::Completed, "{settings:?}");
        assert!(run.columns[0].iter().all(|slip| slip.abs() < 1e-9));
        assert!(run.columns[1].iter().all(|torque| *torque > -1e-6));
    }
}

#[test]
fn what_swings_through_a_lossy_gear_comes_to_rest() {
    for case in 0..40 {
        // Spread over their ranges.
        let part = |place: usize| (0.618_034 * (case * 7 + place + 1) as f64).fract();
        let between = |place, low: f64, high: f64| low + (high - low) * part(place);
        let loss = GearLoss {
            law: LossLaw::Dissipative,
            eta: between(2, 0.3, 1.0),
            eta_backward: Some(between(3, 0.3, 1.0)),
            drag: None,
            drag_backward: None,
        };
        let ratio = between(4, -2.0, 2.0);
        let network = compile(vec![
            inertia("a", between(5, 0.1, 3.0)),
            inertia("c", between(6, 0.1, 3.0)),
            inertia("f", between(7, 0.1, 3.0)),
            shaft("c", "a", between(0, 100.0, 1e4), between(1, 4.0, 20.0)),
            Element::Gear(Gear {
                name: "g".into(),
                a: "c".into(),
                b: "f".into(),
                ratio,
                loss: Some(loss),
                losses: None,
            }),
        ]);
        let start = start(&[("a", between(8, -50.0, 50.0)), ("f", between(9, -50.0, 50.0))], &[]);
        for settings in [Settings::default(), Settings::exact()] {
            let run = simulate_by(
                RunOptions { settings, audit: false },
                &network,
                &[],
                &start,
                &grid(30.0, 3001),
                &[speed("a")],
            );
            assert_eq!(run.status, Status::Completed, "{case} {settings:?}");
        }
    }
}

#[test]
fn a_start_locks_as_a_clutch_that_is_strong_beyond_measure_does() {
    let outputs = [speed("input"), speed("drum"), speed("output")];
    for (law, from) in [
        (LossLaw::Paper, -40.0),
        (LossLaw::Paper, 60.0),
        (LossLaw::Paper, 178.0),
        (LossLaw::Dissipative, 60.0),
        (LossLaw::Dissipative, 100.0),
        (LossLaw::Dissipative, 178.0),
    ] {
        let loss = |eta| Some(GearLoss::by_efficiency(law, eta));
        let gear = |name: &str, a: &str, b: &str, ratio, loss| {
            Element::Gear(Gear {
                name: name.into(),
                a: a.into(),
                b: b.into(),
                ratio,
                loss,
                losses: None,
            })
        };
        let network = compile(vec![
            inertia("input", 20.3),
            gear("first", "input", "between", 1.4, loss(0.7)),
            inertia("between", 0.6),
            Element::Clutch(clutch("C", "between", "drum")),
            gear("second", "drum", "output", 1.9, loss(0.85)),
            inertia("output", 9.0),
        ]);
        let begun = |locked: &[&str]| {
            let start = start(&[("input", from), ("output", 50.0)], locked);
            let (strong, how) = (
                [constant("P C", 1e13, 1.0)],
                RunOptions { settings: Settings::exact(), audit: false },
            );
            simulate_by(how, &network, &strong, &start, &grid(1.0, 2), &outputs)
        };
        let (locked, slipping) = (begun(&["C"]), begun(&[]));
        assert!(locked.events.iter().all(|event| event.kind == EventKind::Impulse));
        assert_eq!(slipping.events.len(), 1);
        for (locked, slipping) in locked.columns.iter().zip(&slipping.columns) {
            assert!((locked[0] - slipping[1]).abs() < 1e-9, "{} {}", locked[0], slipping[1]);
        }
    }
}
