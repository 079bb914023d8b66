// SPDX-License-Identifier: MIT
//! Inputs over time, linear between samples.

use crate::number::{Real, Series};
use crate::solver::input_error::{InputError, check_times, check_values};
use crate::solver::sine::{Sine, Wave, fill_sine, sine_series, wave};

mod rewrite;
mod signal;

pub use signal::Signal;

/// Inputs on a common set of knots; a knot that stands twice is a jump.
#[derive(Clone, Debug)]
pub struct Inputs<T> {
    knots: Vec<f64>,
    /// Value at the start of a segment and rate within it, of sines at its start, segments × inputs. At least one
    /// of each segment, which constant loads refer to where there are no inputs.
    lines: Vec<[f64; 2]>,
    /// Derivatives of the delays: numbers of value zero.
    shifts: Vec<T>,
    /// Derivatives of the values by offsets: numbers of value zero; empty where none are asked for.
    lifts: Vec<T>,
    sines: Vec<Option<Sine<T>>>,
    /// The sines without derivatives; empty where there are none.
    waves: Vec<Option<Wave>>,
    /// Number of segments of equal length from each segment on.
    equal: Vec<u32>,
    /// See [`usual_lengths`].
    usual: Vec<f64>,
    /// Least and largest value within every [`STRETCH`] segments, stretches × inputs.
    extremes: Vec<[f64; 2]>,
}

/// Consecutive samples: the segments of the inputs that they cover.
#[derive(Clone, Copy, Debug)]
pub struct SampleRange {
    /// Segment of the first.
    pub first: usize,
    /// Number of samples.
    pub count: usize,
}

/// Fewest segments of equal length that make operators worth while.
const WORTH_WHILE: usize = 8;

/// Number of segments that share one pair of extremes.
const STRETCH: usize = 64;

/// Point number of a knot outside the grid.
pub const NO_POINT: usize = usize::MAX;

