// SPDX-License-Identifier: MIT
//! Tyres, tabulated springs, backlash and viscous couplings against closed forms and their limits.

mod common;

use common::{compile, constant, grid, inertia, load, shaft, simulate, start, torque};
use drivetwin_core::model::Driveline;
use drivetwin_core::model::elements::{Backlash, Element, SpringTable, Tyre, ViscousCoupling};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{Output, Start, Trajectory};
use drivetwin_core::solver::Status;

const END: f64 = 2.0;

fn tyre(slip_stiffness: f64, least_speed: f64) -> Element<f64> {
    let (name, a, b) = ("tyre".into(), "wheel".into(), "vehicle".into());
    Element::Tyre(Tyre { name, a, b, slip_stiffness, least_speed })
}

fn table(twist: Vec<f64>, torque: Vec<f64>, damping: f64) -> Element<f64> {
    let (name, a, b) = ("table".into(), "a".into(), "b".into());
    Element::SpringTable(SpringTable { name, a, b, twist, torque, damping })
}

fn viscous(a: &str, b: &str, slip: Vec<f64>, torque: Vec<f64>) -> Element<f64> {
    let (name, a, b) = ("viscous".into(), a.into(), b.into());
    Element::ViscousCoupling(ViscousCoupling { name, a, b, slip, torque })
}

/// A driven wheel below a vehicle with air drag.
fn rolling(slip_stiffness: f64) -> Network<f64> {
    compile(vec![
        torque("wheel", "T"),
        inertia("wheel", 60.0),
        tyre(slip_stiffness, 1.0),
        inertia("vehicle", 3000.0),
        load("vehicle", 500.0, 0.0, 2.0),
    ])
}

fn speeds() -> [Output; 2] {
    ["wheel", "vehicle"].map(|node| Output::Speed(node.into()))
}

fn drive(network: &Network<f64>, from: f64, value: f64) -> Trajectory<f64> {
    let signals = [("T", vec![0.0, 0.5, 0.6, END], vec![value, value, -value, -value])];
    let begin = start(&[("wheel", from), ("vehicle", from)], &[]);
    simulate(network, &signals, &begin, &grid(END, 201), &speeds())
}

/// The error of the balance is that of the quadrature over steps of many milliseconds; energies are
/// 1 J and more.
fn assert_balanced(run: &Trajectory<f64>) {
    assert_eq!(run.status, Status::Completed);
    let audit = run.audit.as_ref().expect("an audited run");
    let size = audit.source.abs() + audit.stored.abs() + audit.load.abs();
    assert!(audit.error.abs() < 1e-8 * size.max(1.0), "{audit:?}");
}

#[test]
fn a_tyre_heats_by_its_slip_and_the_energy_balance_closes() {
    let run = drive(&rolling(2e5), 15.0, 8000.0);
    assert_balanced(&run);
    let audit = run.audit.expect("an audited run");
    assert!(audit.converter > 0.0);
    // Torque through the tyre while it drives: close to the whole torque, so slip is T / C.
    let slip = run.columns[0][40] / run.columns[1][40] - 1.0;
    assert!((slip - 8000.0 / 2e5).abs() < 0.1 * slip, "{slip}");
}

#[test]
fn a_tyre_of_large_stiffness_is_a_rigid_coupling() {
    let rigid = compile(vec![
        torque("vehicle", "T"),
        inertia("vehicle", 3060.0),
        load("vehicle", 500.0, 0.0, 2.0),
    ]);
    let signals = [("T", vec![0.0, 0.5, 0.6, END], vec![8e3, 8e3, -8e3, -8e3])];
    let begin = start(&[("vehicle", 15.0)], &[]);
    let exact = simulate(&rigid, &signals, &begin, &grid(END, 201), &speeds()[1..]);
    let distance = |stiffness: f64| {
        let run = drive(&rolling(stiffness), 15.0, 8e3);
        let gaps = run.columns[1].iter().zip(&exact.columns[0]).map(|(a, b)| (a - b).abs());
        gaps.fold(0.0, f64::max)
    };
    let (soft, stiff) = (distance(1e6), distance(1e7));
    assert!(stiff < 1e-3, "{stiff} rad/s");
    assert!((soft / stiff - 10.0).abs() < 1.0, "{soft} {stiff}: of first order in the compliance");
}

