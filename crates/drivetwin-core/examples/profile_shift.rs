// SPDX-License-Identifier: MIT
//! Where the time of one shift goes; run by `cargo run --release --example profile_shift`.
#[path = "../tests/common/mod.rs"]
mod common;
use common::*;
use drivetwin_core::model::mechanism::LossLaw;
use drivetwin_core::network::{ModeKey, Network};
use drivetwin_core::simulate::*;
use drivetwin_core::solve::{Settings, Signal};
use std::time::Instant;
fn time(name: &str, n: usize, mut f: impl FnMut()) {
    let mut best = f64::INFINITY;
    for _ in 0..n {
        let t = Instant::now();
        f();
        best = best.min(t.elapsed().as_secs_f64());
    }
    println!("{name:30} {:10.2} us", best * 1e6);
}
fn main() {
    let m = paper_driveline::<f64>(LossLaw::Paper);
    let s = upshift(1.0);
    let b: Vec<(&str, Signal<'_, f64>)> =
        s.iter().map(|s| (s.0, Signal::samples(&s.1, &s.2))).collect();
    let d = m.driveline();
    let n = Network::compile(&d).unwrap();
    time("compile", 200, || {
        Network::compile(&d).unwrap();
    });
    time("mode", 200, || {
        n.mode(ModeKey::default(), &[0.0, 0.0]).unwrap();
    });
    time("whole shift", 100, || {
        simulate_dual_clutch(&m, &b, &second_gear(), &s[0].1, (Settings::default(), false))
            .unwrap();
    });
    let h = &s[0].1[..3];
    time("2 samples", 200, || {
        simulate_dual_clutch(&m, &b, &second_gear(), h, (Settings::default(), false)).unwrap();
    });
}