impl<T: Real> Inputs<T> {
    /// Join named signals, in the order the network numbers its inputs, over the span
    /// `(start, end)` [s]; the increasing points of a grid within it become knots too.
    pub fn join(
        signals: &[(&str, Signal<'_, T>)],
        span: (f64, f64),
        grid: &[f64],
    ) -> Result<Self, InputError> {
        let (start, end) = span;
        let (mut jumps, mut sines, mut shifts) = (Vec::new(), Vec::new(), Vec::new());
        let mut checked: Option<(&[f64], f64)> = None;
        for &(name, signal) in signals {
            match signal {
                Signal::Samples { times, values, delay } => {
                    shifts.push(delay - delay.re());
                    sines.push(None);
                    let raster = (times, delay.re());
                    check_values(name, times, values)?;
                    // Most signals stand on one raster.
                    if !is_raster(checked, raster.0, raster.1) {
                        check_times(name, times, start - raster.1, end - raster.1)?;
                        let twice = times.windows(2).filter(|w| w[0] == w[1]);
                        jumps.extend(twice.map(|w| w[0] + raster.1));
                        checked = Some(raster);
                    }
                }
                Signal::Sine { offset, amplitude, frequency, phase } => {
                    let whole = [offset.re(), amplitude.re(), frequency, phase];
                    if !whole.iter().all(|v| v.is_finite()) {
                        return Err(InputError::Sine { name: name.to_owned() });
                    }
                    let omega = 2.0 * std::f64::consts::PI * frequency;
                    sines.push(Some((offset, amplitude, omega, phase)));
                    shifts.push(T::zero_());
                }
            }
        }
        let inner = inner_times(signals, grid, start, end);
        let knots = merge_knots(&inner, &jumps, start, end);
        let width = signals.len().max(1);
        let mut lines = vec![[0.0; 2]; (knots.len() - 1) * width];
        for (input, (_, signal)) in signals.iter().enumerate() {
            let to = lines[input..].iter_mut().step_by(width);
            let Signal::Samples { times, values, delay } = *signal else {
                if let Some(sine) = &sines[input] {
                    fill_sine(to, &knots, sine);
                }
                continue;
            };
            fill(to, &knots, jumps.is_empty(), times, values, delay.re());
        }
        Ok(Self::of_lines(knots, lines, shifts, sines))
    }

    fn of_lines(
        knots: Vec<f64>,
        lines: Vec<[f64; 2]>,
        shifts: Vec<T>,
        sines: Vec<Option<Sine<T>>>,
    ) -> Self {
        let equal = equal_lengths(&knots);
        let usual = usual_lengths(&knots, &equal);
        let waves = if sines.iter().any(Option::is_some) {
            sines.iter().map(|sine| sine.as_ref().map(wave)).collect()
        } else {
            Vec::new()
        };
        let extremes = extremes(&knots, &lines, shifts.len().max(1));
        let lifts = Vec::new();
        Self { knots, lines, shifts, lifts, sines, waves, equal, usual, extremes }
    }

    /// Add numbers of value zero, one per input, to the expansions.
    pub fn lift(self, lifts: Vec<T>) -> Self {
        Self { lifts, ..self }
    }

    /// Divide segments: one of length l [s] becomes `parts(l)`.
    pub fn divided(self, parts: impl Fn(f64) -> usize) -> Self {
        let parts: Vec<usize> =
            self.knots.windows(2).map(|span| parts(span[1] - span[0])).collect();
        let count: usize = parts.iter().sum();
        if count == parts.len() || !self.is_sampled() {
            return self;
        }
        let mut knots = Vec::with_capacity(count + 1);
        let mut lines = Vec::with_capacity(count * self.width());
        for (i, &parts) in parts.iter().enumerate() {
            let (from, to) = self.span(i);
            for part in 0..parts {
                let elapsed = (to - from) * part as f64 / parts as f64;
                knots.push(from + elapsed);
                lines.extend(self.lines(i).iter().map(|[u, rate]| [u + rate * elapsed, *rate]));
            }
        }
        knots.push(self.knots[self.segments()]);
        Self::of_lines(knots, lines, self.shifts, self.sines)
    }

    /// Number of segments from `i` on, itself included, that are as long as it.
    pub fn equal_from(&self, i: usize) -> usize {
        self.equal[i] as usize
    }

    /// Length of segment `i` [s], the same for all as long as it, where that is no more than `most` and
    /// segments of it are so frequent that operators pay.
    pub fn usual_length(&self, i: usize, most: f64) -> Option<f64> {
        let h = self.usual[i];
        (self.has_samples() && h > 0.0 && h <= most).then_some(h)
    }

    /// Number of segments between knots.
    pub fn segments(&self) -> usize {
        self.knots.len() - 1
    }

    /// Start and end of segment `i` [s].
    pub fn span(&self, i: usize) -> (f64, f64) {
        (self.knots[i], self.knots[i + 1])
    }

    /// Times of all knots, s.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Start of segment `i`, or the end of the last where `i` is their number [s].
    pub fn knot(&self, i: usize) -> f64 {
        self.knots[i]
    }

    /// The segment after `i` where that ends within round-off of time `t` [s]: what happens there is decided by
    /// what holds from there on.
    pub fn just_before(&self, i: usize, t: f64) -> Option<usize> {
        let (end, next) = (self.span(i).1, i + 1);
        let near = end - t <= 1e-12 * (1.0 + end.abs());
        (near && next < self.segments() && self.span(next).1 > end).then_some(next)
    }

    /// Value of an input at a knot.
    #[inline(always)]
    pub fn knot_value(&self, i: usize, input: usize) -> T {
        if i < self.segments() {
            return self.line(i, input)[0];
        }
        if let Some(sine) = &self.sines[input] {
            return sine_series(sine, T::of(self.knot(i)))[0];
        }
        let [start, rate] = self.line(i - 1, input);
        start + rate * (self.knot(i) - self.knot(i - 1))
    }

    /// Value of an input at the start.
    pub fn start_value(&self, input: usize) -> T {
        match &self.sines[input] {
            Some(sine) => sine_series(sine, T::of(self.knot(0)))[0],
            None => self.line(0, input)[0],
        }
    }

    /// Return true if all inputs are linear within every segment.
    pub fn is_sampled(&self) -> bool {
        self.sines.iter().all(Option::is_none)
    }

    /// Return true if values and rates at the knots describe all inputs: sines too, but for their
    /// derivatives.
    pub fn has_samples(&self) -> bool {
        self.is_sampled() || !T::DERIVATIVES
    }

    /// The inputs that are sines; empty where there are none.
    pub fn waves(&self) -> &[Option<Wave>] {
        &self.waves
    }

    /// For every knot the number of its point of an increasing grid [s], or [`NO_POINT`]; of a jump the knot
    /// behind it counts. Nothing where a point has no knot.
    pub fn points(&self, grid: &[f64]) -> Option<Vec<usize>> {
        let mut points = vec![NO_POINT; self.knots.len()];
        let mut found = 0;
        for (i, knot) in self.knots.iter().enumerate() {
            if grid.get(found) == Some(knot) && self.knots.get(i + 1) != Some(knot) {
                points[i] = found;
                found += 1;
            }
        }
        (found == grid.len()).then_some(points)
    }

    /// Value at the start of segment `i` and rate within it, of every input, without derivatives; zero where
    /// there are no inputs.
    pub fn lines(&self, i: usize) -> &[[f64; 2]] {
        &self.lines[i * self.width()..(i + 1) * self.width()]
    }

    /// Number of lines of a segment.
    #[inline(always)]
    fn width(&self) -> usize {
        self.sines.len().max(1)
    }

    /// True if derivatives jump at knots. The derivative of a delayed signal by its delay follows the
    /// slope, which changes at a knot; those by offsets begin anew there.
    pub fn jumps(&self) -> bool {
        !self.lifts.is_empty() || self.shifts.iter().any(|shift| !shift.is_constant())
    }

    /// Bounds of an input over a range of samples, without derivatives; zero where there
    /// are no inputs.
    pub fn bounds(&self, input: usize, samples: SampleRange) -> [f64; 2] {
        let SampleRange { first, count } = samples;
        let stretches = first / STRETCH..=(first + count.max(1) - 1) / STRETCH;
        if let Some(Some(Wave { offset, amplitude, .. })) = self.waves.get(input) {
            return [offset - amplitude.abs(), offset + amplitude.abs()];
        }
        stretches.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], stretch| {
            let [least, largest] = self.extremes[stretch * self.width() + input];
            [low.min(least), high.max(largest)]
        })
    }