#[test]
fn a_tyre_below_its_least_speed_is_a_damper_forwards_and_backwards() {
    let (stiffness, least) = (300.0, 50.0);
    let network =
        compile(vec![inertia("wheel", 2.0), tyre(stiffness, least), inertia("vehicle", 6.0)]);
    for from in [3.0, -3.0] {
        let begin = start(&[("wheel", from), ("vehicle", 0.0)], &[]);
        let run = simulate(&network, &[], &begin, &grid(1.0, 21), &speeds());
        assert_balanced(&run);
        let rate = stiffness / least * (1.0 / 2.0 + 1.0 / 6.0);
        for (i, t) in run.time.iter().enumerate() {
            let slip = run.columns[0][i] - run.columns[1][i];
            assert!((slip - from * (-rate * t).exp()).abs() < 1e-10);
        }
    }
}

#[test]
fn a_vehicle_that_stops_and_turns_back_mirrors_its_start() {
    let network = compile(vec![
        torque("wheel", "T"),
        inertia("wheel", 60.0),
        tyre(1e5, 2.0),
        inertia("vehicle", 900.0),
    ]);
    let moved = |torque: f64, from: f64| {
        let begin = start(&[("wheel", from), ("vehicle", from)], &[]);
        simulate(&network, &[constant("T", torque, END)], &begin, &grid(END, 21), &speeds())
    };
    let (forth, back) = (moved(-6000.0, 5.0), moved(6000.0, -5.0));
    assert_balanced(&forth);
    assert!(forth.columns[1][20] < -2.0, "the vehicle turns back");
    for (a, b) in forth.columns.iter().flatten().zip(back.columns.iter().flatten()) {
        assert!((a + b).abs() < 1e-11);
    }
}

/// Two masses on an element between `a` and `b`, with a start of the twist.
fn swing(element: Element<f64>, twist: f64) -> Trajectory<f64> {
    let name = element.name().to_string();
    let network = compile(vec![inertia("a", 2.0), inertia("b", 6.0), element]);
    let begin =
        Start { twists: vec![(name.clone(), twist)], ..start(&[("a", 1.0), ("b", 0.0)], &[]) };
    let outputs = [
        Output::Twist(name.as_str().into()),
        Output::ShaftTorque(name.as_str().into()),
        Output::Speed("a".into()),
    ];
    simulate(&network, &[], &begin, &grid(END, 401), &outputs)
}

fn assert_equal(one: &Trajectory<f64>, other: &Trajectory<f64>, tolerance: f64) {
    for (a, b) in one.columns.iter().zip(&other.columns) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < tolerance, "{a} {b}");
        }
    }
}

#[test]
fn a_straight_table_is_a_spring_damper() {
    let straight = table(vec![-0.02, 0.0, 0.01, 0.5], vec![-12.0, 0.0, 6.0, 300.0], 0.4);
    let run = swing(straight, 0.015);
    assert_balanced(&run);
    assert_equal(&run, &swing(shaft("a", "b", 600.0, 0.4), 0.015), 1e-9);
}

#[test]
fn a_table_with_a_bend_follows_its_torque_and_keeps_its_energy() {
    let (twist, torque) = (vec![-0.05, -0.02, 0.0, 0.01, 0.03], vec![-60.0, -9.0, 0.0, 6.0, 30.0]);
    let run = swing(table(twist, torque, 0.0), 0.0);
    assert_balanced(&run);
    let law = |z: f64| match z {
        z if z < -0.02 => -9.0 + 1700.0 * (z + 0.02),
        z if z < 0.0 => 450.0 * z,
        z if z < 0.01 => 600.0 * z,
        z => 6.0 + 1200.0 * (z - 0.01),
    };
    let (twists, torques) = (&run.columns[0], &run.columns[1]);
    assert!(twists.iter().any(|&z| z > 0.012) && twists.iter().any(|&z| z < -0.022));
    for (z, t) in twists.iter().zip(torques) {
        assert!((t - law(*z)).abs() < 1e-8, "{t} N·m at {z} rad");
    }
}

