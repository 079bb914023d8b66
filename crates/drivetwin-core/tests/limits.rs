// SPDX-License-Identifier: MIT
//! Limits that numbers written by hand reach exactly: equal capacities, no mass or all of it, rest that is only
//! crept towards (THEORY section 1).

mod common;

use common::{
    clutch, compile, constant, gear, grid, inertia, load, shaft, simulate, simulate_by, start,
    torque,
};
use drivetwin_core::model::elements::{Clutch, Element, Gear, GearLoss};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::model::{FrictionLaw, Stribeck};
use drivetwin_core::simulate::{Output, RunOptions};
use drivetwin_core::solver::{Settings, Status};

fn friction_torque(name: &str) -> Output {
    Output::FrictionTorque(name.into())
}

fn speed(node: &str) -> Output {
    Output::Speed(node.into())
}

#[test]
fn two_clutches_transmit_over_a_member_without_mass_between_them() {
    for (drive, capacity, accelerations) in
        [(5.0, 10.0, [2.5, 2.5]), (5.0, 1e4, [2.5, 2.5]), (30.0, 10.0, [20.0, 10.0])]
    {
        for drum in [None, Some(1e-15), Some(1e-10), Some(1e-6)] {
            let mut elements = vec![
                inertia("a", 1.0),
                inertia("c", 1.0),
                torque("a", "T"),
                Element::Clutch(clutch("first", "a", "drum")),
                Element::Clutch(clutch("second", "drum", "c")),
            ];
            elements.extend(drum.map(|drum| inertia("drum", drum)));
            let [first, second] = ["P first", "P second"].map(|name| constant(name, capacity, 1.0));
            let signals = [constant("T", drive, 1.0), first, second];
            let outputs =
                [speed("a"), speed("c"), friction_torque("first"), friction_torque("second")];
            let rest = start(&[("a", 0.0), ("drum", 0.0), ("c", 0.0)], &[]);
            let run = simulate(&compile(elements), &signals, &rest, &grid(1.0, 11), &outputs);
            assert_eq!(run.status, Status::Completed);
            let [a, c] = accelerations;
            for (column, expected) in run.columns.iter().zip([a, c, c, c]) {
                assert!((column[10] - expected).abs() < 1e-5, "{} not {expected}", column[10]);
            }
        }
    }
}

#[test]
fn of_equal_clutches_in_series_one_slips_and_the_other_holds_at_its_capacity() {
    for (mu_c, also_slips) in [(1.0, false), (0.8, false), (1.2, true)] {
        let friction = FrictionLaw::Stribeck(Stribeck { mu_c, mu_s: 1.0, v_s: 5.0, mu_v: 0.0 });
        let alike = |name, a, b| {
            Element::Clutch(Clutch { friction: friction.clone(), ..clutch(name, a, b) })
        };
        // The one that is looked at first too.
        let network = compile(vec![
            inertia("a", 1.0),
            inertia("b", 2.0),
            torque("a", "T"),
            alike("second", "b", "ground"),
            alike("first", "a", "b"),
        ]);
        let pressures = ["P first", "P second"].map(|name| constant(name, 50.0, 1.0));
        let [first, second] = pressures;
        let signals = [constant("T", 90.0, 1.0), first, second];
        let rest = start(&[("a", 0.0), ("b", 0.0)], &[]);
        for settings in [Settings::default(), Settings::exact()] {
            let (times, options) = (grid(0.5, 51), RunOptions { settings, audit: false });
            let run = simulate_by(options, &network, &signals, &rest, &times, &[speed("b")]);
            assert_eq!(run.status, Status::Completed);
            assert_eq!(run.columns[0][50] > 0.1, also_slips, "{} rad/s", run.columns[0][50]);
        }
    }
}

#[test]
fn what_breaks_away_one_after_the_other_at_one_instant_goes_on_slipping() {
    // All rest at the same instant; the torque overcomes the first clutch at once, and as friction rises with
    // slip the second follows it and the brake that one, at second and third order of time.
    let friction = FrictionLaw::Stribeck(Stribeck { mu_c: 1.0, mu_s: 0.5, v_s: 5.0, mu_v: 0.0 });
    let alike =
        |name, a, b| Element::Clutch(Clutch { friction: friction.clone(), ..clutch(name, a, b) });
    let network = compile(vec![
        inertia("a", 1.0),
        inertia("b", 0.5),
        inertia("c", 1.0),
        torque("a", "T"),
        alike("first", "a", "b"),
        alike("brake", "c", "ground"),
        alike("second", "b", "c"),
    ]);
    let [first, second, brake] =
        ["P first", "P second", "P brake"].map(|name| constant(name, 50.0, 0.5));
    let signals = [constant("T", -40.0, 0.5), first, second, brake];
    let coasting = start(&[("a", 0.1), ("b", 0.1), ("c", 0.1)], &["first", "second"]);
    for settings in [Settings::default(), Settings::exact()] {
        let (times, outputs) = (grid(0.5, 51), ["a", "b", "c"].map(speed));
        let run = simulate_by(
            RunOptions { settings, audit: false },
            &network,
            &signals,
            &coasting,
            &times,
            &outputs,
        );
        assert_eq!(run.status, Status::Completed);
        let [a, b, c] = [0, 1, 2].map(|column: usize| run.columns[column][50]);
        assert!(a < b && b < c && c < 0.0, "{a} {b} {c}");
    }
}

