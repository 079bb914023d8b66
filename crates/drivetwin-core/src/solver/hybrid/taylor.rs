// SPDX-License-Identifier: MIT
//! Taylor expansion in time of the whole state in one mode.

use crate::network::linalg::is_zero;
use crate::network::loss_coupling::LossCoupling;
use crate::network::nonlinear_torque::{ChannelSeries, form};
use crate::network::{Branch, Mode, Network, NonlinearTorque, SpeedForm, TableLoss};
use crate::number::{INVERSE, KernelFloat, Number, Series, TERMS, Values, evaluate, slope};
use crate::solver::settings::Accuracy;
use crate::solver::tolerances::{MAX_STICTION_EXPONENT_CHANGE, STICTION_RANGE};

/// Coefficients of states and channels over one step, and the working space to compute them.
#[derive(Clone, Debug)]
pub struct TaylorExpansion<T> {
    /// States (speeds, twists).
    pub states: Vec<Series<T>>,
    /// Channels.
    pub channels: Vec<ChannelSeries<T>>,
    /// Inputs.
    pub inputs: Vec<Series<T>>,
    /// Highest coefficient that is filled in, with zeros for runs whose series ends before.
    pub order: usize,
    /// One coefficient of the whole basis.
    basis: Vec<T>,
    /// 1 over the scale of each state, without derivatives.
    pub(super) scales: Vec<T>,
    /// Coupling of the losses of gears by tables.
    losses: Option<LossCoupling<T>>,
}

impl<T: Number> TaylorExpansion<T> {
    /// Working space for a network.
    pub fn new(network: &Network<T>) -> Self {
        Self {
            states: vec![[T::zero_(); TERMS]; network.states()],
            channels: vec![ChannelSeries::default(); network.channels.len()],
            inputs: vec![[T::zero_(); TERMS]; network.mechanism.inputs.len()],
            order: 0,
            basis: Vec::with_capacity(network.basis()),
            scales: vec![T::zero_(); network.states()],
            losses: None,
        }
    }

    /// The basis (x, u, prescribed accelerations, 1, φ) at `h` [s] after the start.
    pub fn basis_at(&self, network: &Network<T>, h: T, basis: &mut Vec<T>) {
        let of_inputs = self.input_order();
        let value = |series: &Series<T>| evaluate(series, self.order, h);
        basis.clear();
        basis.extend(self.states.iter().map(value));
        basis.extend(self.inputs.iter().map(|input| evaluate(input, of_inputs, h)));
        let rate = |&(_, input): &(SpeedForm<T>, usize)| slope(&self.inputs[input], of_inputs, h);
        basis.extend(network.prescribed.iter().map(rate));
        basis.push(T::of(1.0));
        basis.extend(self.channels.iter().map(|channel| value(&channel.torque)));
    }

    /// Set the state at which the next expansion starts.
    #[inline(always)]
    pub fn set_start(&mut self, x: &[T]) {
        for (series, &value) in self.states.iter_mut().zip(x) {
            series[0] = value;
        }
    }

    /// Expand the runs `runs`, as bits, from the state that was set; returns the step `<= h` [s] over which the truncation
    /// error stays within the tolerance. Inputs must have been set.
    #[inline(always)]
    pub fn expand(
        &mut self,
        network: &Network<T>,
        mode: &Mode<T>,
        branches: &[Branch],
        runs: u32,
        h: T::Values,
        accuracy: Accuracy,
    ) -> T::Values {
        self.set_scales(network);
        self.basis.clear();
        self.basis.resize(network.basis(), T::zero_());
        let curved = self.input_order() > 1;
        let last = accuracy.order.unwrap_or(TERMS - 1);
        let products = network.channels.iter().any(NonlinearTorque::is_product);
        // Successive terms that must be small: every other one of an even or odd motion is zero, and
        // products of motions that start with high powers of time leave longer gaps.
        let window = if products { 4 } else { 2 };
        let hidden = T::DERIVATIVES && hides_stiction(network, branches);
        let mut sizes = [T::Values::of(f64::INFINITY); TERMS];
        let mut power = T::Values::of(1.0);
        let mut growing = runs;
        // Runs whose series ends with each order, as bits.
        let mut ended = [0; TERMS];
        for k in 0..last {
            // Of lines only two coefficients are left to enter, and the zeros after them.
            if k <= 2 || curved {
                self.input_terms(network, k);
            }
            self.channel_terms(network, mode, branches, k);
            power *= h;
            let size = self.next_term(mode, k, hidden);
            sizes[k + 1] = power * if curved { size.larger(self.input_size(k + 1)) } else { size };
            if accuracy.order.is_none() {
                let recent = largest(&sizes[(k + 2).saturating_sub(window)..k + 2]);
                ended[k + 1] = recent.mask_where(|size| size <= accuracy.tolerance) & growing;
                growing &= !ended[k + 1];
            }
            if growing == 0 {
                self.finish(network, mode, branches, k + 1, &ended);
                return self.within_decay(network, branches, h);
            }
        }
        ended[last] |= growing;
        self.finish(network, mode, branches, last, &ended);
        if accuracy.order.is_some() {
            return h;
        }
        let excess = largest(&sizes[TERMS - window..]) / accuracy.tolerance;
        let shorter = |run| (0.8 * excess.run_value(run).powf(-1.0 / last as f64)).min(1.0);
        let h = h.replace_where(growing, h * T::Values::from_lanes(shorter));
        self.within_decay(network, branches, h)
    }

