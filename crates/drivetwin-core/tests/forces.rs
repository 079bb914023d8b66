// SPDX-License-Identifier: MIT
//! Loads, maps and tables against closed forms.

mod common;

use common::{
    clutch, compile, constant, grid, inertia, load, shaft, simulate, simulate_by, start, torque,
};
use drivetwin_core::model::Driveline;
use drivetwin_core::model::FrictionLaw;
use drivetwin_core::model::FrictionTable;
use drivetwin_core::model::Stribeck;
use drivetwin_core::model::converter_map::ConverterMap;
use drivetwin_core::model::elements::{
    Clutch, Element, EngineMap, Gear, GearLoss, Inertia, Planetary, PrescribedSpeed, Torque,
    TorqueConverter,
};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::model::torque_map::TorqueMap;
use drivetwin_core::network::{CompileError, Network};
use drivetwin_core::number::{Dual, Number as _};
use drivetwin_core::simulate::{Output, RunOptions, Start, run};
use drivetwin_core::solver::{Settings, Signal, Status};
use std::marker::PhantomData;

fn speed(node: &str) -> Output {
    Output::Speed(node.into())
}

#[test]
fn air_drag_slows_a_coasting_wheel_hyperbolically() {
    let network = compile(vec![inertia("wheel", 2.0), load("wheel", 0.0, 0.0, 0.5)]);
    let run =
        simulate(&network, &[], &start(&[("wheel", 40.0)], &[]), &grid(2.0, 21), &[speed("wheel")]);
    for (t, w) in run.time.iter().zip(&run.columns[0]) {
        assert!((w - 40.0 / (1.0 + 40.0 * 0.25 * t)).abs() < 1e-9);
    }
}

#[test]
fn rolling_resistance_stops_a_wheel_and_holds_it() {
    let network = compile(vec![inertia("wheel", 2.0), load("wheel", 3.0, 10.0, 0.0)]);
    let run =
        simulate(&network, &[], &start(&[("wheel", 6.5)], &[]), &grid(2.0, 21), &[speed("wheel")]);
    assert!((run.events[0].time - 1.0).abs() < 1e-12);
    assert_eq!(run.columns[0][20], 0.0);
}

#[test]
fn without_inputs_fine_samples_are_passed_up_to_rest_and_at_rest() {
    let network = compile(vec![inertia("wheel", 2.0), load("wheel", 3.0, 10.0, 0.0)]);
    let start = start(&[("wheel", 6.5)], &[]);
    let how = RunOptions { settings: Settings::default(), audit: false };
    let run = simulate_by(how, &network, &[], &start, &grid(2.0, 2001), &[speed("wheel")]);
    assert_eq!(run.status, Status::Completed);
    assert!((run.events[0].time - 1.0).abs() < 1e-12);
    for (t, w) in run.time.iter().zip(&run.columns[0]) {
        assert!((w - (6.5 * (1.0 - t)).max(0.0)).abs() < 1e-11, "{w} rad/s at {t} s");
    }
}

#[test]
fn a_grade_steeper_than_rolling_resistance_pulls_the_wheel_back() {
    let network = compile(vec![inertia("wheel", 2.0), load("wheel", 14.0, 10.0, 0.0)]);
    let run =
        simulate(&network, &[], &start(&[("wheel", 6.0)], &[]), &grid(2.0, 21), &[speed("wheel")]);
    // 6 - 12 t until 0.5 s, then -2 (t - 0.5)
    assert!((run.columns[0][20] + 3.0).abs() < 1e-9, "{:?}", run.columns[0]);
}

#[test]
fn an_engine_map_that_falls_with_speed_settles_exponentially() {
    let map = TorqueMap {
        throttle: vec![0.0, 1.0],
        speed: vec![0.0, 50.0, 100.0],
        torque: vec![vec![0.0, -50.0, -100.0], vec![200.0, 150.0, 100.0]],
    };
    let network = compile(vec![
        inertia("engine", 2.0),
        Element::EngineMap(EngineMap {
            name: "engine".into(),
            node: "engine".into(),
            throttle: "pedal".into(),
            map,
            lag: None,
        }),
    ]);
    let signals = [constant("pedal", 0.25, 4.0)];
    let run = simulate(
        &network,
        &signals,
        &start(&[("engine", 20.0)], &[]),
        &grid(4.0, 41),
        &[speed("engine")],
    );
    // T = 200·0.25 - ω
    for (t, w) in run.time.iter().zip(&run.columns[0]) {
        assert!((w - (50.0 - 30.0 * (-t / 2.0).exp())).abs() < 1e-9, "{t}: {w}");
    }
}