#[test]
fn what_creeps_towards_the_torque_that_friction_holds_comes_to_rest() {
    for (stiffness, damping) in [(100.0, 20.0), (100.0, 25.0), (100.0, 100.0)] {
        let network = compile(vec![
            inertia("b", 1.0),
            shaft("b", "ground", stiffness, damping),
            load("b", 0.0, 10.0, 0.0),
        ]);
        let mut drawn = start(&[("b", 0.0)], &[]);
        drawn.twists.push(("shaft b ground".to_owned(), 0.3));
        for points in [3, 11, 301] {
            for settings in [Settings::default(), Settings::exact()] {
                let times = grid(300.0, points);
                let outputs = [Output::Twist("shaft b ground".into())];
                let run = simulate_by(
                    RunOptions { settings, audit: false },
                    &network,
                    &[],
                    &drawn,
                    &times,
                    &outputs,
                );
                assert_eq!(run.status, Status::Completed);
                let left = run.columns[0][points - 1] - 0.1;
                assert!(left.abs() < 1e-9, "{left} rad");
            }
        }
    }
}

#[test]
fn a_member_heavier_than_the_others_beyond_measure_is_held_like_them() {
    for inertia_of_c in [1.0, 1e6, 1e12, 1e18] {
        let network = compile(vec![
            inertia("a", 1.0),
            inertia("b", 1.0),
            inertia("c", inertia_of_c),
            torque("a", "T"),
            Element::Clutch(clutch("brake", "c", "ground")),
            Element::Clutch(clutch("one", "b", "c")),
            Element::Clutch(clutch("other", "c", "a")),
        ]);
        let pressures = ["P brake", "P one", "P other"].map(|name| constant(name, 9.0, 1.0));
        let [brake, one, other] = pressures;
        let signals = [constant("T", 5.0, 1.0), brake, one, other];
        let outputs = ["brake", "one", "other"].map(friction_torque);
        let rest = start(&[("a", 0.0), ("b", 0.0), ("c", 0.0)], &[]);
        let run = simulate(&network, &signals, &rest, &grid(1.0, 11), &outputs);
        assert_eq!(run.status, Status::Completed);
        assert!(run.events.is_empty(), "{:?}", run.events);
        let held = run.columns.iter().map(|column| column[5].abs());
        for (held, expected) in held.zip([5.0, 0.0, 5.0]) {
            assert!((held - expected).abs() < 1e-9, "{held} at {inertia_of_c} kg m²");
        }
    }
}

#[test]
fn brakes_hold_side_by_side_whatever_ratio_lies_before_one_of_them() {
    for ratio in [1.0, 1e-5, 1e-10, 1e10] {
        let network = compile(vec![
            inertia("a", 1.0),
            inertia("b", 1.0),
            torque("a", "T a"),
            torque("b", "T b"),
            gear("a", "far", ratio),
            Element::Clutch(clutch("behind", "far", "ground")),
            Element::Clutch(clutch("beside", "b", "ground")),
        ]);
        let pressures = [constant("P behind", 9e10, 1.0), constant("P beside", 9.0, 1.0)];
        let [behind, beside] = pressures;
        let signals = [constant("T a", 5.0, 1.0), constant("T b", 5.0, 1.0), behind, beside];
        let rest = start(&[("a", 0.0), ("b", 0.0), ("far", 0.0)], &[]);
        let outputs = [friction_torque("behind"), friction_torque("beside")];
        let run = simulate(&network, &signals, &rest, &grid(1.0, 11), &outputs);
        assert_eq!(run.status, Status::Completed, "{ratio}");
        assert!((run.columns[0][5] / (5.0 * ratio) - 1.0).abs() < 1e-9, "{}", run.columns[0][5]);
        assert!((run.columns[1][5] - 5.0).abs() < 1e-9, "{}", run.columns[1][5]);
    }
}

#[test]
fn of_two_drags_that_no_efficiency_tells_apart_the_larger_counts_either_way() {
    for (drag, drag_backward) in [(4.0, 1.0), (1.0, 4.0)] {
        let loss = GearLoss {
            law: LossLaw::Dissipative,
            eta: 1.0,
            eta_backward: None,
            drag: Some(drag),
            drag_backward: Some(drag_backward),
        };
        let (name, [a, b]) = ("g".into(), ["a", "b"].map(Into::into));
        let network = compile(vec![
            inertia("a", 1.0),
            inertia("b", 1.0),
            torque("a", "T"),
            Element::Gear(Gear { name, a, b, ratio: 1.0, loss: Some(loss), losses: None }),
        ]);
        for settings in [Settings::default(), Settings::exact()] {
            for (drive, rest) in [(10.0, 3.0), (0.0, -2.0), (-10.0, -7.0), (1.0, -1.5)] {
                let signals = [constant("T", drive, 1.0)];
                let (from, times) = (start(&[("a", 50.0), ("b", 50.0)], &[]), grid(1.0, 11));
                let how = RunOptions { settings, audit: false };
                let run = simulate_by(how, &network, &signals, &from, &times, &[speed("b")]);
                assert_eq!(run.status, Status::Completed);
                assert!((run.columns[0][10] - 50.0 - rest).abs() < 1e-9, "{:?}", run.columns[0]);
            }
        }
    }
}
