// SPDX-License-Identifier: MIT
//! Gears and shifts of the three-set six-speed layout (THEORY section 2) against hand formulas.

mod common;

use common::{clutch, gear};
use drivetwin_core::model::elements::{Clutch, Element, Inertia, Planetary};
use drivetwin_core::model::{Driveline, Mechanism};
use drivetwin_core::network::mobility::EngagedError;
use drivetwin_core::network::reduction::{Exchange, Reduction, ReductionError};
use drivetwin_core::network::statics::Statics;
use drivetwin_core::number::Dual;
use drivetwin_core::number::{Number, Real};

const Z: [f64; 3] = [1.694, 1.841, 2.49];
const GEARS: [(&str, [&str; 2]); 7] = [
    ("1", ["C1", "C5"]),
    ("2", ["C1", "C4"]),
    ("3", ["C1", "C3"]),
    ("4", ["C1", "C2"]),
    ("5", ["C2", "C3"]),
    ("6", ["C2", "C4"]),
    ("R", ["C3", "C5"]),
];

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|&n| n.to_owned()).collect()
}

fn set<T: Real>(name: &str, [sun, ring, carrier]: [&str; 3], z: T) -> Element<T> {
    let planetary = Planetary {
        name: name.into(),
        sun: sun.into(),
        ring: ring.into(),
        carrier: carrier.into(),
        z,
        planet_inertia: None,
        losses: None,
    };
    Element::Planetary(planetary)
}

fn inertia<T: Real>(node: &str, inertia: f64) -> Element<T> {
    let name = format!("J {node}").into();
    Element::Inertia(Inertia { name, node: node.into(), inertia: T::of(inertia) })
}

/// The three-set six-speed layout of heavy trucks, with the inertias (kg·m²) of its members.
fn three_sets(inertias: &[(&str, f64)]) -> Mechanism<f64> {
    let mut elements = vec![
        set("P1", ["input", "R1", "R2-C1"], Z[0]),
        set("P2", ["main", "R2-C1", "R3-C2"], Z[1]),
        set("P3", ["main", "R3-C2", "output"], Z[2]),
        Element::Clutch(clutch("C1", "input", "main")),
        Element::Clutch(clutch("C2", "input", "R3-C2")),
        Element::Clutch(clutch("C3", "R1", "ground")),
        Element::Clutch(clutch("C4", "R2-C1", "ground")),
        Element::Clutch(clutch("C5", "R3-C2", "ground")),
    ];
    elements.extend(inertias.iter().map(|&(node, i)| inertia(node, i)));
    Driveline { elements }.mechanism().expect("a sound description")
}

fn gear_elements(name: &str) -> Vec<String> {
    names(&GEARS.iter().find(|(gear, _)| *gear == name).unwrap().1)
}

fn close(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-12 * expected.abs().max(1.0), "{value} != {expected}");
}

#[test]
fn ratios_of_all_gears_are_those_of_the_willis_equations() {
    let [z1, z2, z3] = Z;
    // R1 held: R2 = S1 / (1 + z1); C2 closed: S2 = (1 + z2) - z2 R2
    let main_in_5 = (1.0 + z2) - z2 / (1.0 + z1);
    let expected = [
        ("1", 1.0 + z3),
        ("2", (1.0 + z3) * (1.0 + z2) / (1.0 + z2 + z3)),
        ("3", (1.0 + z3) / (1.0 + z3 * (1.0 + z2 / (1.0 + z1)) / (1.0 + z2))),
        ("4", 1.0),
        ("5", (1.0 + z3) / (main_in_5 + z3)),
        ("6", (1.0 + z3) / (1.0 + z2 + z3)),
        ("R", -(1.0 + z3) * (1.0 + z1) / z2),
    ];
    let m = three_sets(&[]);
    for (name, ratio) in expected {
        let gear = Statics::solve(&m, &gear_elements(name), "input", "output").unwrap();
        close(gear.ratio(), ratio);
    }
}

#[test]
fn powers_and_torques_balance_in_every_gear() {
    let m = three_sets(&[]);
    for (_, elements) in GEARS {
        let gear = Statics::solve(&m, &names(&elements), "input", "output").unwrap();
        let (power, torque) = gear.imbalance("input", "output");
        assert!(power < 1e-12 && torque < 1e-12, "{power} {torque}");
        close(gear.load_torque * gear.speed("output").unwrap(), -1.0);
    }
}

#[test]
fn a_brake_has_the_ratios_of_its_gear_alone() {
    let m = three_sets(&[]);
    for (from, to) in [("2", "3"), ("3", "2"), ("1", "2")] {
        let exchange = Exchange::between(&gear_elements(from), &gear_elements(to), &[]).unwrap();
        let shift = Reduction::of(&m, &exchange, "input", "output").unwrap();
        for (ratios, gear) in [(&shift.off_going, from), (&shift.on_coming, to)] {
            let i = Statics::solve(&m, &gear_elements(gear), "input", "output").unwrap().ratio();
            close(ratios.i_c, i - 1.0);
            close(ratios.i_out, i / (i - 1.0));
            close(ratios.sense, -1.0);
        }
    }
}

