// SPDX-License-Identifier: MIT
//! Tables of losses over speed and torque, against efficiencies and closed forms.

mod common;

use common::{
    Signal, clutch, compile, constant, grid, inertia, load, shaft, simulate, start, torque,
};
use drivetwin_core::model::elements::{Clutch, Element, Gear, GearLoss, Inertia, Planetary};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::model::{DragTable, Driveline, LossTable};
use drivetwin_core::network::Network;
use drivetwin_core::number::{Dual, Number as _};
use drivetwin_core::simulate::{Output, RunOptions, Start, Trajectory, run};
use drivetwin_core::solver::{EventKind, Settings, Signal as Input, Status};

fn speed(node: &str) -> Output {
    Output::Speed(node.into())
}

/// Losses of 2 % of the torque from 1 rad/s on, up to 1000 N·m.
fn two_percent() -> LossTable {
    LossTable {
        speed: vec![1.0, 100.0],
        torque: vec![0.0, 1000.0],
        loss: vec![vec![0.0, 0.0], vec![20.0, 20.0]],
    }
}

/// Churning that grows with the speed, and mesh losses that do with the torque; different in overrun.
fn data_sheet() -> LossTable {
    LossTable {
        speed: vec![20.0, 60.0, 150.0],
        torque: vec![-80.0, 0.0, 50.0, 200.0],
        loss: vec![
            vec![5.0, 6.0, 8.0],
            vec![0.5, 1.0, 2.5],
            vec![2.0, 2.5, 4.5],
            vec![7.0, 9.0, 12.0],
        ],
    }
}

fn gear(name: &str, a: &str, b: &str, ratio: f64, losses: Option<LossTable>) -> Gear<f64> {
    Gear { name: name.into(), a: a.into(), b: b.into(), ratio, loss: None, losses }
}

fn swing(amplitude: f64, end: f64) -> Signal {
    let times = grid(end, 401);
    let values = times.iter().map(|t| amplitude * (3.0 * t).cos()).collect();
    ("T", times, values)
}

fn assert_closed(run: &Trajectory<f64>) {
    assert_eq!(run.status, Status::Completed);
    let audit = run.audit.as_ref().expect("audited");
    let size = audit.source.abs() + audit.stored.abs() + audit.gear_loss + audit.load.abs();
    assert!(audit.error.abs() < 1e-9 * size, "{audit:?}");
    assert!(audit.gear_loss > 0.0 && audit.created == 0.0, "{audit:?}");
}

#[test]
fn losses_in_proportion_to_the_torque_are_an_efficiency_in_both_directions_of_power() {
    let moved = |gear: Gear<f64>| {
        let network = compile(vec![
            inertia("a", 0.4),
            inertia("b", 30.0),
            torque("a", "T"),
            Element::Gear(gear),
            load("b", 20.0, 0.0, 0.02),
        ]);
        let start = start(&[("b", 25.0)], &[]);
        simulate(&network, &[swing(300.0, 4.0)], &start, &grid(4.0, 81), &[speed("a")])
    };
    let loss = GearLoss {
        eta_backward: Some(1.0 / 1.02),
        ..GearLoss::by_efficiency(LossLaw::Dissipative, 0.98)
    };
    let by_law = moved(Gear { loss: Some(loss), ..gear("G", "a", "b", 3.0, None) });
    let by_table = moved(gear("G", "a", "b", 3.0, Some(two_percent())));
    assert_closed(&by_table);
    for (law, table) in by_law.columns[0].iter().zip(&by_table.columns[0]) {
        assert!((law - table).abs() < 1e-8, "{law} {table} rad/s");
    }
    let [law, table] = [&by_law, &by_table].map(|run| run.audit.as_ref().unwrap().gear_loss);
    assert!((law - table).abs() < 1e-7 * law, "{law} {table} J");
}

