// SPDX-License-Identifier: MIT
//! Guards of fixed steps: torques within their limits, speeds above zero, normal loads above zero.

use crate::network::smooth_law::{AffineForm, Sample};
use crate::number::{Coefficient, KernelFloat, Values};
use crate::solver::exponential::propagator::{Bound, MAX_GUARDS, Propagator, SampleGuard};
use crate::solver::exponential::samples::{ChannelState, InputSource, SampleBuffer, SampleColumn};
use crate::solver::inputs::SampleRange;

/// Of the watched forms at the start of a sample, what torques are off their limits by or what speeds are,
/// and what the forms are.
pub type Guards<V> = [[V; 2]; MAX_GUARDS];

/// Guards that never cross.
pub fn inactive_guards<V: Values>() -> Guards<V> {
    [[V::splat(1.0), V::splat(0.0)]; MAX_GUARDS]
}

/// State, carried channels and guards at the start of a sample.
pub struct StepState<L: KernelFloat, const N: usize, const A: usize> {
    /// State.
    pub x: [L; N],
    /// Carried channels.
    pub carry: [ChannelState<L>; A],
    /// Guards.
    pub guards: Guards<L::Values>,
}

impl<L: KernelFloat, const N: usize, const A: usize> StepState<L, N, A> {
    /// State zero without torques, whose guards never cross.
    #[inline(always)]
    pub fn idle() -> Self {
        Self { x: [L::splat(0.0); N], carry: [ChannelState::idle(); A], guards: inactive_guards() }
    }
}

impl<L: KernelFloat, const N: usize> Propagator<L, N> {
    /// Return true if every normal load stays above zero over samples, in all lanes.
    #[inline(always)]
    pub fn stays_loaded<S: InputSource<L>, const F: bool>(
        &self,
        source: &S,
        samples: SampleRange,
    ) -> bool {
        // A loop: the body of `all` would be compiled apart, for the least of all processors.
        let mut loaded = true;
        for load in &self.loads {
            loaded &= load.stays_positive::<F>(source.bounds(load.input, samples));
        }
        loaded
    }

    /// Negative where a watched form may leave its limits within the sample that ends with these inputs,
    /// states and channels, or a normal load falls there where `loads` are looked at; `guards` are moved on.
    ///
    /// Apart from what falls in the step: sums over a loop that start from nothing stay in vectors.
    #[inline(always)]
    pub fn crossed<V: Coefficient<L::Values>, const F: bool, const A: usize>(
        &self,
        guards: &mut Guards<L::Values>,
        input: impl Fn(usize) -> V,
        loads: bool,
        x: &[L; N],
        carry: &[ChannelState<L>; A],
    ) -> L::Values {
        let mut left = [L::Values::splat(0.0)];
        for (place, before) in guards.iter_mut().enumerate().take(self.guards.len()) {
            let after = self.guard::<V, F, A>(place, &input, x, carry);
            self.may_cross::<F, _>(place, before, &after.map(|value| [value]), &mut left);
            *before = after;
        }
        if loads {
            for load in &self.loads {
                load.may_cross::<_, F, 1>(&[input(load.input)], &mut left);
            }
        }
        left[0]
    }

    /// Evaluate [`Self::crossed`] for `some` samples together, from the trail and the inputs at the sample
    /// ends.
    #[inline(always)]
    pub fn crossed_in_block<
        V: Coefficient<L::Values>,
        const F: bool,
        const A: usize,
        const W: usize,
    >(
        &self,
        guards: &mut Guards<L::Values>,
        ends: impl Fn(usize) -> [V; W],
        loads: bool,
        trail: &SampleBuffer<L, N>,
        from: usize,
        some: usize,
    ) -> [L::Values; W] {
        let mut left = [L::Values::splat(0.0); W];
        for (place, before) in guards.iter_mut().enumerate().take(self.guards.len()) {
            let after = self.guards_after::<_, F, A, W>(place, &ends, trail, from);
            self.may_cross::<F, _>(place, before, &after, &mut left);
            *before = after.map(|values| values[some - 1]);
        }
        if loads {
            for load in &self.loads {
                load.may_cross::<_, F, W>(&ends(load.input), &mut left);
            }
        }
        left
    }

    /// All guards at the start of a segment.
    #[inline(always)]
    pub fn guards<
        U: Coefficient<L, Values: Coefficient<L::Values>>,
        const F: bool,
        const A: usize,
    >(
        &self,
        sample: &Sample<U>,
        x: &[L; N],
        carry: &[ChannelState<L>; A],
    ) -> Guards<L::Values> {
        let mut guards = inactive_guards();
        for (place, guard) in guards.iter_mut().enumerate().take(self.guards.len()) {
            *guard = self.guard::<_, F, A>(place, |input| sample[input][0].values(), x, carry);
        }
        guards
    }

