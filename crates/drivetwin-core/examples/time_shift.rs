// SPDX-License-Identifier: MIT
//! Time one dual-clutch shift: `time_shift SCENARIO.json REPEATS` prints, as JSON, the nanoseconds of
//! every run of a prepared scenario with four outputs (`prepared`) and of everything from the
//! description of the driveline on (`whole`), and the columns and event times of the last run.

use drivetwin_core::model::DualClutch;
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{Output, Plan, Start};
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
    #[serde(default)]
    exact: bool,
}

#[derive(Deserialize)]
struct Begin {
    engine_speed: f64,
    output_speed: f64,
    wheel_speed: f64,
    twist: f64,
    locked: Vec<String>,
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("a scenario file");
    let repeats: usize = arguments.next().map_or(1, |n| n.parse().expect("a number of repeats"));
    let text = std::fs::read_to_string(path).expect("a readable scenario");
    let scenario: Scenario = serde_json::from_str(&text).expect("a scenario");
    let signals: Vec<(&str, Signal<'_, f64>)> = scenario
        .signals
        .iter()
        .map(|(name, values)| (name.as_str(), Signal::samples(&scenario.time, values)))
        .collect();
    let s = scenario.start;
    let start = Start {
        speeds: vec![
            ("engine".into(), s.engine_speed),
            ("output".into(), s.output_speed),
            ("wheel".into(), s.wheel_speed),
        ],
        twists: vec![("output shaft".into(), s.twist)],
        locked: s.locked,
    };
    let outputs = [
        Output::Speed("engine".into()),
        Output::Speed("output".into()),
        Output::Speed("wheel".into()),
        Output::ShaftTorque("output shaft".into()),
    ];
    let settings = if scenario.exact { Settings::exact() } else { Settings::default() };
    let prepare = || {
        let network = Network::compile(&scenario.model.driveline()).expect("a driveline");
        let options = (settings, false);
        let plan = Plan::new(&network, &signals, &scenario.time, &outputs, options);
        let state = start.state(&network).expect("a start");
        (network, plan.expect("a scenario"), state)
    };
    let (network, plan, state) = prepare();
    let (mut prepared, mut whole) = (Vec::new(), Vec::new());
    let mut run = plan.run(&network, &state);
    for _ in 0..repeats {
        let begin = Instant::now();
        run = std::hint::black_box(plan.run(&network, &state));
        prepared.push(begin.elapsed().as_nanos());
        let begin = Instant::now();
        let (network, plan, state) = prepare();
        std::hint::black_box(plan.run(&network, &state));
        whole.push(begin.elapsed().as_nanos());
    }
    let events: Vec<f64> = run.events.iter().map(|event| event.time).collect();
    let result = serde_json::json!({
        "prepared_ns": prepared.iter().map(|&ns| ns as u64).collect::<Vec<_>>(),
        "whole_ns": whole.iter().map(|&ns| ns as u64).collect::<Vec<_>>(),
        "columns": run.columns,
        "events": events,
    });
    println!("{result}");
}