#[test]
fn the_torque_of_the_drum_is_that_of_the_dual_clutch_element() {
    let m = three_sets(&[]);
    for (from, to) in [("2", "3"), ("3", "4"), ("4", "5"), ("5", "6")] {
        let exchange = Exchange::between(&gear_elements(from), &gear_elements(to), &[]).unwrap();
        let shift = Reduction::of(&m, &exchange, "input", "output").unwrap();
        for (ratios, gear) in [(&shift.off_going, from), (&shift.on_coming, to)] {
            let statics = Statics::solve(&m, &gear_elements(gear), "input", "output").unwrap();
            close(ratios.i_c * ratios.i_out, statics.ratio());
            // Virtual work: T_in = T_k / i_c; the flange is the torque on side a, against the slip.
            let flange = statics.flanges.iter().find(|f| f.element == ratios.element).unwrap();
            close(-flange.torque * ratios.sense, ratios.i_c);
        }
    }
}

#[test]
fn the_mass_matrix_holds_every_member_that_runs_with_both_shafts() {
    let [z1, z2, z3] = Z;
    let m = three_sets(&[
        ("input", 2.0),
        ("main", 0.03),
        ("R1", 0.08),
        ("R2-C1", 0.12),
        ("R3-C2", 0.2),
        ("output", 0.9),
    ]);
    let exchange = Exchange::between(&gear_elements("2"), &gear_elements("3"), &[]).unwrap();
    let shift = Reduction::of(&m, &exchange, "input", "output").unwrap();
    // ω = p ω_in + q ω_out with C1 closed
    let r3 = (-1.0 / z3, (1.0 + z3) / z3);
    let r2 = (((1.0 + z2) * r3.0 - 1.0) / z2, (1.0 + z2) * r3.1 / z2);
    let r1 = (((1.0 + z1) * r2.0 - 1.0) / z1, (1.0 + z1) * r2.1 / z1);
    let [[m11, m12], [m21, m22]] = shift.mass();
    let both = [(0.08, r1), (0.12, r2), (0.2, r3)];
    close(m11, 2.03 + both.iter().map(|(i, (p, _))| i * p * p).sum::<f64>());
    close(m22, 0.9 + both.iter().map(|(i, (_, q))| i * q * q).sum::<f64>());
    close(m12, both.iter().map(|(i, (p, q))| i * p * q).sum());
    close(m21, m12);
    close(shift.coupling_ratio(), m12.abs() / (m11 * m22).sqrt());
    let coupled: Vec<&str> = shift
        .members
        .iter()
        .filter(|member| member.coupling().abs() > 1e-12)
        .map(|member| member.member.as_str())
        .collect();
    assert_eq!(coupled, ["R1", "R2-C1", "R3-C2"]);
    // The published ratios of the family: 2nd 1.86, so i_c = 0.86.
    assert!((shift.off_going.i_c - 0.86).abs() < 5e-4);
}

#[test]
fn without_members_on_both_shafts_nothing_couples() {
    let m = three_sets(&[("input", 2.0), ("main", 0.1), ("output", 0.9)]);
    let exchange = Exchange::between(&gear_elements("2"), &gear_elements("3"), &[]).unwrap();
    let shift = Reduction::of(&m, &exchange, "input", "output").unwrap();
    close(shift.mass()[0][1], 0.0);
    close(shift.coupling_ratio(), 0.0);
}

#[test]
fn a_double_transition_is_refused() {
    let fault = Exchange::between(&gear_elements("2"), &gear_elements("5"), &[]).unwrap_err();
    let (released, applied) = (names(&["C1", "C4"]), names(&["C2", "C3"]));
    assert_eq!(fault, ReductionError::NotOneForOne { released, applied });
    let same = Exchange::between(&gear_elements("2"), &gear_elements("2"), &[]).unwrap_err();
    assert!(same.to_string().contains("released none; applied none"), "{same}");
}

#[test]
fn wrong_names_and_wrong_counts_are_refused_by_name() {
    let m = three_sets(&[]);
    let unknown = Statics::solve(&m, &names(&["C1", "C9"]), "input", "output").unwrap_err();
    assert!(matches!(unknown, EngagedError::UnknownElement { ref name, .. } if name == "C9"));
    let member = Statics::solve(&m, &gear_elements("1"), "input", "outptu").unwrap_err();
    assert!(matches!(member, EngagedError::UnknownMember { ref name, .. } if name == "outptu"));
    let neutral = Statics::solve(&m, &names(&["C5"]), "input", "output").unwrap_err();
    assert!(matches!(neutral, EngagedError::FreeSpeeds { found: 2, wanted: 1, .. }));
    let tied = Statics::solve(&m, &names(&["C1", "C4", "C5"]), "input", "output").unwrap_err();
    assert!(matches!(tied, EngagedError::FreeSpeeds { found: 0, wanted: 1, .. }), "{tied}");
    let all = names(&["C1", "C2", "C4", "C5"]);
    let repeated = Statics::solve(&m, &all, "input", "output").unwrap_err();
    assert!(matches!(repeated, EngagedError::Dependent { .. }), "{repeated}");
    let held = Statics::solve(&m, &names(&["C4", "C5"]), "main", "output").unwrap_err();
    assert!(matches!(held, EngagedError::NotFree { .. }), "{held}");
}