#[test]
fn gears_in_a_train_and_a_planetary_set_turn_round_and_lose_what_the_audit_says() {
    for locked in [false, true] {
        let network = compile(vec![
            inertia("a", 0.2),
            inertia("b", 0.5),
            inertia("ring", 0.3),
            inertia("wheel", 4.0),
            torque("a", "T"),
            Element::Gear(gear("G", "a", "b", -1.5, Some(data_sheet()))),
            Element::Planetary(Planetary {
                name: "set".into(),
                sun: "b".into(),
                ring: "ring".into(),
                carrier: "carrier".into(),
                z: 2.0,
                planet_inertia: Some(0.01),
                losses: Some(data_sheet()),
            }),
            Element::Gear(gear("H", "carrier", "axle", 2.5, Some(two_percent()))),
            shaft("axle", "wheel", 4e3, 4.0),
            Element::Clutch(clutch("B", "ring", "ground")),
        ]);
        let pressure = if locked { 1e4 } else { 30.0 };
        let signals = [swing(150.0, 6.0), constant("P B", pressure, 6.0)];
        let start = start(&[("a", 0.0), ("ring", 0.0), ("wheel", 0.0)], &[]);
        let outputs = [speed("a"), speed("wheel")];
        let run = simulate(&network, &signals, &start, &grid(6.0, 121), &outputs);
        assert_closed(&run);
        let turned = run.columns[0].iter().any(|&w| w < -5.0);
        assert!(turned && run.columns[0].iter().any(|&w| w > 5.0), "it turns both ways");
    }
}

#[test]
fn a_locked_driveline_with_tables_stands_still_without_events() {
    let network = compile(vec![
        inertia("a", 0.2),
        inertia("b", 0.5),
        torque("a", "T"),
        Element::Gear(gear("G", "a", "b", 1.7, Some(data_sheet()))),
        Element::Clutch(Clutch {
            drag: Some(DragTable { slip: vec![10.0], torque: vec![3.0] }),
            ..clutch("B", "b", "ground")
        }),
        shaft("a", "ground", 321.0, 1.3),
    ]);
    let signals = [swing(150.0, 6.0), constant("P B", 1e4, 6.0)];
    let start = start(&[("a", 0.0)], &["B"]);
    let run = simulate(&network, &signals, &start, &grid(6.0, 121), &[speed("a")]);
    assert_eq!(run.status, Status::Completed);
    assert!(run.events.len() <= 1, "{:?}", run.events);
    assert!(run.columns[0].iter().all(|w| w.abs() < 1e-9));
}

#[test]
fn a_torque_that_stays_on_a_point_of_the_table_is_no_chatter() {
    for torque_of in [0.0, 50.0, 200.0, -80.0] {
        // Without an inertia at a, all of the source's torque enters the gear.
        let network = compile(vec![
            torque("a", "T"),
            Element::Gear(gear("G", "a", "b", 1.7, Some(data_sheet()))),
            Element::Gear(gear("H", "b", "c", -0.7, Some(data_sheet()))),
            inertia("c", 3.0),
        ]);
        let start = start(&[("c", -10.0)], &[]);
        let outputs = [Output::Torque("G".into(), "a".into())];
        let run =
            simulate(&network, &[constant("T", torque_of, 3.0)], &start, &grid(3.0, 301), &outputs);
        assert_closed(&run);
        assert!(run.columns[0].iter().all(|t| (t + torque_of).abs() < 1e-9 * (1.0 + t.abs())));
        assert!(run.events.is_empty(), "{:?}", run.events);
    }
}

#[test]
fn drag_below_its_first_slip_is_viscous_and_above_its_last_constant() {
    let drag = Some(DragTable { slip: vec![5.0, 10.0], torque: vec![10.0, 4.0] });
    let network = compile(vec![
        inertia("rotor", 2.0),
        Element::Clutch(Clutch { drag, ..clutch("B", "rotor", "ground") }),
    ]);
    let pressure = constant("P B", 0.0, 4.0);
    let from = |w: f64| {
        let start = start(&[("rotor", w)], &[]);
        simulate(
            &network,
            std::slice::from_ref(&pressure),
            &start,
            &grid(4.0, 41),
            &[speed("rotor")],
        )
    };
    // 10 N·m at 5 rad/s
    let viscous = from(-4.0);
    for (t, w) in viscous.time.iter().zip(&viscous.columns[0]) {
        assert!((w + 4.0 * (-t).exp()).abs() < 1e-9, "{w} rad/s at {t} s");
    }
    let constant = from(30.0);
    assert!((constant.columns[0][40] - 22.0).abs() < 1e-9);
    let audit = constant.audit.expect("audited");
    assert!((audit.friction - (900.0 - 484.0)).abs() < 1e-6 && audit.error.abs() < 1e-9);
}

