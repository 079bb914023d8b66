// SPDX-License-Identifier: MIT
//! Time the run of any network: `one_shift SCENARIO.json REPEATS` prints, as JSON, the seconds of
//! every run of a compiled network whose modes and operators runs before have needed, of every first
//! run of a compiled network, and of everything from the elements on, and what the last run gave.
//! With zero repeats it runs once and nothing else, to count instructions.

use drivetwin_core::model::{Driveline, Element};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{Output, Plan, RunOptions, Start};
use drivetwin_core::solver::{Settings, Signal, SolverCache};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;

/// As in the Python package.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

#[derive(Deserialize)]
struct Scenario {
    elements: Vec<Element<f64>>,
    /// Instants of the outputs, s.
    time: Vec<f64>,
    /// Sampled inputs by name: times [s] and values.
    samples: BTreeMap<String, (Vec<f64>, Vec<f64>)>,
    /// Offset, amplitude, frequency [Hz], phase [rad] by name.
    sines: BTreeMap<String, [f64; 4]>,
    speeds: Vec<(String, f64)>,
    twists: Vec<(String, f64)>,
    locked: Vec<String>,
    outputs: Vec<Output>,
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("a scenario file");
    let repeats: usize = arguments.next().map_or(1, |n| n.parse().expect("a number of repeats"));
    let text = std::fs::read_to_string(path).expect("a readable scenario");
    let scenario: Scenario = serde_json::from_str(&text).expect("a scenario");
    let mut signals: Vec<(&str, Signal<'_, f64>)> = Vec::new();
    for (name, (times, values)) in &scenario.samples {
        signals.push((name, Signal::samples(times, values)));
    }
    for (name, &[offset, amplitude, frequency, phase]) in &scenario.sines {
        signals.push((name, Signal::Sine { offset, amplitude, frequency, phase }));
    }
    let (speeds, twists, locked) = (scenario.speeds, scenario.twists, scenario.locked);
    let start = Start { speeds, twists, locked };
    let driveline = Driveline { elements: scenario.elements };
    let prepare = || {
        let network = Network::compile(&driveline).expect("a driveline");
        let options = RunOptions { settings: Settings::default(), audit: false };
        let plan = Plan::new(&network, &signals, &scenario.time, &scenario.outputs, options);
        let state = start.state(&network).expect("a start");
        (network, plan.expect("a scenario"), state)
    };
    let (network, plan, state) = prepare();
    let mut known = SolverCache::new(&network);
    let mut run = plan.run_again(&mut known, &state);
    let (mut again, mut first, mut whole) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..repeats {
        let begin = Instant::now();
        run = black_box(plan.run_again(&mut known, &state));
        again.push(begin.elapsed().as_secs_f64());
        let begin = Instant::now();
        black_box(plan.run(&network, &state));
        first.push(begin.elapsed().as_secs_f64());
        let begin = Instant::now();
        let (network, plan, state) = prepare();
        black_box(plan.run(&network, &state));
        whole.push(begin.elapsed().as_secs_f64());
    }
    let events: Vec<f64> = run.events.iter().map(|event| event.time).collect();
    let result = serde_json::json!({
        "again": again,
        "first": first,
        "whole": whole,
        "columns": run.columns,
        "events": events,
        "status": run.status.to_string(),
    });
    println!("{result}");
}
