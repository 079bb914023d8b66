// SPDX-License-Identifier: MIT
//! Implicit steps for a stiff motion whose fast part has decayed.
//!
//! A Taylor series of such a motion converges within the time constant of the fast part, although this
//! part is zero. Radau IIA collocation (Hairer and Wanner, Solving ODEs II, section IV.5) finds the
//! polynomial that satisfies the equations at the nodes of a step of any length. The polynomial takes the
//! place of the series: guards, outputs and energies are evaluated alike.

use crate::network::Network;
use crate::network::linalg::{Matrix, is_zero, solve};
use crate::network::nonlinear_torque::{ChannelSeries, form};
use crate::number::{Number, Real, Series, TERMS, evaluate, slope};
use crate::solver::hybrid::state::HybridState;
use crate::solver::tolerances::{COLLOCATION_RTOL, MAX_COLLOCATION_GROWTH};

/// Number of stages: the degree of the polynomial.
const STAGES: usize = 6;
/// Nodes on [0, 1].
const NODES: [f64; STAGES] = [
    0.039_809_857_051_468_72,
    0.198_013_417_873_608_2,
    0.437_974_810_247_386_16,
    0.695_464_273_353_636_1,
    0.901_464_914_201_173_6,
    1.0,
];
/// Place between nodes at which the defect is evaluated beside the start.
const CHECK: f64 = 0.57;
/// Error of a step that is not stiff, relative to its length times its largest defect.
const ERROR_CONSTANT: f64 = 0.1;
/// Newton iterations of a step.
const MAX_ITERATIONS: usize = 12;
/// Least reduction of the change by an iteration; after less the Jacobian is evaluated anew.
const SLOW: f64 = 0.05;
/// Operations in the time of a Taylor step of a small network.
const OPERATIONS: f64 = 1e4;
/// Most states: the cost of a step grows with the cube.
const MAX_STATES: usize = 20;

/// Coefficients of the polynomials that are 1 at one node, 0 at the others and 0 at the start; node × power,
/// power 1 first.
const LAGRANGE: [[f64; STAGES]; STAGES] = lagrange();

const fn lagrange() -> [[f64; STAGES]; STAGES] {
    let mut all = [[0.0; STAGES]; STAGES];
    let mut j = 0;
    while j < STAGES {
        all[j][0] = 1.0 / NODES[j];
        let (mut m, mut degree) = (0, 0);
        while m < STAGES {
            if m != j {
                let scale = 1.0 / (NODES[j] - NODES[m]);
                let mut k = degree + 1;
                while k > 0 {
                    all[j][k] = (all[j][k - 1] - NODES[m] * all[j][k]) * scale;
                    k -= 1;
                }
                all[j][0] *= -NODES[m] * scale;
                degree += 1;
            }
            m += 1;
        }
        j += 1;
    }
    all
}

/// Derivative at node `i` of the polynomial of node `j`.
const DERIVATIVE: [[f64; STAGES]; STAGES] = derivative();

const fn derivative() -> [[f64; STAGES]; STAGES] {
    let mut all = [[0.0; STAGES]; STAGES];
    let mut i = 0;
    while i < STAGES {
        let mut j = 0;
        while j < STAGES {
            let mut k = STAGES;
            while k > 0 {
                all[i][j] = all[i][j] * NODES[i] + LAGRANGE[j][k - 1] * k as f64;
                k -= 1;
            }
            j += 1;
        }
        i += 1;
    }
    all
}

/// Result of an implicit step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImplicitStep {
    /// Estimated error relative to the scales of the states; infinite without a solution.
    pub error: f64,
    /// Longest step [s] over which no unstable part of the motion grows much.
    pub stable: f64,
    /// Work, in Taylor steps.
    pub work: f64,
}

impl ImplicitStep {
    /// Factor by which a step may change for an error of `tolerance`.
    pub fn change(self, tolerance: f64) -> f64 {
        let ratio = (tolerance / self.error.max(f64::MIN_POSITIVE)).powf(1.0 / (STAGES + 1) as f64);
        (0.8 * ratio).clamp(0.1, 4.0)
    }
}

/// The equations of a mode at one instant.
struct Instant<T> {
    /// Rates of the states.
    rates: Vec<T>,
    /// Their derivatives by the states.
    jacobian: Matrix<T>,
    /// Torques of the channels.
    torques: Vec<T>,
    /// Largest rate [1/s] at which a torque that drives its own argument lets it grow.
    growth: f64,
}

