// SPDX-License-Identifier: MIT
//! Random drivelines under random pressures: every run ends, with a status where it fails; what is
//! locked does not slip; no one-way clutch overruns; no capacity is exceeded; the energy balance closes.
//!
//! `PROPTEST_CASES=10000 cargo test --release -p drivetwin-core --test random_networks` is the long
//! form.

mod common;

use common::{compile_or_refuse, gear, inertia, load, shaft, torque};
use drivetwin_core::model::elements::{
    Bearing, Clutch, Element, Gear, GearLoss, OneWayClutch, Planetary,
};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::model::{FrictionLaw, LossTable, Name, Stribeck};
use drivetwin_core::simulate::{Output, RunOptions, Start, Trajectory, run};
use drivetwin_core::solver::{EventKind, Settings, Signal, Status};
use proptest::prelude::*;

const NODES: [&str; 5] = ["a", "b", "c", "d", "ground"];
const SECONDS: f64 = 1.0;
const SAMPLES: usize = 41;
/// Enough for operators to pay.
const FINE_SAMPLES: usize = 501;

/// One random friction element with its pressure [N·m of capacity over μ].
#[derive(Clone, Debug)]
struct RandomClutch {
    a: usize,
    b: usize,
    peak: f64,
    stribeck: bool,
    pressure: Vec<f64>,
}

/// Loss torque at the largest speed without torque [N·m], and loss per torque.
type TableSize = (f64, f64);

#[derive(Clone, Debug)]
enum RandomElement {
    Shaft(usize, usize, f64, f64),
    Gear(usize, f64, Option<(f64, f64)>, Option<TableSize>),
    Planetary(f64, Option<TableSize>),
    OneWay(usize, usize),
    Bearing(usize, f64),
    Load(usize, f64, f64, f64),
}

#[derive(Clone, Debug)]
struct Case {
    inertias: [f64; 4],
    speeds: [f64; 4],
    drive: Vec<f64>,
    clutches: Vec<RandomClutch>,
    others: Vec<RandomElement>,
}

fn pressure() -> impl Strategy<Value = Vec<f64>> {
    let level = prop_oneof![Just(0.0), Just(50.0), -20.0..100.0];
    prop::collection::vec(level, 5)
}

fn clutch() -> impl Strategy<Value = RandomClutch> {
    let peak = prop_oneof![Just(1.0), 1.0..1.5];
    (0..4usize, 0..5usize, peak, any::<bool>(), pressure())
        .prop_filter("different sides", |c| c.0 != c.1)
        .prop_map(|(a, b, peak, stribeck, pressure)| RandomClutch {
            a,
            b,
            peak,
            stribeck,
            pressure,
        })
}

fn element() -> impl Strategy<Value = RandomElement> {
    let loss = prop::option::of((0.3..1.0, 0.3..1.0));
    let table = || prop::option::of((prop_oneof![Just(0.0), 0.0..10.0], 0.0..0.5));
    prop_oneof![
        (0..4usize, 0..4usize, 10.0..1e4, 0.0..20.0)
            .prop_filter("different ends", |s| s.0 != s.1)
            .prop_map(|(a, b, k, c)| RandomElement::Shaft(a, b, k, c)),
        (0..4usize, prop_oneof![-4.0..-0.3, 0.3..4.0], loss, table())
            .prop_map(|(a, ratio, loss, table)| RandomElement::Gear(a, ratio, loss, table)),
        (prop_oneof![-3.0..-1.3, 1.2..4.0], table())
            .prop_map(|(z, table)| RandomElement::Planetary(z, table)),
        (0..4usize, 0..5usize)
            .prop_filter("different sides", |s| s.0 != s.1)
            .prop_map(|(a, b)| RandomElement::OneWay(a, b)),
        (0..4usize, 0.0..5.0).prop_map(|(a, t)| RandomElement::Bearing(a, t)),
        (0..4usize, -20.0..20.0, 0.0..10.0, 0.0..0.1).prop_map(|(a, constant, rolling, aero)| {
            RandomElement::Load(a, constant, rolling, aero)
        }),
    ]
}