#[test]
fn a_map_is_followed_through_its_cells_and_held_beyond_its_border() {
    let map = TorqueMap {
        throttle: vec![0.0, 1.0],
        speed: vec![0.0, 10.0],
        torque: vec![vec![0.0; 2], vec![40.0, 20.0]],
    };
    let network = compile(vec![
        inertia("engine", 1.0),
        Element::EngineMap(EngineMap {
            name: "engine".into(),
            node: "engine".into(),
            throttle: "pedal".into(),
            map,
            lag: None,
        }),
    ]);
    let signals = [constant("pedal", 1.0, 1.0)];
    let run = simulate(
        &network,
        &signals,
        &start(&[("engine", 0.0)], &[]),
        &grid(1.0, 101),
        &[speed("engine")],
    );
    // 20 - 20 exp(-2 t) until 10 rad/s at ln(2)/2, then 20 N·m constantly
    let border = 0.5 * 2.0_f64.ln();
    assert!((run.columns[0][100] - (10.0 + 20.0 * (1.0 - border))).abs() < 1e-9);
}

#[test]
fn a_friction_table_is_followed_piece_by_piece() {
    let table =
        FrictionTable { slip: vec![0.0, 10.0, 20.0], mu: vec![1.0, 1.0, 2.0], extend: false };
    let brake =
        Clutch { friction: FrictionLaw::Table(table), ..clutch("brake", "shaft", "ground") };
    let network = compile(vec![inertia("shaft", 1.0), Element::Clutch(brake)]);
    let signals = [constant("P brake", 10.0, 3.0)];
    let run = simulate(
        &network,
        &signals,
        &start(&[("shaft", 20.0)], &[]),
        &grid(3.0, 301),
        &[speed("shaft")],
    );
    // s' = -s above 10 rad/s, reached at ln 2; then -10, at rest at ln 2 + 1
    let rest = 2.0_f64.ln() + 1.0;
    assert!((run.events[0].time - rest).abs() < 1e-10, "{:?}", run.events);
    assert_eq!(run.status, Status::Completed);
    assert!((run.columns[0][50] - 20.0 * (-0.5_f64).exp()).abs() < 1e-9);
}

#[test]
fn two_masses_on_a_shaft_swing_at_their_natural_frequency() {
    let network = compile(vec![inertia("a", 2.0), inertia("b", 6.0), shaft("a", "b", 600.0, 0.0)]);
    let run = simulate(
        &network,
        &[],
        &start(&[("a", 1.0), ("b", 0.0)], &[]),
        &grid(1.0, 101),
        &[speed("a"), speed("b")],
    );
    let omega = (600.0_f64 * (0.5 + 1.0 / 6.0)).sqrt();
    for (i, t) in run.time.iter().enumerate() {
        let relative = run.columns[0][i] - run.columns[1][i];
        assert!((relative - (omega * t).cos()).abs() < 1e-9);
    }
}

#[test]
fn a_torque_on_a_planetary_set_splits_by_willis() {
    let network = compile(vec![
        inertia("sun", 1.0),
        inertia("carrier", 10.0),
        torque("sun", "T"),
        Element::Planetary(Planetary {
            name: "set".into(),
            sun: "sun".into(),
            ring: "ring".into(),
            carrier: "carrier".into(),
            z: 1.5,
            planet_inertia: None,
            losses: None,
        }),
        Element::Clutch(clutch("brake", "ring", "ground")),
    ]);
    let signals = [constant("T", 20.0, 1.0), constant("P brake", 1000.0, 1.0)];
    let outputs = [speed("sun"), speed("carrier"), Output::FrictionTorque("brake".into())];
    let rest = start(&[("sun", 0.0), ("carrier", 0.0)], &[]);
    let run = simulate(&network, &signals, &rest, &grid(1.0, 11), &outputs);
    // sun = 2.5 carrier; (1·2.5² + 10) ω' = 2.5·20
    let acceleration = 50.0 / 16.25;
    assert!((run.columns[1][10] - acceleration).abs() < 1e-12);
    assert!((run.columns[0][10] - 2.5 * acceleration).abs() < 1e-12);
    let ring_torque = 1.5 * (20.0 - 2.5 * acceleration);
    assert!(
        (run.columns[2][5] + ring_torque).abs() < 1e-9
            || (run.columns[2][5] - ring_torque).abs() < 1e-9
    );
}

