// SPDX-License-Identifier: MIT
//! Small drivelines for tests.

#![allow(dead_code, reason = "each test binary uses its own part")]

use drivetwin_core::model::elements::{
    Clutch, Element, Gear, GearLoss, Inertia, RoadLoad, SpringDamper, Torque,
};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::model::{Driveline, FrictionLaw, Stribeck};
use drivetwin_core::network::Network;
use drivetwin_core::number::Real;
use drivetwin_core::simulate::{Output, RunOptions, Start, Trajectory, run};
use drivetwin_core::solver::{Settings, Signal as Input};
use std::marker::PhantomData;

/// A signal: input name, times, values.
pub type Signal = (&'static str, Vec<f64>, Vec<f64>);

pub fn inertia(node: &str, inertia: f64) -> Element<f64> {
    let name = format!("J {node}").into();
    Element::Inertia(Inertia { name, node: node.into(), inertia })
}

pub fn torque(node: &str, input: &str) -> Element<f64> {
    let (name, node, input) = (format!("source {input}").into(), node.into(), input.into());
    Element::Torque(Torque { name, node, input, reaction: None, number: PhantomData })
}

pub fn gear(a: &str, b: &str, ratio: f64) -> Element<f64> {
    let name = format!("gear {a} {b}").into();
    Element::Gear(Gear { name, a: a.into(), b: b.into(), ratio, loss: None, losses: None })
}

pub fn shaft(a: &str, b: &str, stiffness: f64, damping: f64) -> Element<f64> {
    let name = format!("shaft {a} {b}").into();
    Element::SpringDamper(SpringDamper { name, a: a.into(), b: b.into(), stiffness, damping })
}

pub fn load(node: &str, constant: f64, rolling: f64, aero: f64) -> Element<f64> {
    let name = format!("load {node}").into();
    Element::RoadLoad(RoadLoad { name, node: node.into(), constant, rolling, aero })
}

/// A clutch of constant μ = 1 and gain 1, so that its capacity is the pressure in N·m.
pub fn clutch(name: &str, a: &str, b: &str) -> Clutch<f64> {
    Clutch {
        name: name.into(),
        a: a.into(),
        b: b.into(),
        friction: FrictionLaw::constant(1.0),
        gain: 1.0,
        p0: 0.0,
        peak: 1.0,
        pressure: format!("P {name}").into(),
        drum_inertia: 0.0,
        drag: None,
    }
}

pub fn compile(elements: Vec<Element<f64>>) -> Network<f64> {
    Network::compile(&Driveline { elements }).expect("the driveline is sound")
}

pub fn grid(end: f64, points: usize) -> Vec<f64> {
    (0..points).map(|i| end * i as f64 / (points - 1) as f64).collect()
}

pub fn start(speeds: &[(&str, f64)], locked: &[&str]) -> Start<f64> {
    Start {
        speeds: speeds.iter().map(|&(n, v)| (n.to_owned(), v)).collect(),
        twists: Vec::new(),
        locked: locked.iter().map(|&n| n.to_owned()).collect(),
    }
}

pub fn simulate(
    network: &Network<f64>,
    signals: &[Signal],
    start: &Start<f64>,
    grid: &[f64],
    outputs: &[Output],
) -> Trajectory<f64> {
    simulate_by(
        RunOptions { settings: Settings::default(), audit: true },
        network,
        signals,
        start,
        grid,
        outputs,
    )
}

/// Simulate with given settings, audited or not. Operators pass samples only without the audit.
pub fn simulate_by(
    options: RunOptions,
    network: &Network<f64>,
    signals: &[Signal],
    start: &Start<f64>,
    grid: &[f64],
    outputs: &[Output],
) -> Trajectory<f64> {
    let signals: Vec<(&str, Input<'_, f64>)> =
        signals.iter().map(|(n, t, v)| (*n, Input::samples(t, v))).collect();
    run(network, &signals, start, grid, outputs, options).expect("sound inputs")
}

pub fn constant(name: &'static str, value: f64, end: f64) -> Signal {
    (name, vec![0.0, end], vec![value, value])
}

/// Nodes and shaft of the driveline of the paper.
const ENGINE: &str = "engine";
const OUTPUT: &str = "output";
const WHEEL: &str = "wheel";
const SHAFT: &str = "output shaft";

/// The driveline of the paper with the numbers of PARAMETERS section 4.
pub fn paper_driveline<T: Real>(law: LossLaw) -> Driveline<T> {
    let plain = |name: &str, a: &str, b: &str, ratio: f64| Gear {
        name: name.into(),
        a: a.into(),
        b: b.into(),
        ratio,
        loss: None,
        losses: None,
    };
    let mass = |name: &str, node: &str, inertia: f64| {
        Element::Inertia(Inertia { name: name.into(), node: node.into(), inertia })
    };
    let path = |name: &str, ratio: f64, gain: f64| {
        let (a, b) = (format!("{name} input side"), format!("{name} output side"));
        let friction = Stribeck { mu_c: 0.110, mu_s: 0.135, v_s: 15.0, mu_v: 1e-4 };
        let element = Clutch {
            friction: FrictionLaw::Stribeck(friction),
            gain,
            p0: 0.8e5,
            pressure: name.into(),
            ..clutch(name, &a, &b)
        };
        [
            Element::Gear(plain(&format!("i_c {name}"), "input gear", &a, ratio - 1.0)),
            Element::Clutch(element),
            Element::Gear(plain(&format!("i_out {name}"), &b, OUTPUT, ratio / (ratio - 1.0))),
        ]
    };
    let loss = Some(GearLoss::by_efficiency(law, 0.85));
    let output_shaft = SpringDamper {
        name: SHAFT.into(),
        a: OUTPUT.into(),
        b: "axle".into(),
        stiffness: 1.76e5,
        damping: 280.0,
    };
    let resistance = RoadLoad {
        name: "load".into(),
        node: WHEEL.into(),
        constant: 2300.0 * 5.38,
        rolling: 0.0,
        aero: 0.0,
    };
    let mut elements = vec![
        mass("J1", ENGINE, 20.3),
        torque(ENGINE, "engine torque"),
        Element::Gear(Gear { loss, ..plain("i_in", ENGINE, "input gear", 1.0) }),
        mass("J_out", OUTPUT, 0.9),
        Element::SpringDamper(output_shaft),
        Element::Gear(plain("i_f", "axle", WHEEL, 5.38)),
        mass("J_v", WHEEL, 6056.0),
    ];
    elements.extend(path("B2", 1.91, 3.78e-2));
    elements.extend(path("B3", 1.43, 2.7e-2));
    elements.push(Element::RoadLoad(resistance));
    Driveline { elements }.promote()
}

/// Speeds of engine, output and wheel, twist and torque of the output shaft.
pub fn motion_outputs() -> [Output; 5] {
    [
        Output::Speed(ENGINE.into()),
        Output::Speed(OUTPUT.into()),
        Output::Speed(WHEEL.into()),
        Output::Twist(SHAFT.into()),
        Output::ShaftTorque(SHAFT.into()),
    ]
}

/// Start in steady 2nd gear at 178 rad/s.
pub fn second_gear<T: Real>() -> Start<T> {
    let (engine, output) = (178.0, 178.0 / 1.91);
    let speeds = [(ENGINE, engine), (OUTPUT, output), (WHEEL, output / 5.38)];
    Start {
        speeds: speeds.map(|(node, speed)| (node.into(), T::of(speed))).into(),
        twists: vec![(SHAFT.into(), T::of(2461.0 / 1.76e5))],
        locked: vec!["B2".into()],
    }
}

/// Pressures and engine torque of a power-on upshift at 1 kHz; `weak` scales the on-coming one.
pub fn upshift(weak: f64) -> Vec<Signal> {
    let times = grid(1.5, 1501);
    let line = |points: &[(f64, f64)]| -> Vec<f64> {
        times.iter().map(|&t| interpolate(points, t)).collect()
    };
    let torque =
        line(&[(0.0, 1545.0), (0.45, 1545.0), (0.5, 1100.0), (0.8, 1100.0), (0.9, 1545.0)]);
    let b2 = line(&[(0.0, 14e5), (0.3, 14e5), (0.36, 5e5), (0.45, 0.0)]);
    let b3 =
        line(&[(0.0, 0.0), (0.2, 0.0), (0.3, 1.5e5), (0.45, 5.5e5), (0.9, 6.5e5), (1.1, 14e5)]);
    let ripple = |t: f64| 0.2e5 * (2.0 * std::f64::consts::PI * 22.0 * t).sin();
    let b3 = times
        .iter()
        .zip(b3)
        .map(|(&t, p)| weak * if (0.5..0.9).contains(&t) { p + ripple(t) } else { p })
        .collect();
    vec![("engine torque", times.clone(), torque), ("B2", times.clone(), b2), ("B3", times, b3)]
}

fn interpolate(points: &[(f64, f64)], t: f64) -> f64 {
    let next = points.partition_point(|p| p.0 <= t);
    if next == 0 {
        return points[0].1;
    }
    if next == points.len() {
        return points[next - 1].1;
    }
    let ((a, x), (b, y)) = (points[next - 1], points[next]);
    x + (y - x) * (t - a) / (b - a)
}

/// Compile, or `None` where the driveline is refused with a typed error.
pub fn compile_or_refuse(elements: Vec<Element<f64>>) -> Option<Network<f64>> {
    Network::compile(&Driveline { elements }).ok()
}