/// The fields of a case in their order.
type Fields = ([f64; 4], [f64; 4], Vec<f64>, Vec<RandomClutch>, Vec<RandomElement>);

fn assembled((inertias, speeds, drive, clutches, others): Fields) -> Case {
    Case { inertias, speeds, drive, clutches, others }
}

fn case() -> impl Strategy<Value = Case> {
    let speed = prop_oneof![Just(0.0), -50.0..50.0];
    (
        prop::array::uniform4(0.05..5.0),
        prop::array::uniform4(speed),
        prop::collection::vec(prop_oneof![Just(0.0), -60.0..60.0], 5),
        prop::collection::vec(clutch(), 1..5),
        prop::collection::vec(element(), 0..4),
    )
        .prop_map(assembled)
}

/// Cases as written by hand, of few round numbers: equal capacities, torques exactly at them, members at rest,
/// events of several elements at one instant.
fn case_by_hand() -> impl Strategy<Value = Case> {
    let pick = |values: &'static [f64]| prop::sample::select(values);
    let torques = move || pick(&[0.0, 0.0, 10.0, 50.0, -50.0, 90.0, 100.0]);
    let clutch = (0..4usize, 0..5usize, pick(&[1.0, 1.2]), any::<bool>())
        .prop_filter("different sides", |c| c.0 != c.1);
    let levels = prop::collection::vec(pick(&[0.0, 50.0, 50.0, 100.0]), 5);
    let clutch = (clutch, levels).prop_map(|((a, b, peak, stribeck), pressure)| RandomClutch {
        a,
        b,
        peak,
        stribeck,
        pressure,
    });
    let other = prop_oneof![
        (0..4usize, 0..4usize, pick(&[100.0, 1000.0]), pick(&[0.0, 1.0, 100.0]))
            .prop_filter("different ends", |s| s.0 != s.1)
            .prop_map(|(a, b, k, c)| RandomElement::Shaft(a, b, k, c)),
        (0..4usize, pick(&[-1.0, 1.0, 2.0]), prop::option::of(Just((5.0, 0.1))))
            .prop_map(|(a, z, table)| RandomElement::Gear(a, z, None, table)),
        pick(&[-2.0, 2.0, 3.0]).prop_map(|z| RandomElement::Planetary(z, None)),
        (0..4usize, 0..5usize)
            .prop_filter("different sides", |s| s.0 != s.1)
            .prop_map(|(a, b)| RandomElement::OneWay(a, b)),
        (0..4usize, pick(&[0.0, 10.0, 50.0]), pick(&[0.0, 5.0]))
            .prop_map(|(a, constant, rolling)| RandomElement::Load(a, constant, rolling, 0.0)),
    ];
    (
        prop::array::uniform4(pick(&[0.5, 1.0, 2.0])),
        prop::array::uniform4(pick(&[0.0, 0.0, 1.0, 10.0, -10.0])),
        prop::collection::vec(torques(), 5),
        prop::collection::vec(clutch, 1..5),
        prop::collection::vec(other, 0..4),
    )
        .prop_map(assembled)
}

fn friction(stribeck: bool) -> FrictionLaw<f64> {
    if stribeck {
        FrictionLaw::Stribeck(Stribeck { mu_c: 0.8, mu_s: 1.0, v_s: 5.0, mu_v: 1e-3 })
    } else {
        FrictionLaw::constant(1.0)
    }
}

/// Losses that grow with speed and torque, with breakpoints at round numbers.
fn losses((churning, share): TableSize) -> LossTable {
    let speed = vec![1.0, 10.0, 50.0];
    let torque = vec![0.0, 10.0, 50.0, 100.0];
    let row = |torque: &f64| speed.iter().map(|w| churning * w / 50.0 + share * torque).collect();
    let loss = torque.iter().map(row).collect();
    LossTable { speed, torque, loss }
}