/// Inverse of the Newton matrix of a step, kept for steps of the same length.
#[derive(Clone, Debug)]
pub(crate) struct NewtonInverse<T> {
    h: f64,
    inverse: Matrix<T>,
}

/// States at the nodes less those at the start, stages × states, and the equations there.
struct Stages<T> {
    offsets: Matrix<T>,
    instants: Vec<Instant<T>>,
}

/// Return true if implicit steps apply to a network.
pub(crate) fn supports_implicit_steps<T: Number>(network: &Network<T>) -> bool {
    network.table_losses.is_empty() && network.states() <= MAX_STATES
}

impl<T: Real> HybridState<'_, T> {
    /// Replace the expansion by the collocation polynomial over `h` [s]. Inputs must have been set.
    pub(crate) fn collocate(
        &mut self,
        h: f64,
        tolerance: f64,
        kept: &mut Option<NewtonInverse<T>>,
    ) -> ImplicitStep {
        let mut step = ImplicitStep { error: f64::INFINITY, stable: f64::INFINITY, work: 0.0 };
        if self.expansion.input_order() > 1 {
            return step;
        }
        self.expansion.set_start(&self.x);
        self.expansion.set_scales(self.network);
        let start = self.instant(0.0, &self.x);
        step.stable = MAX_COLLOCATION_GROWTH / start.growth;
        let enough = (0.01 * tolerance).max(COLLOCATION_RTOL);
        let Some(stages) = self.solve_stages(h, enough, kept, &mut step.work) else {
            *kept = None;
            return step;
        };
        self.write_polynomials(h, &start, &stages);
        let checks = [(0.0, start), (CHECK * h, self.instant_within(CHECK * h))];
        let errors = checks.iter().map(|(offset, instant)| self.defect(h, *offset, instant));
        step.error = errors.fold(0.0, f64::max);
        step
    }

    /// The equations `offset` [s] after the start, in the state of the polynomials.
    fn instant_within(&self, offset: f64) -> Instant<T> {
        let value = |series| evaluate(series, STAGES, T::of(offset));
        let x: Vec<T> = self.expansion.states.iter().map(value).collect();
        self.instant(offset, &x)
    }

    /// The equations `offset` [s] after the start, in state `x`.
    fn instant(&self, offset: f64, x: &[T]) -> Instant<T> {
        let (network, expansion, at) = (self.network, &self.expansion, T::of(offset));
        let held = |input| {
            let mut series = [T::zero_(); TERMS];
            series[0] = evaluate(input, 1, at);
            series
        };
        let inputs: Vec<Series<T>> = expansion.inputs.iter().map(held).collect();
        let mut basis = x.to_vec();
        basis.extend(inputs.iter().map(|input| input[0]));
        let prescribed = network.prescribed.iter();
        basis.extend(prescribed.map(|&(_, input)| slope(&expansion.inputs[input], 1, at)));
        basis.push(T::of(1.0));
        let (n, derivative) = (network.states(), &self.mode.derivative);
        let mut jacobian = Matrix::zeros(n, n);
        for i in 0..n {
            jacobian.row_mut(i).copy_from_slice(&derivative.row(i)[..n]);
        }
        let (mut torques, mut driven) = (Vec::with_capacity(network.channels.len()), Vec::new());
        for (c, channel) in network.channels.iter().enumerate() {
            let (torque, slopes) = self.torque(c, x, &inputs);
            torques.push(torque);
            for (row, slope) in channel.arguments.iter().zip(slopes) {
                for i in 0..n {
                    let effect = derivative[(i, network.first_channel() + c)] * slope;
                    jacobian.subtract_from_row(i, row, -effect);
                }
                if !is_zero(slope) {
                    driven.push((c, row, slope.re()));
                }
            }
        }
        let growth = driven.iter().map(|&(c, row, slope)| self.growth(&jacobian, c, row, slope));
        let growth = growth.fold(0.0, f64::max);
        basis.extend_from_slice(&torques);
        let rates = (0..n).map(|i| self.mode.rates.times(i, &basis)).collect();
        Instant { rates, jacobian, torques, growth }
    }

    /// Rate [1/s] at which the torque of channel `c`, of slope `slope` over an argument, lets it grow; 0 where
    /// the torque brakes the argument or other torques hold it.
    fn growth(&self, jacobian: &Matrix<T>, c: usize, row: &[T], slope: f64) -> f64 {
        let column = self.network.first_channel() + c;
        let effect = |k: usize| self.mode.derivative[(k, column)].re();
        let (mut pushed, mut turned) = (0.0, 0.0);
        for (i, weight) in row.iter().enumerate().take(jacobian.rows) {
            let rate: f64 =
                jacobian.row(i).iter().enumerate().map(|(k, j)| j.re() * effect(k)).sum();
            pushed += weight.re() * effect(i);
            turned += weight.re() * rate;
        }
        if pushed * slope > 0.0 { (turned / pushed).max(0.0) } else { 0.0 }
    }

    /// Torque of channel `c` in state `x` and its slopes over the arguments.
    fn torque(&self, c: usize, x: &[T], inputs: &[Series<T>]) -> (T, [T; 2]) {
        let (channel, branch) = (&self.network.channels[c], self.branches[c]);
        let mut series = ChannelSeries::default();
        for (argument, row) in series.arguments.iter_mut().zip(&channel.arguments) {
            argument[0] = form(row, x);
        }
        channel.term(branch, inputs, &mut series, 0);
        // The first coefficient over time is the slope where the argument rises by one.
        let mut slopes = [T::zero_(); 2];
        for (a, slope) in slopes.iter_mut().enumerate().take(channel.arguments.len()) {
            series.arguments[a][1] = T::of(1.0);
            channel.term(branch, inputs, &mut series, 1);
            *slope = series.torque[1];
            series.arguments[a][1] = T::zero_();
        }
        (series.torque[0], slopes)
    }

    /// Solve the equations at the nodes of a step of `h` [s] by Newton's method with a kept matrix, to changes
    /// of `enough` relative to the scales of the states. Add the work.
    fn solve_stages(
        &self,
        h: f64,
        enough: f64,
        kept: &mut Option<NewtonInverse<T>>,
        work: &mut f64,
    ) -> Option<Stages<T>> {
        let size = STAGES * self.x.len();
        let mut offsets = Matrix::zeros(STAGES, self.x.len());
        // Derivatives need the matrix of the step itself.
        let reusable = |one: &NewtonInverse<T>| {
            !T::DERIVATIVES && one.inverse.rows == size && (one.h - h).abs() <= 1e-6 * h
        };
        *kept = kept.take().filter(reusable);
        let (mut last, mut left) = (f64::INFINITY, 1 + usize::from(T::DERIVATIVES));
        for _ in 0..MAX_ITERATIONS {
            let instants = self.instants_at_nodes(h, &offsets);
            if left == 0 {
                return Some(Stages { offsets, instants });
            }
            *work += (size * size) as f64 / OPERATIONS + 1.0;
            let matrix = match kept {
                Some(matrix) => matrix,
                None => {
                    *work += (size * size * size) as f64 / OPERATIONS;
                    kept.insert(NewtonInverse { h, inverse: invert_newton_matrix(h, &instants)? })
                }
            };
            let change = matrix.inverse.times(&residual(h, &offsets, &instants));
            let largest = self.apply_change(&change, &mut offsets);
            if !largest.is_finite() {
                return None;
            }
            left -= usize::from(largest <= enough);
            if largest > enough && largest > SLOW * last {
                *kept = None;
            }
            last = largest;
        }
        None
    }

    /// The equations at the nodes of a step of `h` [s].
    fn instants_at_nodes(&self, h: f64, offsets: &Matrix<T>) -> Vec<Instant<T>> {
        let instant = |(i, node): (usize, &f64)| {
            let shifted = self.x.iter().zip(offsets.row(i)).map(|(&x, &dx)| x + dx);
            self.instant(node * h, &shifted.collect::<Vec<_>>())
        };
        NODES.iter().enumerate().map(instant).collect()
    }

    /// Change the states at the nodes; return the largest change relative to the scales.
    fn apply_change(&self, change: &Matrix<T>, offsets: &mut Matrix<T>) -> f64 {
        let n = self.x.len();
        let mut largest = 0.0_f64;
        for i in 0..STAGES {
            for k in 0..n {
                let value = change[(i * n + k, 0)];
                offsets[(i, k)] += value;
                let relative = value.re().abs() * self.expansion.scales[k].re();
                largest = if relative.is_nan() { f64::NAN } else { largest.max(relative) };
            }
        }
        largest
    }

    /// Write the polynomials over `h` [s] in place of the series.
    fn write_polynomials(&mut self, h: f64, start: &Instant<T>, stages: &Stages<T>) {
        let expansion = &mut self.expansion;
        expansion.order = STAGES;
        for (i, series) in expansion.states.iter_mut().enumerate() {
            interpolate(series, h, |j| stages.offsets[(j, i)]);
        }
        for (c, channel) in self.network.channels.iter().enumerate() {
            for (a, row) in channel.arguments.iter().enumerate() {
                let mut argument = [T::zero_(); TERMS];
                for (&weight, state) in row.iter().zip(&expansion.states) {
                    for k in 0..=STAGES {
                        argument[k] += weight * state[k];
                    }
                }
                expansion.channels[c].arguments[a] = argument;
            }
            let torque = &mut expansion.channels[c].torque;
            torque[0] = start.torques[c];
            interpolate(torque, h, |j| stages.instants[j].torques[c] - start.torques[c]);
        }
    }

    /// Error of the states that follows from the defect of the polynomials `offset` [s] after the start of a
    /// step of `h` [s], relative to their scales: of a fast part the motion by which it is off its rest.
    fn defect(&self, h: f64, offset: f64, instant: &Instant<T>) -> f64 {
        let (n, length) = (self.x.len(), h * ERROR_CONSTANT);
        let (mut matrix, mut defect) = (Matrix::zeros(n, n), Matrix::zeros(n, 1));
        for i in 0..n {
            matrix.subtract_from_row(i, instant.jacobian.row(i), T::of(length));
            matrix[(i, i)] += T::of(1.0);
            let rate = slope(&self.expansion.states[i], STAGES, T::of(offset));
            defect[(i, 0)] = (rate - instant.rates[i]) * length;
        }
        let Ok(error) = solve(matrix, defect) else { return f64::INFINITY };
        let relative = |i: usize| error[(i, 0)].re().abs() * self.expansion.scales[i].re();
        let largest = (0..n).map(relative).fold(0.0, f64::max);
        if largest.is_finite() { largest } else { f64::INFINITY }
    }
}