    /// Value of an input at the start of segment `i` and its rate.
    #[inline(always)]
    pub fn line(&self, i: usize, input: usize) -> [T; 2] {
        shifted(&self.lines(i)[input], self.shifts[input])
    }

    /// Lines of every input, with their offsets.
    #[inline(always)]
    pub fn lines_at(&self, i: usize) -> impl Iterator<Item = [T; 2]> {
        let lifts = self.lifts.iter().copied().chain(std::iter::repeat(T::zero_()));
        self.lines(i).iter().zip(&self.shifts).zip(lifts).map(|((line, &shift), lift)| {
            let [start, rate] = shifted(line, shift);
            [start + lift, rate]
        })
    }

    /// Taylor coefficients of every input at `t` within segment `i`.
    pub fn expand(&self, i: usize, t: T, out: &mut [Series<T>]) {
        let elapsed = t - self.knots[i];
        for (input, (series, sine)) in out.iter_mut().zip(&self.sines).enumerate() {
            match sine {
                Some(sine) => *series = sine_series(sine, t),
                None => {
                    let [start, rate] = self.line(i, input);
                    series[0] = start + rate * elapsed;
                    series[1] = rate;
                }
            }
            if let Some(&lift) = self.lifts.get(input) {
                series[0] += lift;
            }
        }
    }
}

/// Most lengths of segments that are distinguished.
const LENGTHS: usize = 8;

/// For every segment the length that its operators are made for [s]: that of the first of those as long as
/// it, of which there are enough; else zero. Only the first [`LENGTHS`] lengths are recognised in later
/// segments.
fn usual_lengths(knots: &[f64], equal: &[u32]) -> Vec<f64> {
    let mut known: Vec<(f64, usize)> = Vec::with_capacity(LENGTHS);
    let mut class = Vec::with_capacity(equal.len());
    while class.len() < equal.len() {
        let i = class.len();
        let (length, count) = (knots[i + 1] - knots[i], equal[i] as usize);
        // Short ones are differences of long times.
        let same = |&(other, _): &(f64, usize)| (length - other).abs() <= 1e-12 + 1e-9 * length;
        let place = known.iter().position(same).unwrap_or(known.len());
        if place == known.len() && place < LENGTHS {
            known.push((length, 0));
        }
        if let Some((_, number)) = known.get_mut(place) {
            *number += count;
        }
        class.resize(i + count, (place, (length, count)));
    }
    let usual = |&(place, own): &(usize, (f64, usize))| known.get(place).copied().unwrap_or(own);
    let worth_while = |(length, count)| if count >= WORTH_WHILE { length } else { 0.0 };
    class.iter().map(usual).map(worth_while).collect()
}

fn extremes(knots: &[f64], lines: &[[f64; 2]], inputs: usize) -> Vec<[f64; 2]> {
    let mut all = Vec::with_capacity(knots.len().div_ceil(STRETCH) * inputs);
    let mut knots = knots.windows(2);
    for stretch in lines.chunks(STRETCH * inputs) {
        let from = all.len();
        all.resize(from + inputs, [f64::INFINITY, f64::NEG_INFINITY]);
        for (segment, span) in stretch.chunks_exact(inputs).zip(&mut knots) {
            for ([low, high], &[start, rate]) in all[from..].iter_mut().zip(segment) {
                let end = start + rate * (span[1] - span[0]);
                let (less, more) = if start < end { (start, end) } else { (end, start) };
                *low = if less < *low { less } else { *low };
                *high = if more > *high { more } else { *high };
            }
        }
    }
    all
}