    /// Margin or speed, and value, of a watched form at one instant, by the values of inputs there.
    #[inline(always)]
    fn guard<V: Coefficient<L::Values>, const F: bool, const A: usize>(
        &self,
        place: usize,
        input: impl Fn(usize) -> V,
        x: &[L; N],
        carry: &[ChannelState<L>; A],
    ) -> [L::Values; 2] {
        let SampleGuard { form, bound } = &self.guards[place];
        let mut value = form.constant.values();
        for drive in &self.inputs {
            value = input(drive.input).multiply_add::<F>(drive.guards[place].values(), value);
        }
        for i in 0..self.columns() {
            value = form.state[i].values().fma::<F>(x[i].values(), value);
        }
        for a in 0..A {
            let carried = self.channels[a].torque(&carry[a]).values();
            value = form.channels[a].values().fma::<F>(carried, value);
        }
        match bound {
            Bound::Within { limit, side } => {
                let AffineForm { input: of, gain, offset } = limit;
                let limit = input(*of).multiply_add::<F>(gain.values(), offset.values());
                [margin::<L, F>(*side, limit, value), value]
            }
            Bound::Above(row) => {
                let mut speed = L::Values::splat(0.0);
                for i in 0..self.columns() {
                    speed = row[i].values().fma::<F>(x[i].values(), speed);
                }
                [speed, value]
            }
            Bound::Rising { limit, side, third, inputs } => {
                let AffineForm { input: of, gain, offset } = limit;
                let limit = input(*of).multiply_add::<F>(gain.values(), offset.values());
                let mut rise = third.constant.values();
                for (drive, c) in self.inputs.iter().zip(inputs) {
                    rise = input(drive.input).multiply_add::<F>(c.values(), rise);
                }
                for i in 0..self.columns() {
                    rise = third.state[i].values().fma::<F>(x[i].values(), rise);
                }
                [side.values().fma::<F>(value, limit), rise]
            }
        }
    }

    /// Margins or speeds, and values, of a guard at the ends of `W` samples from `from` on.
    #[inline(always)]
    fn guards_after<V: Coefficient<L::Values>, const F: bool, const A: usize, const W: usize>(
        &self,
        place: usize,
        ends: &impl Fn(usize) -> [V; W],
        trail: &SampleBuffer<L, N>,
        from: usize,
    ) -> [[L::Values; W]; 2] {
        let SampleGuard { form, bound } = &self.guards[place];
        let mut values = [form.constant.values(); W];
        for drive in &self.inputs {
            add::<L, V, F, W>(&mut values, drive.guards[place], &ends(drive.input));
        }
        self.add_states::<F, W>(&mut values, &form.state, trail, from);
        for a in 0..A {
            let column: &[L; W] = after(trail.torques(a), from);
            for k in 0..W {
                values[k] = form.channels[a].values().fma::<F>(column[k].values(), values[k]);
            }
        }
        match bound {
            Bound::Within { limit, side } => {
                let mut margins = [limit.offset.values(); W];
                add::<L, V, F, W>(&mut margins, limit.gain, &ends(limit.input));
                for k in 0..W {
                    margins[k] = margin::<L, F>(*side, margins[k], values[k]);
                }
                [margins, values]
            }
            Bound::Above(row) => {
                let mut speeds = [L::Values::splat(0.0); W];
                self.add_states::<F, W>(&mut speeds, row, trail, from);
                [speeds, values]
            }
            Bound::Rising { limit, side, third, inputs } => {
                let mut margins = [limit.offset.values(); W];
                add::<L, V, F, W>(&mut margins, limit.gain, &ends(limit.input));
                for k in 0..W {
                    margins[k] = side.values().fma::<F>(values[k], margins[k]);
                }
                let mut rises = [third.constant.values(); W];
                for (drive, c) in self.inputs.iter().zip(inputs) {
                    add::<L, V, F, W>(&mut rises, *c, &ends(drive.input));
                }
                self.add_states::<F, W>(&mut rises, &third.state, trail, from);
                [margins, rises]
            }
        }
    }

    /// Add a form over the states at the end of samples.
    #[inline(always)]
    fn add_states<const F: bool, const W: usize>(
        &self,
        sums: &mut [L::Values; W],
        row: &[L; N],
        trail: &SampleBuffer<L, N>,
        from: usize,
    ) {
        for i in 0..self.columns() {
            let column: &[L; W] = after(trail.states(i), from);
            for k in 0..W {
                sums[k] = row[i].values().fma::<F>(column[k].values(), sums[k]);
            }
        }
    }

