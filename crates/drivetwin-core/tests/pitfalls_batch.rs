// SPDX-License-Identifier: MIT
//! What goes wrong where many runs are simulated side by side: lanes that are no vectors, single
//! precision, groups of lanes that see each other, events that hold up the neighbours.

mod common;

use common::{compile, inertia, paper_driveline, second_gear, shaft, start, torque, upshift};
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::network::Network;
use drivetwin_core::number::{Lane, Pack};
use drivetwin_core::simulate::{
    Batch, Keep, Outcome, Output, Plan, dual_clutch_batch, dual_clutch_outputs, run,
};
use drivetwin_core::solve::{Settings, Signal, Status, WIDTH};
use proptest::prelude::*;

/// Shaft torque of the paper's shift under several efficiencies, one thread.
fn shifts(eta: &[f64], settings: Settings) -> Batch {
    let model = paper_driveline::<f64>(LossLaw::Paper);
    let network = Network::compile(&model.driveline()).expect("a driveline");
    let columns = upshift(1.0);
    let signals: Vec<(&str, Signal<'_, f64>)> =
        columns.iter().map(|(name, t, v)| (*name, Signal::samples(t, v))).collect();
    let outputs = &dual_clutch_outputs(&model)[4..5];
    let plan = Plan::new(&network, &signals, &columns[0].1, outputs, (settings, false));
    let scenarios = [(plan.expect("a plan"), second_gear())];
    dual_clutch_batch(&model, &scenarios, (&["eta"], eta), (Keep::Columns, 1)).expect("names")
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
        prop_assert_eq!(size_of::<Pack<WIDTH>>(), WIDTH * size_of::<f64>());
        let (x, y) = (Pack::<WIDTH>(a), Pack::<WIDTH>(b));
        let lanes = (x.fma::<true>(y, x) - y).exponential::<true>().grown::<true>(y);
        let lanes = lanes.with(0b0110, x);
        for i in 0..WIDTH {
            let alone = (a[i].fma::<true>(b[i], a[i]) - b[i]).exponential::<true>();
            let alone = alone.grown::<true>(b[i]).with(0b0110 >> i, a[i]);
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
        let run = run(&network, &signals, &begin, &time, &outputs, (settings, false)).unwrap();
        assert_eq!((run.status, run.events.len()), (Status::Completed, 0));
        run.columns[0].clone()
    });
    let errors = columns[0].iter().zip(&columns[1]).map(|(a, b)| (a - b).abs());
    assert!(errors.fold(0.0, f64::max) < 1e-9);
}

/// 8: a second group of lanes changes nothing in the first, nor does a group that is not full.
#[test]
fn groups_of_lanes_do_not_see_each_other() {
    let eta = efficiencies(2 * WIDTH + 3);
    let all = shifts(&eta, Settings::default());
    let points = all.values.len() / eta.len();
    for count in [1, WIDTH - 1, WIDTH, WIDTH + 1] {
        let some = shifts(&eta[..count], Settings::default());
        assert!(some.values == all.values[..count * points], "{count} runs");
        assert_eq!(some.last_lock, all.last_lock[..count]);
    }
}

/// 9: all lanes have their events within the same few samples; each is located by itself.
#[test]
fn events_of_all_lanes_within_few_samples_are_located_one_by_one() {
    let eta = efficiencies(WIDTH);
    let [fast, exact] = [Settings::default(), Settings::exact()].map(|s| shifts(&eta, s));
    assert_eq!(fast.outcomes, vec![Outcome::Ran(Status::Completed); WIDTH]);
    assert_eq!(fast.events, exact.events);
    let spread = fast.last_lock[0] - fast.last_lock[WIDTH - 1];
    assert!(spread.abs() > 1e-5 && spread.abs() < 20e-3, "{spread}");
    for (a, b) in fast.last_lock.iter().zip(&exact.last_lock) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}