    /// The part of a step `h` [s] over which no stiction grows or decays so far that terms which are small at
    /// the start could become large: those of `exp(-s / v_s)` do so first where `s >> v_s`.
    #[inline(always)]
    fn within_decay(&self, network: &Network<T>, branches: &[Branch], h: T::Values) -> T::Values {
        let mut within = h;
        for ((channel, branch), series) in network.channels.iter().zip(branches).zip(&self.channels)
        {
            let (Branch::Moving { .. }, Some((speed, stiction))) = (branch, channel.stiction())
            else {
                continue;
            };
            let slip = &series.arguments[0];
            let (mut swing, mut power) = (T::Values::zero_(), T::Values::of(1.0));
            for term in &slip[1..=self.order] {
                power *= h;
                swing += term.re().magnitude() * power;
            }
            // Further away stiction is nothing throughout.
            let room = slip[0].re().magnitude() - speed.re() * STICTION_RANGE;
            let room = room.larger(speed.re() * MAX_STICTION_EXPONENT_CHANGE);
            let shorter = within.smaller(h * (room / swing.larger(room)));
            let none = stiction.re().mask_where(|v| v == 0.0 && stiction.is_constant());
            within = shorter.replace_where(none, within);
        }
        within
    }

    /// Highest coefficient of the inputs: lines have one, sines all.
    pub fn input_order(&self) -> usize {
        if self.inputs.iter().any(is_curved) { TERMS - 1 } else { 1 }
    }

    /// Coefficients of a linear form over the basis (x, u, 1, φ).
    pub fn form(&self, network: &Network<T>, row: &[T]) -> Series<T> {
        let mut out = self.speed_form(&row[..self.states.len()]);
        let mut add = |c: T, series: &Series<T>| {
            if !is_zero(c) || T::DERIVATIVES {
                out[..=self.order].iter_mut().zip(series).for_each(|(sum, &v)| *sum += c * v);
            }
        };
        row[network.first_input()..].iter().zip(&self.inputs).for_each(|(&c, u)| add(c, u));
        let channels = row[network.first_channel()..].iter().zip(&self.channels);
        channels.for_each(|(&c, channel)| add(c, &channel.torque));
        for (&c, (_, input)) in row[network.first_rate()..].iter().zip(&network.prescribed) {
            for k in 0..=self.order.min(TERMS - 2) {
                out[k] += c * self.inputs[*input][k + 1] * (k + 1) as f64;
            }
        }
        out[0] += row[network.one()];
        out
    }

    /// Coefficients of a linear form over the independent speeds.
    pub fn speed_form(&self, row: &[T]) -> Series<T> {
        let mut out = [T::zero_(); TERMS];
        for (&c, series) in row.iter().zip(&self.states) {
            for k in 0..=self.order {
                out[k] += c * series[k];
            }
        }
        out
    }

    #[inline(always)]
    fn finish(
        &mut self,
        network: &Network<T>,
        mode: &Mode<T>,
        branches: &[Branch],
        order: usize,
        ended: &[u32; TERMS],
    ) {
        if !network.table_losses.is_empty() {
            self.input_terms(network, order);
        }
        self.channel_terms(network, mode, branches, order);
        self.order = order;
        let mut done = 0;
        for k in 1..order {
            done |= ended[k];
            if done != 0 {
                self.end_before(k + 1, done);
            }
        }
    }

    /// Coefficient `k` is none of some runs', as bits.
    fn end_before(&mut self, k: usize, runs: u32) {
        let channels = self.channels.iter_mut();
        let channels = channels.flat_map(|c| c.arguments.iter_mut().chain([&mut c.torque]));
        for series in self.states.iter_mut().chain(channels) {
            series[k] = series[k].replace_where(runs, T::zero_());
        }
    }

    /// Coefficient `k` of the channels from that of the states, both into the basis.
    #[inline(always)]
    fn channel_terms(
        &mut self,
        network: &Network<T>,
        mode: &Mode<T>,
        branches: &[Branch],
        k: usize,
    ) {
        let (states, others) = self.basis.split_at_mut(self.states.len());
        for (to, state) in states.iter_mut().zip(&self.states) {
            *to = state[k];
        }
        let torques = &mut others[network.first_channel() - self.states.len()..];
        let channels = network.channels.iter().zip(branches).zip(&mut self.channels);
        for (((channel, &branch), series), torque) in channels.zip(torques) {
            for (row, argument) in channel.arguments.iter().zip(&mut series.arguments) {
                argument[k] = form(row, states);
            }
            if channel.is_coupled() {
                series.arguments[1][k] = T::zero_();
            }
            channel.term(branch, &self.inputs, series, k);
            *torque = series.torque[k];
        }
        if !network.table_losses.is_empty() {
            self.loss_terms(network, mode, branches, k);
        }
    }