#[test]
fn repeated_couplings_are_named() {
    let twice = vec![
        inertia("a", 1.0),
        common::gear("a", "b", 2.0),
        common::gear("b", "c", 2.0),
        Element::Gear(drivetwin_core::model::elements::Gear {
            name: "again".into(),
            a: "a".into(),
            b: "c".into(),
            ratio: 4.0,
            loss: None,
            losses: None,
        }),
    ];
    let error = drivetwin_core::network::Network::compile(&drivetwin_core::model::Driveline {
        elements: twice,
    });
    match error.unwrap_err() {
        CompileError::DependentConstraints { elements } => {
            assert_eq!(elements, ["gear a b", "gear b c", "again"]);
        }
        other => panic!("{other}"),
    }
}

/// A sine of amplitude zero moves nothing, but the derivative by its amplitude is not zero:
/// `ω_A = (1 - cos 2πft) / (2πf J)`.
#[test]
fn a_sine_without_amplitude_is_differentiated_by_it() {
    type Number = Dual<1>;
    let (j, f) = (2.0, 3.0);
    let elements = vec![
        Element::Inertia(Inertia { name: "J".into(), node: "a".into(), inertia: Number::of(j) }),
        Element::Torque(Torque {
            name: "source".into(),
            node: "a".into(),
            input: "T".into(),
            reaction: None,
            number: PhantomData,
        }),
    ];
    let network = Network::compile(&Driveline { elements }).expect("a driveline");
    let signal = Signal::Sine {
        offset: Number::of(0.0),
        amplitude: Number::variable(0.0, 0),
        frequency: f,
        phase: 0.0,
    };
    let begin =
        Start { speeds: vec![("a".into(), Number::of(10.0))], twists: vec![], locked: vec![] };
    let options = RunOptions { settings: Settings::default(), audit: false };
    let run = run(&network, &[("T", signal)], &begin, &grid(1.0, 41), &[speed("a")], options);
    let run = run.expect("a scenario");
    let omega = 2.0 * std::f64::consts::PI * f;
    for ((t, w), slope) in run.time.iter().zip(&run.columns[0]).zip(&run.derivatives[0]) {
        assert_eq!(*w, 10.0);
        let exact = (1.0 - (omega * t).cos()) / (omega * j);
        assert!((slope[0] - exact).abs() < 1e-11, "{t} s: {} {exact}", slope[0]);
    }
}

#[test]
fn stiction_is_found_at_the_end_of_one_long_step() {
    let (mu_c, mu_s, v_s, capacity) = (0.9, 0.5, 5.0, 100.0);
    let friction = FrictionLaw::Stribeck(Stribeck { mu_c, mu_s, v_s, mu_v: 0.0 });
    let brake = Clutch { friction, ..clutch("B", "rotor", "ground") };
    let network = compile(vec![inertia("rotor", 1.0), Element::Clutch(brake)]);
    for distance in [1.0, 10.0, 30.0, 34.0, 80.0, 400.0] {
        let (from, end) = (distance * v_s, 0.99 * distance * v_s / (mu_c * capacity));
        // u = exp(ω / v_s) obeys a linear equation.
        let fall = mu_c * capacity * end;
        let u = ((from - fall) / v_s).exp() + (mu_s - mu_c) / mu_c * ((-fall / v_s).exp() - 1.0);
        for settings in [Settings::default(), Settings::exact()] {
            let start = start(&[("rotor", from)], &[]);
            let (pressure, span) = (constant("P B", capacity, end), [0.0, end]);
            let how = RunOptions { settings, audit: false };
            let run = simulate_by(how, &network, &[pressure], &start, &span, &[speed("rotor")]);
            let error = run.columns[0][1] - v_s * u.ln();
            assert!(error.abs() < 1e-6, "{error} rad/s from {distance} Stribeck speeds");
        }
    }
}

