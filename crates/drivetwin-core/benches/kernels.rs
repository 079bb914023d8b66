// SPDX-License-Identifier: MIT
//! The parts of a run that take its time: `cargo bench -p drivetwin-core`.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{paper_driveline, second_gear};
use criterion::{Criterion, criterion_group, criterion_main};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::network::{ModeKey, Network};
use drivetwin_core::simulate::{
    Keep, Plan, RunOptions, Sampled, dual_clutch_batch, dual_clutch_outputs,
    dual_clutch_sensitivities,
};
use drivetwin_core::solver::{Settings, Signal, SolverCache};
use std::hint::black_box;

/// Time [s], engine torque [N·m] and pressures [Pa] of a shift from second to third.
fn upshift() -> [Vec<f64>; 4] {
    let time: Vec<f64> = (0..=1500).map(|i| f64::from(i) * 1e-3).collect();
    let along = |points: &[(f64, f64)]| {
        let at = |t: f64| {
            let next = points.iter().position(|p| p.0 > t).unwrap_or(points.len() - 1).max(1);
            let ((t0, a), (t1, b)) = (points[next - 1], points[next]);
            a + (b - a) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
        };
        time.iter().map(|&t| at(t)).collect::<Vec<f64>>()
    };
    let torque = along(&[(0.0, 1500.0), (0.6, 1500.0), (0.8, 1200.0), (1.5, 1500.0)]);
    let off = along(&[(0.0, 1.5e6), (0.4, 1.5e6), (0.5, 6e5), (0.65, 0.0), (1.5, 0.0)]);
    let on = along(&[(0.0, 0.0), (0.4, 1e5), (0.6, 6e5), (1.2, 8e5), (1.5, 1.5e6)]);
    [time, torque, off, on]
}

fn kernels(criterion: &mut Criterion) {
    let model = paper_driveline::<f64>(LossLaw::Paper);
    let driveline = model.driveline();
    let network = Network::compile(&driveline).expect("a driveline");
    let [time, torque, off, on] = upshift();
    let signals = [
        ("engine torque", Signal::samples(&time, &torque)),
        ("B2", Signal::samples(&time, &off)),
        ("B3", Signal::samples(&time, &on)),
    ];
    let outputs = dual_clutch_outputs(&model);
    let options = RunOptions { settings: Settings::default(), audit: false };
    let plan = Plan::new(&network, &signals, &time, &outputs[4..5], options).expect("a plan");
    let begin = second_gear();
    let state = begin.state(&network).expect("a start");

    criterion.bench_function("compile a network", |b| {
        b.iter(|| Network::compile(black_box(&driveline)));
    });
    criterion.bench_function("compile a mode", |b| {
        let key = ModeKey::new([0].into_iter(), &[]);
        b.iter(|| network.mode(black_box(key), &[1.0, 1.0]));
    });
    criterion.bench_function("join the inputs", |b| {
        b.iter(|| Plan::new(&network, black_box(&signals), &time, &outputs[4..5], options));
    });
    criterion.bench_function("one shift", |b| b.iter(|| plan.run(&network, black_box(&state))));
    criterion.bench_function("one shift, modes known", |b| {
        let mut known = SolverCache::new(&network);
        b.iter(|| plan.run_again(&mut known, black_box(&state)));
    });
    let sampled = [("engine torque", &torque), ("B2", &off), ("B3", &on)]
        .map(|(name, values)| Sampled { name, times: &time, values, delay: 0.0 });
    let names = ["eta", "J1", "k_o", "B3.P0", "B3.mu_c", "B3.mu_s", "start.twist", "delay.B3"];
    criterion.bench_function("8 derivatives", |b| {
        let (settings, time) = (Settings::default(), &time);
        b.iter(|| {
            let time = black_box(time);
            dual_clutch_sensitivities(&model, &sampled, &begin, time, settings, &names)
        });
    });
    let scenarios = [(plan.clone(), begin.clone())];
    let sets: Vec<f64> = (0..64).map(|i| 0.80 + 0.001 * f64::from(i)).collect();
    criterion.bench_function("64 runs, one thread", |b| {
        let mut ends = vec![0.0; sets.len()];
        b.iter(|| {
            let scenarios = black_box(&scenarios);
            dual_clutch_batch(&model, scenarios, &["eta"], &sets, Keep::Last, 1, &mut ends)
        });
    });
}

criterion_group!(benches, kernels);
criterion_main!(benches);