    /// Coefficient `k` of the torques through gears with tables of losses and of their loss torques, of which
    /// the basis and the channels have the part without torque.
    fn loss_terms(&mut self, network: &Network<T>, mode: &Mode<T>, branches: &[Branch], k: usize) {
        if k == 0 {
            let slope = |loss: &TableLoss| {
                let slip = self.channels[loss.channel].arguments[0][0];
                network.channels[loss.channel].loss_slope(branches[loss.channel], slip)
            };
            let slopes = network.table_losses.iter().map(slope).collect();
            self.losses = LossCoupling::new(network, mode, slopes);
        }
        let Some(losses) = &self.losses else {
            // Undetermined: the run ends with status `not finite`.
            self.basis.fill(T::of(f64::NAN));
            return;
        };
        let torques = losses.close(network, mode, &mut self.basis);
        for (loss, torque) in network.table_losses.iter().zip(torques) {
            let channel = &mut self.channels[loss.channel];
            channel.arguments[1][k] = torque;
            channel.torque[k] = self.basis[network.first_channel() + loss.channel];
        }
    }

    /// Coefficient `k` of what the inputs and the constant give to the basis.
    #[inline(always)]
    fn input_terms(&mut self, network: &Network<T>, k: usize) {
        let given = &mut self.basis[network.first_input()..];
        for (to, input) in given.iter_mut().zip(&self.inputs) {
            *to = input[k];
        }
        let given = &mut self.basis[network.first_rate()..];
        for (to, &(_, input)) in given.iter_mut().zip(&network.prescribed) {
            let next = self.inputs[input].get(k + 1).copied().unwrap_or_else(T::zero_);
            *to = next * (k + 1) as f64;
        }
        self.basis[network.one()] = T::of(if k == 0 { 1.0 } else { 0.0 });
    }

    /// Coefficient `k + 1` of the states, by coefficient `k` of the basis. Returns the largest, relative
    /// to the scale of its state, with its derivatives where these are longer series than the values.
    #[inline(always)]
    fn next_term(&mut self, mode: &Mode<T>, k: usize, derivatives: bool) -> T::Values {
        let mut largest = T::Values::zero_();
        for (i, state) in self.states.iter_mut().enumerate() {
            state[k + 1] = mode.rates.times(i, &self.basis) * INVERSE[k + 1];
            let term = &state[k + 1];
            let size = if derivatives { term.size() } else { term.re().magnitude() };
            largest = (size * self.scales[i].re()).larger(largest);
        }
        largest
    }

    /// Largest coefficient `k` of an input that is not linear, relative to its size now: guards depend
    /// on inputs even where the states rest, and derivatives may where the values do.
    fn input_size(&self, k: usize) -> T::Values {
        let curved = self.inputs.iter().filter(|input| is_curved(input));
        let relative = curved.map(|u| u[k].size() / (u[0].size() + u[1].size()));
        relative.fold(T::Values::zero_(), |largest, size| size.larger(largest))
    }

    /// Scales are the states now: speeds of 1 rad/s, twists of 1 mrad, lagging torques of 1 N·m at least.
    pub(super) fn set_scales(&mut self, network: &Network<T>) {
        let twists = network.speeds()..network.first_lag();
        for (i, (scale, state)) in self.scales.iter_mut().zip(&self.states).enumerate() {
            let floor = if twists.contains(&i) { 1e-3 } else { 1.0 };
            let size = state[0].re().magnitude().larger(T::Values::of(floor));
            *scale = T::promote(size.recip());
        }
    }
}

/// Return true if a stiction of zero has a derivative: the values are then without the exponential that the
/// derivatives follow, and do not bound its truncation error.
fn hides_stiction<T: Number>(network: &Network<T>, branches: &[Branch]) -> bool {
    network.channels.iter().zip(branches).any(|(channel, branch)| {
        let zero = |stiction: T| !stiction.is_constant() && stiction.re().decide(|v| v == 0.0);
        matches!(branch, Branch::Moving { .. }) && channel.stiction().is_some_and(|s| zero(s.1))
    })
}

/// Return true if an input is not linear in time.
fn is_curved<T: Number>(input: &Series<T>) -> bool {
    !is_zero(input[2]) || !is_zero(input[3])
}

fn largest<V: Values>(sizes: &[V]) -> V {
    sizes.iter().fold(V::zero_(), |largest, size| size.larger(largest))
}
