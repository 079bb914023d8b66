// SPDX-License-Identifier: MIT
//! The dual-clutch shift: power balance, loss laws, order of the integrator, derivatives.

mod common;

use common::{motion_outputs, paper_driveline, second_gear, upshift};
use drivetwin_core::model::Driveline;
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::network::Network;
use drivetwin_core::number::Dual;
use drivetwin_core::number::Real;
use drivetwin_core::simulate::{RunOptions, Trajectory, run};
use drivetwin_core::solver::{EventKind, Settings, Signal, Status};

const SHAFT_TORQUE: usize = 4;

fn shift<T: Real>(model: &Driveline<T>, weak: f64, settings: Settings) -> Trajectory<T> {
    shift_by(model, weak, RunOptions { settings, audit: true })
}

fn shift_by<T: Real>(model: &Driveline<T>, weak: f64, options: RunOptions) -> Trajectory<T> {
    let signals = upshift(weak);
    let borrowed: Vec<(&str, Signal<'_, T>)> =
        signals.iter().map(|s| (s.0, Signal::samples(&s.1, &s.2))).collect();
    let network = Network::compile(model).unwrap();
    let (grid, outputs) = (&signals[0].1, motion_outputs());
    run(&network, &borrowed, &second_gear(), grid, &outputs, options).unwrap()
}

#[test]
fn power_balance_closes_over_a_shift() {
    for law in [LossLaw::Paper, LossLaw::Dissipative] {
        let run = shift(&paper_driveline::<f64>(law), 1.0, Settings::default());
        assert_eq!(run.status, Status::Completed);
        let audit = run.audit.unwrap();
        assert!(audit.error.abs() < 1e-9 * audit.source, "{audit:?}");
        assert!(audit.friction > 0.0 && audit.shaft > 0.0 && audit.load > 0.0);
    }
}

#[test]
fn dissipative_gears_never_create_energy_and_paper_gears_say_how_much() {
    let run = |law| shift(&paper_driveline::<f64>(law), 1.0, Settings::default()).audit.unwrap();
    let paper = run(LossLaw::Paper);
    assert!(paper.created > 100.0, "the lock-up oscillation reverses the torque: {paper:?}");
    assert_eq!(run(LossLaw::Dissipative).created, 0.0);
}

#[test]
fn events_of_an_upshift_come_in_order() {
    let run = shift(&paper_driveline::<f64>(LossLaw::Paper), 1.0, Settings::default());
    let kinds: Vec<EventKind> = run.events.iter().map(|e| e.kind).collect();
    assert_eq!(
        kinds,
        [EventKind::ClutchFilled, EventKind::BreakAway, EventKind::ClutchVented, EventKind::Lock],
        "{:?}",
        run.events
    );
    assert!(run.events.windows(2).all(|w| w[0].time < w[1].time));
}

/// Error in shaft torque of a fixed order and step against round-off accuracy.
fn error(order: usize, max_step: f64, exact: &Trajectory<f64>) -> f64 {
    let settings = Settings { order: Some(order), max_step, ..Settings::exact() };
    let run = shift(&paper_driveline::<f64>(LossLaw::Paper), 1.0, settings);
    let pairs = run.columns[SHAFT_TORQUE].iter().zip(&exact.columns[SHAFT_TORQUE]);
    pairs.map(|(a, b): (&f64, &f64)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn halving_the_step_divides_the_error_by_two_to_the_order() {
    let exact = shift(&paper_driveline::<f64>(LossLaw::Paper), 1.0, Settings::exact());
    for order in [2, 3, 4] {
        let (coarse, fine) = (error(order, 1e-3, &exact), error(order, 0.5e-3, &exact));
        let observed = (coarse / fine).log2();
        assert!(
            (observed - order as f64).abs() < 0.35,
            "order {order}: {coarse:.3e} -> {fine:.3e}, observed {observed:.2}"
        );
    }
}

/// Paths of numbers and their sizes.
const PARAMETERS: [(&str, f64); 5] = [
    ("i_in.loss.eta", 0.85),
    ("J1.inertia", 20.3),
    ("output shaft.stiffness", 1.76e5),
    ("i_f.ratio", 5.38),
    ("B3.p0", 8e4),
];

/// The driveline of the paper with one number changed.
fn changed<T: Real>(path: &str, by: T) -> Driveline<T> {
    let mut model = paper_driveline::<T>(LossLaw::Paper);
    *model.number_mut(path).expect("a number") += by;
    model
}

#[test]
fn dual_numbers_carry_exact_derivatives_through_lock_and_break_away() {
    for (name, scale) in PARAMETERS {
        let seeded = changed(name, Dual::<1>::new(0.0, [scale]));
        let exact = shift(&seeded, 1.0, Settings::default());
        let at = |step: f64| shift(&changed(name, step * scale), 1.0, Settings::default());
        let h = 1e-5;
        let (up, down) = (at(h), at(-h));
        let last = up.time.len() - 1;
        for column in [0, 1, 2] {
            let derivative = exact.derivatives[column][last][0];
            let difference = (up.columns[column][last] - down.columns[column][last]) / (2.0 * h);
            let size = difference.abs().max(1e-3);
            assert!(
                (derivative - difference).abs() < 2e-5 * size,
                "{name}, column {column}: {derivative} against {difference}"
            );
        }
        for (i, event) in exact.events.iter().enumerate() {
            let difference = (up.events[i].time - down.events[i].time) / (2.0 * h);
            assert!(
                (event.time.eps[0] - difference).abs() < 2e-5 * difference.abs().max(1e-2),
                "{name}, event {i}: {} against {difference}",
                event.time.eps[0]
            );
        }
        assert!(exact.events[3].time.re > 0.5);
    }
}

#[test]
fn passing_whole_samples_stays_close_to_the_exact_motion() {
    let model = paper_driveline::<f64>(LossLaw::Paper);
    let exact = unaudited(&model, Settings::exact());
    let quick = unaudited(&model, Settings::default());
    assert_eq!(quick.status, Status::Completed);
    for (column, allowed) in [(0, 1e-5), (1, 1e-5), (2, 1e-5), (SHAFT_TORQUE, 0.02)] {
        let pairs = quick.columns[column].iter().zip(&exact.columns[column]);
        let worst = pairs.map(|(a, b): (&f64, &f64)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < allowed, "column {column}: {worst:.2e}");
    }
    assert_eq!(quick.events.len(), exact.events.len());
    for (a, b) in quick.events.iter().zip(&exact.events) {
        assert!((a.time - b.time).abs() < 1e-7, "{a:?} against {b:?}");
    }
}

fn unaudited(model: &Driveline<f64>, settings: Settings) -> Trajectory<f64> {
    shift_by(model, 1.0, RunOptions { settings, audit: false })
}
