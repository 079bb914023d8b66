// SPDX-License-Identifier: MIT
//! The parts of a run that take its time: `cargo bench -p drivetwin-core`.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{motion_outputs, paper_driveline, second_gear};
use criterion::{Criterion, criterion_group, criterion_main};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::network::{ModeKey, Network};
use drivetwin_core::simulate::{
    Differentiation, Keep, ParameterSets, Plan, RunOptions, Scenario, Seed, Unknowns, batch,
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
    let driveline = paper_driveline::<f64>(LossLaw::Paper);
    let network = Network::compile(&driveline).expect("a driveline");
    let [time, torque, off, on] = upshift();
    let signals = [
        ("engine torque", Signal::samples(&time, &torque)),
        ("B2", Signal::samples(&time, &off)),
        ("B3", Signal::samples(&time, &on)),
    ];
    let outputs = motion_outputs();
    let options = RunOptions { settings: Settings::default(), audit: false };
    let plan = Plan::new(&network, &signals, &time, &outputs[4..], options).expect("a plan");
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
        b.iter(|| Plan::new(&network, black_box(&signals), &time, &outputs[4..], options));
    });
    criterion.bench_function("one shift", |b| b.iter(|| plan.run(&network, black_box(&state))));
    criterion.bench_function("one shift, modes known", |b| {
        let mut known = SolverCache::new(&network);
        b.iter(|| plan.run_again(&mut known, black_box(&state)));
    });
    let paths = [
        "i_in.loss.eta",
        "J1.inertia",
        "output shaft.stiffness",
        "start.output shaft",
        "B3.p0",
        "B3.friction.mu_c",
        "B3.friction.mu_s",
        "delay.B3",
    ];
    let seed = |(unknown, path)| Seed { unknown, path, weights: &[1.0] };
    let seeds: Vec<Seed<'_>> = paths.into_iter().enumerate().map(seed).collect();
    let differentiation = Differentiation {
        driveline: &driveline,
        scenario: Scenario { signals: signals.to_vec(), start: begin.clone() },
        grid: &time,
        outputs: &outputs,
        settings: Settings::default(),
        unknowns: Unknowns { count: seeds.len(), seeds: &seeds },
    };
    criterion.bench_function("8 derivatives", |b| b.iter(|| black_box(&differentiation).run()));
    let scenarios = [(plan.clone(), begin.clone())];
    let values: Vec<f64> = (0..64).map(|i| 0.80 + 0.001 * f64::from(i)).collect();
    let sets = ParameterSets { paths: &paths[..1], values: &values };
    criterion.bench_function("64 runs, one thread", |b| {
        let mut ends = vec![0.0; values.len()];
        b.iter(|| batch(&driveline, black_box(&scenarios), sets, Keep::Last, 1, &mut ends));
    });
}

criterion_group!(benches, kernels);
criterion_main!(benches);