fn elements(case: &Case) -> Vec<Element<f64>> {
    let mut all: Vec<Element<f64>> = (0..4).map(|i| inertia(NODES[i], case.inertias[i])).collect();
    all.push(torque("a", "drive"));
    for (i, c) in case.clutches.iter().enumerate() {
        all.push(Element::Clutch(Clutch {
            friction: friction(c.stribeck),
            peak: c.peak,
            ..common::clutch(&format!("clutch {i}"), NODES[c.a], NODES[c.b])
        }));
    }
    for (i, other) in case.others.iter().enumerate() {
        let name: Name = format!("element {i}").into();
        let element = match *other {
            RandomElement::Shaft(a, b, k, c) => renamed(shaft(NODES[a], NODES[b], k, c), name),
            RandomElement::Gear(a, ratio, loss, table) => {
                let far = format!("far {i}");
                all.push(renamed(inertia(&far, 0.3), format!("J {i}").into()));
                let loss = loss.map(|(eta, eta_backward)| GearLoss {
                    eta_backward: Some(eta_backward),
                    ..GearLoss::by_efficiency(LossLaw::Dissipative, eta)
                });
                let Element::Gear(plain) = gear(NODES[a], &far, ratio) else { unreachable!() };
                Element::Gear(Gear { name, loss, losses: table.map(losses), ..plain })
            }
            RandomElement::Planetary(z, table) => Element::Planetary(Planetary {
                name,
                sun: "a".into(),
                ring: format!("ring {i}").into(),
                carrier: "b".into(),
                z,
                planet_inertia: None,
                losses: table.map(losses),
            }),
            RandomElement::OneWay(a, b) => Element::OneWayClutch(OneWayClutch {
                name,
                a: NODES[a].into(),
                b: NODES[b].into(),
                clutch: None,
            }),
            RandomElement::Bearing(a, torque) => Element::Bearing(Bearing {
                name,
                a: NODES[a].into(),
                b: "ground".into(),
                speed: vec![0.0, 10.0],
                torque: vec![torque, 2.0 * torque],
                peak: 1.0,
            }),
            RandomElement::Load(a, constant, rolling, aero) => {
                renamed(load(NODES[a], constant, rolling, aero), name)
            }
        };
        all.push(element);
    }
    all
}

fn renamed(mut element: Element<f64>, name: Name) -> Element<f64> {
    match &mut element {
        Element::SpringDamper(e) => e.name = name,
        Element::RoadLoad(e) => e.name = name,
        Element::Inertia(e) => e.name = name,
        _ => unreachable!("only these are renamed"),
    }
    element
}

/// The run of a case over so many points: slips and torques of its clutches, slips of its one-way clutches.
fn simulate(
    case: &Case,
    points: usize,
    RunOptions { settings, audit }: RunOptions,
) -> Option<Trajectory<f64>> {
    let network = compile_or_refuse(elements(case))?;
    let times: Vec<f64> = (0..5).map(|i| SECONDS * i as f64 / 4.0).collect();
    let names: Vec<String> = (0..case.clutches.len()).map(|i| format!("P clutch {i}")).collect();
    let mut signals = vec![("drive", Signal::samples(&times, &case.drive))];
    for (name, c) in names.iter().zip(&case.clutches) {
        signals.push((name, Signal::samples(&times, &c.pressure)));
    }
    let one_way = case.others.iter().enumerate();
    let one_way = one_way.filter(|(_, other)| matches!(other, RandomElement::OneWay(..)));
    let outputs: Vec<Output> = (0..case.clutches.len())
        .flat_map(|i| {
            let name = format!("clutch {i}");
            [Output::Slip(name.clone()), Output::FrictionTorque(name)]
        })
        .chain(one_way.map(|(i, _)| Output::Slip(format!("element {i}"))))
        .collect();
    let start = Start {
        speeds: (0..4).map(|i| (NODES[i].to_owned(), case.speeds[i])).collect(),
        ..Start::default()
    };
    let grid = common::grid(SECONDS, points);
    run(&network, &signals, &start, &grid, &outputs, RunOptions { settings, audit }).ok()
}

