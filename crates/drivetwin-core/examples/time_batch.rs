// SPDX-License-Identifier: MIT
//! Time a batch of dual-clutch shifts: `time_batch SCENARIO.json SETS.json THREADS REPEATS` prints, as
//! JSON, the nanoseconds of every pass over all parameter sets, and the shaft torques of the last.

use drivetwin_core::model::DualClutch;
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{DualClutchStart, Keep, Output, Plan, dual_clutch_batch};
use drivetwin_core::solve::{Settings, Signal};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::time::Instant;

#[derive(Deserialize)]
struct Scenario {
    model: DualClutch<f64>,
    /// s
    time: Vec<f64>,
    signals: BTreeMap<String, Vec<f64>>,
    start: Begin,
}

#[derive(Deserialize)]
struct Begin {
    engine_speed: f64,
    output_speed: f64,
    wheel_speed: f64,
    twist: f64,
    locked: Vec<String>,
}

#[derive(Deserialize)]
struct Sets {
    parameters: Vec<String>,
    values: Vec<Vec<f64>>,
}

fn read<T: for<'a> Deserialize<'a>>(path: &str) -> T {
    let text = std::fs::read_to_string(path).expect("a readable file");
    serde_json::from_str(&text).expect("what the file should hold")
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (scenario, sets): (Scenario, Sets) = (read(&arguments[0]), read(&arguments[1]));
    let number = |i: usize| arguments[i].parse::<usize>().expect("a number");
    let (threads, repeats) = (number(2), number(3));
    let signals: Vec<(&str, Signal<'_, f64>)> = scenario
        .signals
        .iter()
        .map(|(name, values)| (name.as_str(), Signal::samples(&scenario.time, values)))
        .collect();
    let s = scenario.start;
    let start = DualClutchStart {
        engine_speed: s.engine_speed,
        output_speed: s.output_speed,
        wheel_speed: s.wheel_speed,
        twist: s.twist,
        locked: s.locked,
    };
    let network = Network::compile(&scenario.model.driveline()).expect("a driveline");
    let outputs = [Output::ShaftTorque("output shaft".into())];
    let options = (Settings::default(), false);
    let plan = Plan::new(&network, &signals, &scenario.time, &outputs, options).expect("a plan");
    let scenarios = [(plan, start)];
    let names: Vec<&str> = sets.parameters.iter().map(String::as_str).collect();
    let values: Vec<f64> = sets.values.into_iter().flatten().collect();
    let mut times = Vec::new();
    let run = || {
        let options = (Keep::Columns, threads);
        dual_clutch_batch(&scenario.model, &scenarios, (&names, &values), options)
            .expect("names of parameters")
    };
    let mut result = run();
    for _ in 0..repeats {
        let begin = Instant::now();
        result = std::hint::black_box(run());
        times.push(begin.elapsed().as_nanos() as u64);
    }
    let result = serde_json::json!({
        "ns": times,
        "torque": result.values,
        "events": result.events,
        "outcomes": result.outcomes.iter().map(|o| format!("{o:?}")).collect::<Vec<_>>(),
    });
    println!("{result}");
}