    /// Make negative where a watched form may leave its limits within a sample, by these before and after
    /// each.
    ///
    /// A torque that swings within limits in both signs is no smaller than its swing where it comes near
    /// one; one that is bounded in one sign only (a freewheel's, power through a gear) is taken to be like
    /// that, which it need not be: its release at the crest of a swing within one sample can be passed by.
    /// The magnitude of a speed near zero is not a usable scale. Its bound, to fourth order, is the
    /// smallest Bernstein coefficient of the cubic through its values and rates. Torques of a stiff motion are
    /// bounded likewise: a fast motion that has not decayed shows in the rates. What inputs and limits add
    /// to a torque at once has no rate here; it rises by a third of its rise until the inner coefficients.
    #[inline(always)]
    fn may_cross<const F: bool, const W: usize>(
        &self,
        place: usize,
        before: &[L::Values; 2],
        after: &[[L::Values; W]; 2],
        fallen: &mut [L::Values; W],
    ) {
        // One loop for each kind of bound: a choice within the loop is not hoisted out of it.
        match self.guards[place].bound {
            Bound::Within { .. } => {
                let [rise, size] = self.chord_deviation.map(|share| share.values());
                lower::<L, W>(before, after, fallen, |[margin, value], to| {
                    let largest = value.magnitude().larger(to[1].magnitude());
                    let rise_of_value = (to[1] - value).magnitude();
                    margin.smaller(to[0]) - rise.fma::<F>(rise_of_value, size * largest)
                });
            }
            Bound::Above(_) => lower::<L, W>(before, after, fallen, lowest_corner::<L>),
            Bound::Rising { .. } => lower::<L, W>(before, after, fallen, |from, to| {
                lowest_corner::<L>(from, to) - (to[0] - from[0]).magnitude().times(1.0 / 3.0)
            }),
        }
    }
}

/// Make negative where `left` is, of margins and values before and after each sample.
#[inline(always)]
fn lower<L: KernelFloat, const W: usize>(
    before: &[L::Values; 2],
    after: &[[L::Values; W]; 2],
    fallen: &mut [L::Values; W],
    left: impl Fn([L::Values; 2], [L::Values; 2]) -> L::Values,
) {
    let mut from = *before;
    for k in 0..W {
        let to = [after[0][k], after[1][k]];
        fallen[k] = fallen[k].either_negative(left(from, to));
        from = to;
    }
}

/// Smallest Bernstein coefficient of a cubic, by its values and thirds of its rates at both ends.
#[inline(always)]
fn lowest_corner<L: KernelFloat>(from: [L::Values; 2], to: [L::Values; 2]) -> L::Values {
    let inner = (from[0] + from[1]).smaller(to[0] - to[1]);
    inner.smaller(from[0]).smaller(to[0])
}

/// The samples after those from `from` on.
#[inline(always)]
fn after<L, const W: usize>(column: &SampleColumn<L>, from: usize) -> &[L; W] {
    column[from + 1..].first_chunk().expect("stretches that divide a block")
}

/// Add multiples of inputs.
#[inline(always)]
fn add<L: KernelFloat, V: Coefficient<L::Values>, const F: bool, const W: usize>(
    sums: &mut [L::Values; W],
    factor: L,
    inputs: &[V; W],
) {
    for k in 0..W {
        sums[k] = inputs[k].multiply_add::<F>(factor.values(), sums[k]);
    }
}

/// Distance of a torque to its limit, see [`Bound::Within`].
#[inline(always)]
fn margin<L: KernelFloat, const F: bool>(
    side: L,
    limit: L::Values,
    torque: L::Values,
) -> L::Values {
    (limit + torque).smaller(side.values().fma::<F>(-torque, limit))
}

impl<L: KernelFloat> AffineForm<L> {
    /// Return true if the line stays above zero in all lanes while its input stays within bounds.
    #[inline(always)]
    fn stays_positive<const F: bool>(&self, [low, high]: [L::Values; 2]) -> bool {
        let (gain, offset) = (self.gain.values(), self.offset.values());
        // Above zero where its negative is below.
        let below = |u| (-gain.fma::<F>(u, offset)).negative_mask();
        below(low) & below(high) == L::Values::splat(-1.0).negative_mask()
    }

    /// Make negative where the line falls below zero at the end of a sample.
    #[inline(always)]
    fn may_cross<V: Coefficient<L::Values>, const F: bool, const W: usize>(
        &self,
        ends: &[V; W],
        fallen: &mut [L::Values; W],
    ) {
        for k in 0..W {
            let load = ends[k].multiply_add::<F>(self.gain.values(), self.offset.values());
            fallen[k] = fallen[k].either_negative(load);
        }
    }
}