/// With a later signal the value falls by its rate.
#[inline(always)]
fn shifted<T: Real>(&[start, rate]: &[f64; 2], shift: T) -> [T; 2] {
    let start = if T::DERIVATIVES { T::of(start) - shift * rate } else { T::of(start) };
    [start, T::of(rate)]
}

/// For every segment the number of segments from it on that are as long as it to 1e-9.
fn equal_lengths(knots: &[f64]) -> Vec<u32> {
    let mut equal = vec![1; knots.len() - 1];
    for i in (1..equal.len()).rev() {
        let (before, length) = (knots[i] - knots[i - 1], knots[i + 1] - knots[i]);
        if (before - length).abs() <= 1e-9 * length {
            equal[i - 1] = equal[i] + 1;
        }
    }
    equal
}

/// True if a raster, times [s] and delay [s], equals the `known` raster.
fn is_raster(known: Option<(&[f64], f64)>, times: &[f64], delay: f64) -> bool {
    known.is_some_and(|(others, d)| d == delay && (std::ptr::eq(others, times) || others == times))
}

/// Grid points and sample times of all signals within the span [s], sorted, with whether they are of the
/// grid.
fn inner_times<T: Real>(
    signals: &[(&str, Signal<'_, T>)],
    grid: &[f64],
    start: f64,
    end: f64,
) -> Vec<(f64, bool)> {
    let within = |(t, _): &(f64, bool)| (start..end).contains(t);
    let mut sorted: Vec<(f64, bool)> = grid.iter().map(|&t| (t, true)).filter(within).collect();
    let mut last = (!grid.is_empty()).then_some((grid, 0.0));
    for (_, signal) in signals {
        let Signal::Samples { times, delay, .. } = *signal else { continue };
        if is_raster(last, times, delay.re()) {
            continue;
        }
        last = Some((times, delay.re()));
        let was_empty = sorted.is_empty();
        sorted.extend(times.iter().map(|t| (t + delay.re(), false)).filter(within));
        if !was_empty {
            // Stable, so that two sorted runs are merged in linear time.
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }
    sorted
}

/// Start, distinct inner times and end; times closer than round-off count as one, that of the grid; inner
/// jumps stand twice.
fn merge_knots(sorted: &[(f64, bool)], jumps: &[f64], start: f64, end: f64) -> Vec<f64> {
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
    let mut knots: Vec<f64> = Vec::with_capacity(sorted.len() + 2);
    knots.push(start);
    for &(t, of_grid) in sorted {
        if near(knots[knots.len() - 1], t) {
            if of_grid {
                knots.iter_mut().rev().take_while(|k| near(**k, t)).for_each(|k| *k = t);
            }
        } else if !near(t, end) {
            knots.push(t);
            if jumps.iter().any(|&jump| near(jump, t)) {
                knots.push(t);
            }
        }
    }
    knots.push(end);
    knots
}

/// Lines of one signal over all segments; `smooth` where no knot stands twice.
fn fill<'l>(
    lines: impl Iterator<Item = &'l mut [f64; 2]>,
    knots: &[f64],
    smooth: bool,
    times: &[f64],
    values: &[f64],
    delay: f64,
) {
    let first = times.partition_point(|&t| t < knots[0]);
    // Where the knots are samples there is nothing to search.
    if smooth && delay == 0.0 && times.get(first..first + knots.len()) == Some(knots) {
        let values = values[first..first + knots.len()].windows(2);
        for (line, (span, values)) in lines.zip(knots.windows(2).zip(values)) {
            *line = [values[0], (values[1] - values[0]) / (span[1] - span[0])];
        }
        return;
    }
    let mut cursor = 0;
    for (to, span) in lines.zip(knots.windows(2)) {
        *to = line(times, values, delay, (span[0], span[1]), &mut cursor);
    }
}

/// Value at the start of a segment and rate within it. The samples' interval is found by the
/// middle of the segment, so that round-off of the knots cannot pick a neighbour; `cursor` remembers
/// it for the segments that follow.
fn line(
    times: &[f64],
    values: &[f64],
    delay: f64,
    span: (f64, f64),
    cursor: &mut usize,
) -> [f64; 2] {
    let (from, to) = span;
    let middle = 0.5 * (from + to) - delay;
    while *cursor < times.len() && times[*cursor] <= middle {
        *cursor += 1;
    }
    let next = *cursor;
    if next == 0 || next == times.len() {
        return [values[next.saturating_sub(1)], 0.0];
    }
    let rate = (values[next] - values[next - 1]) / (times[next] - times[next - 1]);
    [values[next - 1] + rate * (from - times[next - 1] - delay), rate]
}
