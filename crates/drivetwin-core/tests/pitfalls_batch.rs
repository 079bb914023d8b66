// SPDX-License-Identifier: MIT
//! Known failure modes of simulating many runs side by side: lanes that are not vectors, single precision,
//! groups of lanes that affect each other, events that delay the neighbours.

mod common;

use common::{
    compile, inertia, motion_outputs, paper_driveline, second_gear, shaft, start, torque, upshift,
};
use drivetwin_core::model::Driveline;
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::network::Network;
use drivetwin_core::number::{KernelFloat, SimdVector};
use drivetwin_core::simulate::{
    Batch, Keep, Outcome, Output, ParameterSets, Plan, RunOptions, batch, run,
};
use drivetwin_core::solver::{LANES, Settings, Signal, Status};
use proptest::prelude::*;
use std::ops::Deref;

/// Path of the efficiency.
const ETA: &str = "i_in.loss.eta";

/// A batch with what is kept of it.
struct Kept {
    values: Vec<f64>,
    batch: Batch,
}

impl Deref for Kept {
    type Target = Batch;

    fn deref(&self) -> &Batch {
        &self.batch
    }
}

/// Columns of every run, so many numbers, under several sets of numbers by path, in one scenario, on one thread.
fn columns_of(
    driveline: &Driveline<f64>,
    plan: Plan<f64>,
    paths: &[&str],
    values: &[f64],
    size: usize,
) -> Kept {
    let mut kept = vec![f64::INFINITY; values.len() / paths.len() * size];
    let (scenarios, sets) = ([(plan, second_gear())], ParameterSets { paths, values });
    let batch = batch(driveline, &scenarios, sets, Keep::Columns, 1, &mut kept);
    Kept { values: kept, batch: batch.expect("paths of numbers") }
}