/// Two input shafts, each with one synchronised gear on the output.
fn dual_clutch_gearbox() -> Mechanism<f64> {
    let synchroniser = |name: &str, wheel: &str| Element::Clutch(clutch(name, wheel, "output"));
    let elements: Vec<Element<f64>> = vec![
        Element::Clutch(clutch("K1", "input", "odd")),
        Element::Clutch(clutch("K2", "input", "even")),
        gear("odd", "wheel 1", 3.5),
        gear("odd", "wheel 3", 1.5),
        gear("even", "wheel 2", 2.2),
        synchroniser("D1", "wheel 1"),
        synchroniser("D2", "wheel 2"),
        synchroniser("D3", "wheel 3"),
        inertia("input", 0.2),
        inertia("odd", 0.01),
        inertia("even", 0.01),
        inertia("output", 0.05),
    ];
    Driveline { elements }.mechanism().expect("a sound description")
}

#[test]
fn dogs_of_both_gears_are_engaged_while_clutches_change() {
    let m = dual_clutch_gearbox();
    let dogs = names(&["D1", "D2", "D3"]);
    let exchange = Exchange::between(&names(&["K1", "D1"]), &names(&["K2", "D2"]), &dogs).unwrap();
    assert_eq!((exchange.off_going.as_str(), exchange.on_coming.as_str()), ("K1", "K2"));
    let shift = Reduction::of(&m, &exchange, "input", "output").unwrap();
    close(shift.off_going.i_c, 1.0);
    close(shift.off_going.i_out, 3.5);
    close(shift.on_coming.i_out, 2.2);
    let [[m11, m12], [_, m22]] = shift.mass();
    close(m12, 0.0);
    close(m11, 0.2);
    close(m22, 0.05 + 0.01 * (3.5 * 3.5 + 2.2 * 2.2));
}

#[test]
fn an_idle_shaft_has_no_speed_and_does_not_matter() {
    let m = dual_clutch_gearbox();
    let first = Statics::solve(&m, &names(&["K1", "D1"]), "input", "output").unwrap();
    close(first.ratio(), 3.5);
    assert_eq!(first.speed("even"), None);
    close(first.speed("wheel 3").unwrap(), 1.0 / 1.5);
    let dogs = names(&["D1", "D3"]);
    let exchange = Exchange::between(&names(&["K1", "D1"]), &names(&["K1", "D3"]), &dogs).unwrap();
    assert_eq!(exchange.on_coming, "D3");
    let shift = Reduction::of(&m, &exchange, "input", "output").unwrap();
    close(shift.off_going.i_c, 3.5);
    close(shift.on_coming.i_c, 1.5);
    close(shift.on_coming.i_out, 1.0);
}

#[test]
fn a_slip_without_the_input_speed_has_no_dual_clutch_ratio() {
    let elements: Vec<Element<f64>> = vec![
        Element::Clutch(clutch("K1", "input", "shaft")),
        gear("shaft", "output", 2.0),
        Element::Clutch(clutch("brake", "output", "ground")),
    ];
    let m = Driveline { elements }.mechanism().unwrap();
    let (off_going, on_coming) = ("K1".into(), "brake".into());
    let exchange = Exchange { off_going, on_coming, common: Vec::new() };
    let fault = Reduction::of(&m, &exchange, "input", "output").unwrap_err();
    assert_eq!(fault, ReductionError::NoInputShare { element: "brake".into() });
}

#[test]
fn ratios_carry_derivatives() {
    let z = Dual::<1>::variable(Z[2], 0);
    let elements = vec![
        set("P", ["input", "ring", "output"], z),
        Element::Clutch(Clutch {
            name: "B".into(),
            a: "ring".into(),
            b: "ground".into(),
            friction: drivetwin_core::model::FrictionLaw::constant(Dual::of(1.0)),
            gain: Dual::of(1.0),
            p0: Dual::of(0.0),
            peak: Dual::of(1.0),
            pressure: "P".into(),
            drum_inertia: Dual::of(0.0),
            drag: None,
        }),
    ];
    let m = Driveline { elements }.mechanism().unwrap();
    let ratio = Statics::solve(&m, &names(&["B"]), "input", "output").unwrap().ratio();
    close(ratio.re, 1.0 + Z[2]);
    close(ratio.eps[0], 1.0);
}