fn interpolated(values: &[f64], t: f64) -> f64 {
    let position = (t / SECONDS * 4.0).clamp(0.0, 4.0);
    let i = (position as usize).min(3);
    values[i] + (values[i + 1] - values[i]) * (position - i as f64)
}

fn check(case: &Case, trajectory: &Trajectory<f64>) {
    let complete = trajectory.status == Status::Completed;
    for column in &trajectory.columns {
        assert_eq!(column.len(), SAMPLES);
        assert!(!complete || column.iter().all(|v| v.is_finite()), "NaN without a status");
    }
    let slips = trajectory.columns.iter().flatten().filter(|v| v.is_finite());
    let largest = slips.fold(50.0, |largest: f64, v| largest.max(v.abs()));
    for overrun in &trajectory.columns[2 * case.clutches.len()..] {
        assert!(overrun.iter().all(|&slip| slip.is_nan() || slip <= 1e-9 * largest), "{overrun:?}");
    }
    for (i, c) in case.clutches.iter().enumerate() {
        let (slip, torque) = (&trajectory.columns[2 * i], &trajectory.columns[2 * i + 1]);
        let mut locked = false;
        let mut changes = trajectory.events.iter().filter(|e| e.element == i).peekable();
        for (k, &t) in trajectory.time.iter().enumerate() {
            while let Some(event) = changes.next_if(|e| e.time <= t) {
                locked = event.kind == EventKind::Lock;
            }
            if slip[k].is_nan() {
                break;
            }
            let normal = interpolated(&c.pressure, t).max(0.0);
            let capacity = normal * c.peak.max(1.0 + 1e-3 * slip[k].abs());
            let allowed = capacity + 1e-6 * (1.0 + capacity);
            assert!(torque[k].abs() <= allowed, "{t}: {} exceeds {capacity}", torque[k]);
            assert!(!locked || slip[k].abs() < 1e-9, "{t}: locked with slip {}", slip[k]);
            assert!(slip[k] * torque[k] > -1e-6, "{t}: friction drives its slip");
        }
    }
    if let (true, Some(audit)) = (complete, trajectory.audit) {
        let size = audit.source.abs() + audit.stored.abs() + audit.friction + audit.load.abs();
        assert!(audit.error.abs() < 1e-6 * (1.0 + size), "{audit:?}");
        assert!(audit.created <= 1e-9 * (1.0 + size), "dissipative gears create energy: {audit:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, max_shrink_iters: 2000, ..ProptestConfig::default() })]

    #[test]
    fn every_run_ends_and_obeys_the_friction_laws(case in case()) {
        if let Some(trajectory) = simulate(&case, SAMPLES, RunOptions { settings: Settings::default(), audit: true }) {
            check(&case, &trajectory);
        }
    }

    #[test]
    fn passing_samples_by_operators_changes_a_run_but_little(case in case()) {
        let run = |settings| simulate(&case, FINE_SAMPLES, RunOptions { settings, audit: false });
        let both = run(Settings::default()).zip(run(Settings::exact()));
        let completed = |run: &Trajectory<f64>| run.status == Status::Completed;
        let Some((fast, exact)) = both.filter(|(a, b)| completed(a) && completed(b)) else {
            return Ok(());
        };
        for i in 0..case.clutches.len() {
            let (fast, exact) = (&fast.columns[2 * i], &exact.columns[2 * i]);
            let largest = exact.iter().fold(1.0, |largest: f64, slip| largest.max(slip.abs()));
            for (k, (a, b)) in fast.iter().zip(exact).enumerate() {
                prop_assert!((a - b).abs() < 1e-4 * largest, "clutch {i}, sample {k}: {a}, {b}");
            }
        }
    }

    #[test]
    fn what_happens_at_one_instant_is_decided_and_not_again_and_again(case in case_by_hand()) {
        for settings in [Settings::default(), Settings::exact()] {
            if let Some(trajectory) = simulate(&case, SAMPLES, RunOptions { settings, audit: true }) {
                prop_assert_eq!(&trajectory.status, &Status::Completed);
                check(&case, &trajectory);
            }
        }
    }
}