#[test]
fn a_table_that_begins_at_zero_twist_goes_on_beyond_it() {
    for (twist, torque) in [(vec![0.0, 0.01], vec![0.0, 6.0]), (vec![-0.01, 0.0], vec![-6.0, 0.0])]
    {
        let run = swing(table(twist, torque, 0.0), 0.0);
        assert_balanced(&run);
        assert_equal(&run, &swing(shaft("a", "b", 600.0, 0.0), 0.0), 1e-9);
    }
}

#[test]
fn impossible_tables_and_tyres_are_refused_by_name() {
    let refused = [
        (table(vec![0.0, 1.0], vec![0.0], 0.0), "as many twists"),
        (table(vec![0.0, 0.0], vec![0.0, 1.0], 0.0), "increase"),
        (table(vec![0.0, 1.0], vec![0.0, f64::NAN], 0.0), "not finite"),
        (table(vec![0.0, 1.0], vec![0.0, -1.0], 0.0), "do not fall"),
        (table(vec![0.5, 1.0], vec![0.0, 1.0], 0.0), "twist 0"),
        (table(vec![0.0, 1.0], vec![0.0, 1.0], -1.0), "damping"),
        (viscous("a", "b", vec![0.0, 1.0], vec![0.0, 1.0]), "from one above 0"),
        (viscous("a", "b", vec![1.0], vec![1.0, 2.0]), "as many torques"),
        (viscous("a", "b", vec![1.0], vec![-1.0]), "negative"),
        (viscous("a", "b", vec![1.0, 2.0], vec![2.0, 1.0]), "do not fall"),
        (tyre(0.0, 1.0), "slip_stiffness"),
        (tyre(1.0, 0.0), "least_speed"),
    ];
    for (element, text) in refused {
        let name = element.name().to_string();
        let error = Network::compile(&Driveline { elements: vec![element] }).expect_err("a fault");
        let message = error.to_string();
        assert!(message.contains(text) && message.contains(&name), "{message}");
    }
}

#[test]
fn backlash_without_a_gap_is_a_spring_damper_while_it_is_pressed() {
    let (stiffness, damping) = (600.0, 0.4);
    let play = |gap: f64| {
        let (name, a, b) = ("play".into(), "a".into(), "b".into());
        Element::Backlash(Backlash { name, a, b, stiffness, damping, gap })
    };
    // Half a period from rest of the twist rate: no change of sign and no fast approach.
    let run = swing(play(0.0), 0.05);
    let linear = swing(shaft("a", "b", stiffness, damping), 0.05);
    let first = linear.columns[1].iter().position(|&torque| torque < 0.05 * 30.0).expect("a half");
    assert!(first > 5);
    for (a, b) in run.columns.iter().zip(&linear.columns) {
        for (a, b) in a[..first].iter().zip(&b[..first]) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }
    assert_balanced(&run);
    assert_balanced(&swing(play(0.01), 0.05));
}

/// Slip over time of two masses without other torques, the run audited.
fn slow_down(element: Element<f64>, slip: f64) -> (Trajectory<f64>, Vec<f64>) {
    let network = compile(vec![inertia("a", 2.0), inertia("b", 6.0), element]);
    let begin = start(&[("a", slip), ("b", 0.0)], &[]);
    let outputs = ["a", "b"].map(|node| Output::Speed(node.into()));
    let run = simulate(&network, &[], &begin, &grid(END, 201), &outputs);
    assert_balanced(&run);
    let slips = run.columns[0].iter().zip(&run.columns[1]).map(|(a, b)| a - b).collect();
    (run, slips)
}

/// Both masses against each other, kg·m².
const REDUCED: f64 = 1.5;