/// Shaft torque of the paper's shift under several sets of numbers by path, one thread.
fn shifts_of(paths: &[&str], sets: &[f64], settings: Settings) -> Kept {
    let driveline = paper_driveline::<f64>(LossLaw::Paper);
    let network = Network::compile(&driveline).expect("a driveline");
    let columns = upshift(1.0);
    let signals: Vec<(&str, Signal<'_, f64>)> =
        columns.iter().map(|(name, t, v)| (*name, Signal::samples(t, v))).collect();
    let outputs = &motion_outputs()[4..];
    let grid = &columns[0].1;
    let plan = Plan::new(&network, &signals, grid, outputs, RunOptions { settings, audit: false })
        .expect("a plan");
    columns_of(&driveline, plan, paths, sets, grid.len())
}

/// Shaft torque of the paper's shift under several efficiencies, one thread.
fn shifts(eta: &[f64], settings: Settings) -> Kept {
    shifts_of(&[ETA], eta, settings)
}

fn efficiencies(count: usize) -> Vec<f64> {
    (0..count).map(|i| 0.84 + 1e-4 * i as f64).collect()
}

proptest! {
    /// 6: the lanes are one vector, 64 bytes of their own, and each is computed as a number alone is.
    #[test]
    fn a_lane_is_the_number_it_would_be_alone(
        a in prop::array::uniform8(-5.0..5.0_f64),
        b in prop::array::uniform8(-5.0..5.0_f64),
    ) {
        prop_assert_eq!(size_of::<SimdVector<LANES>>(), LANES * size_of::<f64>());
        let (x, y) = (SimdVector::<LANES>(a), SimdVector::<LANES>(b));
        let lanes = (x.fma::<true>(y, x) - y).exponential::<true>().times_small_exp::<true>(y);
        let lanes = lanes.replace_where(0b0110, x);
        for i in 0..LANES {
            let alone = (a[i].fma::<true>(b[i], a[i]) - b[i]).exponential::<true>();
            let alone = alone.times_small_exp::<true>(b[i]).replace_where(0b0110 >> i, a[i]);
            prop_assert_eq!(lanes.0[i].to_bits(), alone.to_bits());
        }
    }
}

/// 7: single precision would leave 1e-7 of the speeds per sample and events that are none.
#[test]
fn ten_thousand_samples_keep_double_precision() {
    let time: Vec<f64> = (0..=10_000).map(|i| f64::from(i) * 1e-3).collect();
    let elements = vec![inertia("a", 2.0), inertia("b", 700.0), torque("a", "T")];
    let network = compile([elements, vec![shaft("a", "b", 4e4, 60.0)]].concat());
    let pull: Vec<f64> = time.iter().map(|t| 400.0 * (9.0 * t).sin()).collect();
    let columns = [Settings::default(), Settings::exact()].map(|settings| {
        let signals = [("T", Signal::samples(&time, &pull))];
        let begin = start(&[("a", 100.0), ("b", 100.0)], &[]);
        let outputs = [Output::Speed("a".into())];
        let run =
            run(&network, &signals, &begin, &time, &outputs, RunOptions { settings, audit: false })
                .unwrap();
        assert_eq!((run.status, run.events.len()), (Status::Completed, 0));
        run.columns[0].clone()
    });
    let errors = columns[0].iter().zip(&columns[1]).map(|(a, b)| (a - b).abs());
    assert!(errors.fold(0.0, f64::max) < 1e-9);
}

/// 8: a second group of lanes changes nothing in the first, nor does a group that is not full.
#[test]
fn groups_of_lanes_do_not_see_each_other() {
    let eta = efficiencies(2 * LANES + 3);
    let all = shifts(&eta, Settings::default());
    let points = all.values.len() / eta.len();
    for count in [1, LANES - 1, LANES, LANES + 1] {
        let some = shifts(&eta[..count], Settings::default());
        assert!(some.values == all.values[..count * points], "{count} runs");
        assert_eq!(some.last_lock, all.last_lock[..count]);
    }
}

/// 9: all lanes have their events within the same few samples; each is located by itself.
#[test]
fn events_of_all_lanes_within_few_samples_are_located_one_by_one() {
    let eta = efficiencies(LANES);
    let [fast, exact] = [Settings::default(), Settings::exact()].map(|s| shifts(&eta, s));
    assert_eq!(fast.outcomes, vec![Outcome::Ran(Status::Completed); LANES]);
    assert_eq!(fast.events, exact.events);
    let spread = fast.last_lock[0] - fast.last_lock[LANES - 1];
    assert!(spread.abs() > 1e-5 && spread.abs() < 20e-3, "{spread}");
    for (a, b) in fast.last_lock.iter().zip(&exact.last_lock) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

/// 9: neighbours decide together. A run that decides otherwise, has other events or has an invalid
/// driveline gives the same result as alone, in any lane.
#[test]
fn runs_that_decide_otherwise_are_as_they_would_be_alone() {
    let shaft = ["output shaft.stiffness", "start.output shaft"];
    let clutches = ["B2.gain", "B3.gain", "B3.p0", "B3.friction.mu_s"];
    let paths = [&[ETA], &shaft[..1], &clutches, &shaft[1..]].concat();
    let mut driveline = paper_driveline::<f64>(LossLaw::Paper);
    let twist = second_gear::<f64>().twists[0].1;
    let nominal = paths.iter().map(|path| driveline.number_mut(path).map_or(twist, |n| *n));
    let nominal: Vec<f64> = nominal.collect();
    let mut noise = 1_u64;
    let mut scatter = |by: f64| {
        noise =
            noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        1.0 + by * ((noise >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    };
    let runs = 2 * LANES + 5;
    let mut sets: Vec<Vec<f64>> = (0..runs)
        .map(|run| {
            nominal.iter().map(|v| v * scatter(if run % 3 == 0 { 0.5 } else { 0.05 })).collect()
        })
        .collect();
    // Locks never, is refused, slips from the start.
    (sets[2][3], sets[LANES + 1][1], sets[LANES + 3][2]) = (0.0, -1.0, nominal[2] * 1e-3);
    let of = |order: &[usize]| {
        let flat: Vec<f64> = order.iter().flat_map(|&run| sets[run].iter().copied()).collect();
        shifts_of(&paths, &flat, Settings::default())
    };
    let forward: Vec<usize> = (0..runs).collect();
    let shuffled: Vec<usize> = (0..runs).map(|i| (i * 8 + 3) % runs).collect();
    let (one, other) = (of(&forward), of(&shuffled));
    let points = one.values.len() / runs;
    let lane_mask = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    for (place, &run) in shuffled.iter().enumerate() {
        let alone = of(&[run]);
        for (batch, at) in [(&one, run), (&other, place)] {
            let values = &batch.values[at * points..][..points];
            assert!(lane_mask(values) == lane_mask(&alone.values), "run {run}");
            assert_eq!(batch.outcomes[at], alone.outcomes[0], "run {run}");
            assert_eq!(batch.events[at], alone.events[0], "run {run}");
            assert_eq!(batch.last_lock[at].to_bits(), alone.last_lock[0].to_bits(), "run {run}");
        }
    }
    let refused = |outcome: &&Outcome| matches!(outcome, Outcome::Refused(_));
    assert_eq!(one.outcomes.iter().filter(refused).count(), 1);
    let counts: std::collections::BTreeSet<u32> = one.events.iter().copied().collect();
    assert!(counts.len() > 2, "{counts:?}");
}

/// Pressures that jump at a sample between others change the modes of all runs there, as they do for one alone
/// and without operators.
#[test]
fn jumps_between_samples_are_met_together_and_alone() {
    let driveline = paper_driveline::<f64>(LossLaw::Paper);
    let network = Network::compile(&driveline).expect("a driveline");
    let grid: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 1e-3).collect();
    let time: Vec<f64> = [&grid[..=500], &grid[500..]].concat();
    let step = |before: f64, after: f64| [vec![before; 501], vec![after; 501]].concat();
    let (torque, off, on) = (step(1545.0, 1500.0), step(14e5, 0.0), step(0.0, 9e5));
    let columns = [("engine torque", torque), ("B2", off), ("B3", on)];
    let signals: Vec<(&str, Signal<'_, f64>)> =
        columns.iter().map(|(name, values)| (*name, Signal::samples(&time, values))).collect();
    let outputs = &motion_outputs()[4..];
    let run = |settings, eta: &[f64]| {
        let plan =
            Plan::new(&network, &signals, &grid, outputs, RunOptions { settings, audit: false })
                .expect("a plan");
        columns_of(&driveline, plan, &[ETA], eta, grid.len())
    };
    let eta = efficiencies(LANES);
    let (fast, exact) = (run(Settings::default(), &eta), run(Settings::exact(), &eta));
    assert_eq!(fast.events, exact.events);
    assert!(exact.events.iter().all(|&events| events >= 3), "{:?}", exact.events);
    let errors = fast.values.iter().zip(&exact.values).map(|(a, b)| (a - b).abs());
    let worst = errors.fold(0.0, f64::max);
    assert!(worst < 0.02, "{worst} N m");
    let alone = run(Settings::default(), &eta[3..4]);
    let (together, alone) = (&fast.values[3 * grid.len()..][..grid.len()], &alone.values);
    let apart = together.iter().zip(alone).position(|(a, b)| a != b);
    assert_eq!(apart, None, "{:?}", apart.map(|k| (together[k], alone[k])));
}

/// A grid of fewer points than there are samples gets the values at its points, also where samples that are
/// none begin a block: here from sample 61 on, after the on-coming clutch has been filled.
#[test]
fn a_coarse_grid_is_met_at_its_points() {
    let driveline = paper_driveline::<f64>(LossLaw::Paper);
    let network = Network::compile(&driveline).expect("a driveline");
    let mut columns = upshift(1.0);
    for (t, pressure) in columns[0].1.clone().iter().zip(&mut columns[2].2) {
        *pressure = 0.8e5 / 0.0605 * t.min(0.2);
    }
    let signals: Vec<(&str, Signal<'_, f64>)> =
        columns.iter().map(|(name, t, v)| (*name, Signal::samples(t, v))).collect();
    let outputs = &motion_outputs()[3..];
    let run = |every: usize| {
        let grid: Vec<f64> = columns[0].1.iter().copied().step_by(every).collect();
        let plan = Plan::new(
            &network,
            &signals,
            &grid,
            outputs,
            RunOptions { settings: Settings::default(), audit: false },
        );
        let (plan, size) = (plan.expect("a plan"), outputs.len() * grid.len());
        let batch = columns_of(&driveline, plan, &[ETA], &efficiencies(LANES), size);
        (batch.values, grid.len())
    };
    let (fine, points) = run(1);
    for every in [2, 3, 50, 300] {
        let (coarse, _) = run(every);
        let expected = fine.chunks_exact(points).flat_map(|column| column.iter().step_by(every));
        assert!(coarse.iter().eq(expected), "every {every}");
    }
}