/// Residual of the equations over `h` [s] with the states at the nodes.
fn residual<T: Real>(h: f64, offsets: &Matrix<T>, instants: &[Instant<T>]) -> Matrix<T> {
    let n = offsets.cols;
    let mut residual = Matrix::zeros(STAGES * n, 1);
    for (i, instant) in instants.iter().enumerate() {
        for k in 0..n {
            let mut left = instant.rates[k] * h;
            for j in 0..STAGES {
                left -= offsets[(j, k)] * DERIVATIVE[i][j];
            }
            residual[(i * n + k, 0)] = left;
        }
    }
    residual
}

/// Inverse of the derivative of the equations by the states at the nodes; `None` where it is singular.
fn invert_newton_matrix<T: Real>(h: f64, instants: &[Instant<T>]) -> Option<Matrix<T>> {
    let n = instants[0].rates.len();
    let mut matrix = Matrix::zeros(STAGES * n, STAGES * n);
    let mut identity = Matrix::zeros(STAGES * n, STAGES * n);
    for (i, instant) in instants.iter().enumerate() {
        for k in 0..n {
            let row = i * n + k;
            identity[(row, row)] = T::of(1.0);
            for j in 0..STAGES {
                matrix[(row, j * n + k)] = T::of(DERIVATIVE[i][j]);
            }
            for l in 0..n {
                matrix[(row, i * n + l)] -= instant.jacobian[(k, l)] * h;
            }
        }
    }
    solve(matrix, identity).ok()
}

/// Fill in the coefficients of a polynomial from its values at the nodes of a step of `h` [s], less that at
/// the start.
fn interpolate<T: Number>(series: &mut Series<T>, h: f64, value: impl Fn(usize) -> T) {
    let mut power = 1.0;
    for k in 1..=STAGES {
        power *= h;
        let mut sum = T::zero_();
        for (j, polynomial) in LAGRANGE.iter().enumerate() {
            sum += value(j) * polynomial[k - 1];
        }
        series[k] = sum / power;
    }
}