#[test]
fn the_slip_of_a_linear_viscous_coupling_decays_exponentially_into_heat() {
    for from in [40.0, 5.0, -40.0] {
        let (run, slips) = slow_down(viscous("a", "b", vec![10.0], vec![20.0]), from);
        assert!(run.events.is_empty(), "no stiction");
        for (slip, t) in slips.iter().zip(&run.time) {
            assert!((slip - from * (-2.0 * t / REDUCED).exp()).abs() < 1e-9, "{slip} at {t} s");
        }
        let heat = 0.5 * REDUCED * (from * from - slips[200] * slips[200]);
        let damper = run.audit.expect("an audited run").shaft;
        assert!((damper - heat).abs() < 1e-8 * heat, "{damper} and {heat} J");
    }
}

#[test]
fn a_viscous_coupling_follows_its_pieces_beyond_the_table_and_in_either_sense() {
    // 3 N·m·s/rad up to 4 rad/s, then 0.5: from 20 rad/s, beyond the last point, to below the first.
    let element = || viscous("a", "b", vec![4.0, 10.0], vec![12.0, 15.0]);
    let rest: f64 = 4.0 - 12.0 / 0.5;
    let corner = REDUCED / 0.5 * ((20.0 - rest) / (4.0 - rest)).ln();
    let closed = |t: f64| {
        if t < corner {
            rest + (20.0 - rest) * (-0.5 * t / REDUCED).exp()
        } else {
            4.0 * (-3.0 * (t - corner) / REDUCED).exp()
        }
    };
    assert!(corner > 0.5 && corner < 0.9 * END);
    for side in [1.0, -1.0] {
        let (run, slips) = slow_down(element(), 20.0 * side);
        for (slip, &t) in slips.iter().zip(&run.time) {
            assert!((slip * side - closed(t)).abs() < 1e-8, "{slip} at {t} s");
        }
    }
}

#[test]
fn a_viscous_coupling_to_the_ground_stops_a_mass_that_must_exist() {
    let brake = |node: &str| viscous(node, "ground", vec![1.0], vec![3.0]);
    let network = compile(vec![inertia("a", 2.0), brake("a")]);
    let begin = start(&[("a", 8.0)], &[]);
    let run = simulate(&network, &[], &begin, &grid(END, 21), &[Output::Speed("a".into())]);
    assert_balanced(&run);
    for (speed, t) in run.columns[0].iter().zip(&run.time) {
        assert!((speed - 8.0 * (-1.5 * t).exp()).abs() < 1e-9);
    }
    let elements = vec![inertia("a", 2.0), shaft("a", "m", 10.0, 0.0), brake("m")];
    let error = Network::compile(&Driveline { elements }).expect_err("a member without mass");
    assert!(error.to_string().contains("m"), "{error}");
}

/// The damper decides most of this contact: its rate falls by a factor of 20 in every passage.
#[test]
fn a_damped_coupling_without_a_gap_comes_to_rest() {
    for (driven, driving) in [(-2.3e-15, 4.3e-15), (0.0, 1.0), (100.0, 101.0)] {
        let network = compile(vec![
            inertia("driven", 3.85),
            inertia("driving", 1.4e-4),
            Element::Backlash(Backlash {
                name: "spline".into(),
                a: "driving".into(),
                b: "driven".into(),
                stiffness: 25_486.0,
                damping: 25.486,
                gap: 0.0,
            }),
        ]);
        let begin = start(&[("driving", driving), ("driven", driven)], &[]);
        let outputs = ["driving", "driven"].map(|node| Output::Speed(node.into()));
        let run = simulate(&network, &[], &begin, &grid(2.0, 41), &outputs);
        assert_eq!(run.status, Status::Completed, "from {driven} rad/s");
        let slip =
            run.columns[0].last().expect("a sample") - run.columns[1].last().expect("a sample");
        assert!(slip.abs() <= 1e-9, "{slip} rad/s are left");
    }
}

#[test]
fn an_undamped_coupling_without_a_gap_is_a_shaft() {
    let (name, a, b) = ("play".into(), "a".into(), "b".into());
    let play = Backlash { name, a, b, stiffness: 600.0, damping: 0.0, gap: 0.0 };
    let run = swing(Element::Backlash(play), 0.05);
    assert_eq!(run.columns, swing(shaft("a", "b", 600.0, 0.0), 0.05).columns);
    assert_balanced(&run);
}