#[test]
fn members_of_next_to_no_mass_are_told_from_rigid_ones_whatever_the_numbers() {
    let driven = [
        torque("b", "T"),
        Element::PrescribedSpeed(PrescribedSpeed {
            name: "b".into(),
            node: "b".into(),
            input: "T".into(),
            number: PhantomData,
        }),
    ];
    for (i, ratio) in [0.7, 1.3, 2.0, 2.9].into_iter().enumerate() {
        for eta in [0.52, 0.73, 0.832_194, 0.97] {
            for loss_law in [LossLaw::Paper, LossLaw::Dissipative] {
                for drive in &driven {
                    let loss = Some(GearLoss::by_efficiency(loss_law, eta));
                    let (name, a, b) = ("G".into(), "c".into(), "b".into());
                    let network = compile(vec![
                        inertia("b", 0.3 + 2.7 * i as f64),
                        inertia("c", 1.0),
                        Element::Clutch(clutch("B", "a", "ground")),
                        Element::Clutch(clutch("C", "a", "c")),
                        Element::Gear(Gear { name, a, b, ratio, loss, losses: None }),
                        drive.clone(),
                    ]);
                    let start = start(&[("a", 7.0), ("c", 2.0)], &[]);
                    let inputs = [
                        constant("P B", 0.0, 1.0),
                        constant("P C", 50.0, 1.0),
                        constant("T", 2.0 / ratio, 1.0),
                    ];
                    let outputs = [speed("a"), speed("c")];
                    let run = simulate(&network, &inputs, &start, &grid(1.0, 5), &outputs);
                    assert_eq!(run.status, Status::Completed);
                    assert!((run.columns[0][4] - run.columns[1][4]).abs() < 1e-9);
                }
            }
        }
    }
}

#[test]
fn a_converter_with_a_pump_that_turns_backwards_mirrors_itself() {
    let map = ConverterMap {
        speed_ratio: vec![0.0, 1.0, 2.0],
        capacity: vec![0.03, 0.0, -0.01],
        torque_ratio: vec![2.0, 1.0, 1.0],
    };
    let network = compile(vec![
        inertia("pump", 1.0),
        inertia("turbine", 1.0),
        Element::TorqueConverter(TorqueConverter {
            name: "converter".into(),
            pump: "pump".into(),
            turbine: "turbine".into(),
            map: map.clone(),
            number: PhantomData,
        }),
        torque("pump", "T"),
    ]);
    let outputs = [speed("pump"), speed("turbine")];
    let moved = |torque: f64, from: [f64; 2]| {
        let start = start(&[("pump", from[0]), ("turbine", from[1])], &[]);
        simulate(&network, &[constant("T", torque, 3.0)], &start, &grid(3.0, 31), &outputs).columns
    };
    let rates = |torque: f64, [p, t]: [f64; 2]| {
        let cell = map.cell(map.cell_index(t / p));
        let [c, m] = [cell.c, cell.m].map(|[constant, slope]| constant + slope * t / p);
        let taken = c * p * p.abs();
        [torque - taken, m * taken]
    };
    // Through zero and on, driving and driven.
    for (torque, from) in [(-20.0, [10.0, 5.0]), (-20.0, [10.0, -5.0]), (-5.0, [1.0, 12.0])] {
        let (forth, back) = (moved(torque, from), moved(-torque, from.map(|v| -v)));
        assert!(forth[0][30] < -1.0, "the pump turns backwards in the end");
        let (mut x, h) = (from, 1e-4);
        for point in 1..31 {
            for _ in 0..1000 {
                let middle = |x: [f64; 2], k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
                let first = rates(torque, x);
                let second = rates(torque, middle(x, first, h / 2.0));
                x = middle(x, second, h);
            }
            for i in 0..2 {
                assert!((forth[i][point] - x[i]).abs() < 1e-5, "{} {}", forth[i][point], x[i]);
                assert!((forth[i][point] + back[i][point]).abs() < 1e-12);
            }
        }
    }
}