#[test]
fn a_clutch_that_locks_moves_the_torque_through_the_gears_at_once() {
    let network = compile(vec![
        inertia("engine", 0.3),
        torque("engine", "T"),
        Element::Clutch(clutch("C", "engine", "a")),
        inertia("a", 0.05),
        Element::Gear(gear("G", "a", "b", 4.0, Some(data_sheet()))),
        inertia("b", 40.0),
    ]);
    let signals = [constant("T", 100.0, 2.0), constant("P C", 180.0, 2.0)];
    let start = start(&[("engine", 120.0), ("b", 5.0)], &[]);
    let outputs = [speed("engine"), speed("b"), Output::Torque("G".into(), "a".into())];
    let run = simulate(&network, &signals, &start, &grid(2.0, 201), &outputs);
    assert_closed(&run);
    assert!(run.events.iter().any(|event| event.kind == EventKind::Lock), "{:?}", run.events);
    let steps = run.columns[2].windows(2).map(|pair| (pair[1] - pair[0]).abs());
    assert!(
        steps.fold(0.0, f64::max) > 40.0,
        "the torque through the gear falls as the clutch locks"
    );
}

#[test]
fn derivatives_are_those_of_differences() {
    type Number = Dual<1>;
    let (end, signal) = (1.0, swing(150.0, 1.0));
    let at = |j: f64| {
        let elements: Vec<Element<Number>> = vec![
            Element::Inertia(Inertia {
                name: "J".into(),
                node: "a".into(),
                inertia: Number::variable(j, 0),
            }),
            Element::Inertia(Inertia {
                name: "K".into(),
                node: "b".into(),
                inertia: Number::of(3.0),
            }),
            Element::Gear(Gear {
                name: "G".into(),
                a: "a".into(),
                b: "b".into(),
                ratio: Number::of(2.0),
                loss: None,
                losses: Some(data_sheet()),
            }),
            Element::Torque(drivetwin_core::model::elements::Torque {
                name: "T".into(),
                node: "a".into(),
                input: "T".into(),
                reaction: None,
                number: std::marker::PhantomData,
            }),
        ];
        let network = Network::compile(&Driveline { elements }).expect("a driveline");
        let begin =
            Start { speeds: vec![("b".into(), Number::of(3.0))], twists: vec![], locked: vec![] };
        let options = RunOptions { settings: Settings::default(), audit: false };
        let signals = [("T", Input::samples(&signal.1, &signal.2))];
        let run = run(&network, &signals, &begin, &grid(end, 11), &[speed("a")], options);
        let run = run.expect("a scenario");
        (run.columns[0][10], run.derivatives[0][10][0])
    };
    let (step, j) = (1e-4, 0.6);
    let difference = (at(j + step).0 - at(j - step).0) / (2.0 * step);
    let slope = at(j).1;
    assert!((slope - difference).abs() < 1e-5 * slope.abs(), "{slope} {difference}");
}

#[test]
fn impossible_tables_are_refused_with_their_fault() {
    let plain = two_percent();
    let faults = [
        (LossTable { speed: vec![0.0, 1.0], ..plain.clone() }, "increase from one above 0"),
        (LossTable { torque: vec![5.0, 5.0], ..plain.clone() }, "torques that increase"),
        (LossTable { loss: vec![vec![0.0, 0.0]], ..plain.clone() }, "one row per torque"),
        (LossTable { loss: vec![vec![0.0, -1.0], vec![1.0, 1.0]], ..plain.clone() }, "negative"),
        (LossTable { torque: vec![0.0, 20.0], ..plain }, "grows by more than the torque"),
    ];
    for (losses, text) in faults {
        let elements =
            vec![inertia("a", 1.0), Element::Gear(gear("G", "a", "b", 2.0, Some(losses)))];
        let error = Network::compile(&Driveline { elements }).expect_err("a fault").to_string();
        assert!(error.contains("G: losses") && error.contains(text), "{error}");
    }
}
