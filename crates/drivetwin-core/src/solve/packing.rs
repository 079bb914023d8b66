// SPDX-License-Identifier: MIT
//! Operators of several runs in the lanes of one set.

use super::operators::{Carried, Drive, Form, MAX_ACTIVE, Operators, SHAPES, StepForm, Watched};
use crate::network::smooth::{Law, Line};
use crate::number::{Lane, Pack};

/// Places in a formation: channels by number, watched guards by number, channels of one lane.
pub(super) type Places<'p> = (&'p [usize], &'p [usize], &'p [usize]);

/// Place of a run's own channel for a slot of the formation, and the number of slots in use.
type Own<P> = (P, usize);

impl<const K: usize, const N: usize> Operators<Pack<K>, N> {
    /// Operators under which nothing moves and no guard falls.
    pub fn idle() -> Self {
        let zero = Pack::all(0.0);
        Self {
            states: 0,
            bow: [zero; 2],
            signs: [zero; MAX_ACTIVE],
            transition: [[zero; N]; N],
            constant: [zero; N],
            drives: Vec::new(),
            channels: vec![Carried::idle(); MAX_ACTIVE],
            watched: Vec::new(),
            loads: Vec::new(),
        }
    }

    /// Put the operators of one run into a lane.
    pub fn set_lane(&mut self, lane: usize, from: &Operators<f64, N>, places: Places<'_>) {
        let (slots, watched, _) = places;
        let own = |slot: usize| own_slot(places, slot);
        self.states = from.states;
        put(&mut self.bow, &from.bow, lane);
        put(self.transition.as_flattened_mut(), from.transition.as_flattened(), lane);
        put(&mut self.constant, &from.constant, lane);
        for (slot, channel) in self.channels.iter_mut().enumerate().take(slots.len()) {
            match own(slot) {
                Some(own_slot) => {
                    channel.set_lane(lane, &from.channels[own_slot], (own, slots.len()))
                }
                None => channel.clear_lane(lane),
            }
        }
        self.watched.resize_with(watched.len(), Watched::idle);
        self.drives.resize_with(from.drives.len(), Drive::idle);
        for (place, (watch, id)) in self.watched.iter_mut().zip(watched).enumerate() {
            watch.id = *id;
            let found = from.watched.iter().position(|w| w.id == *id);
            match found {
                Some(found) => watch.set_lane(lane, &from.watched[found], (own, slots.len())),
                None => watch.clear_lane(lane),
            }
            for (drive, from) in self.drives.iter_mut().zip(&from.drives) {
                drive.watched[place].0[lane] = found.map_or(0.0, |found| from.watched[found]);
            }
        }
        for (drive, from) in self.drives.iter_mut().zip(&from.drives) {
            drive.set_lane(lane, from, (own, slots.len()));
        }
        self.loads.resize_with(from.loads.len(), Line::idle);
        for (load, from) in self.loads.iter_mut().zip(&from.loads) {
            load.set_lane(lane, from);
        }
    }
}

/// Position in one run's operators of the channel in a slot of the formation.
fn own_slot((slots, _, active): Places<'_>, slot: usize) -> Option<usize> {
    let id = slots.get(slot)?;
    active.iter().position(|j| j == id)
}

fn put<const K: usize>(to: &mut [Pack<K>], from: &[f64], lane: usize) {
    for (pack, &value) in to.iter_mut().zip(from) {
        pack.0[lane] = value;
    }
}

impl<const K: usize, const N: usize> Drive<Pack<K>, N> {
    /// All but the watched forms.
    fn set_lane(
        &mut self,
        lane: usize,
        from: &Drive<f64, N>,
        (own, slots): Own<impl Fn(usize) -> Option<usize>>,
    ) {
        self.input = from.input;
        put(self.step.as_flattened_mut(), from.step.as_flattened(), lane);
        for slot in 0..slots {
            let own = own(slot);
            let value = |of: &[f64]| own.map_or(0.0, |own| of[own]);
            put(&mut self.argument[slot], &own.map_or([0.0; 2], |own| from.argument[own]), lane);
            self.now[slot].0[lane] = value(&from.now);
            self.second[slot].0[lane] = value(&from.second);
        }
    }
}

impl<const K: usize, const N: usize> Watched<Pack<K>, N> {
    fn set_lane(
        &mut self,
        lane: usize,
        from: &Watched<f64, N>,
        own: Own<impl Fn(usize) -> Option<usize>>,
    ) {
        self.form.set_lane(lane, &from.form, own);
        self.limit.set_lane(lane, &from.limit);
        self.side.0[lane] = from.side;
    }

    fn clear_lane(&mut self, lane: usize) {
        let input = self.limit.input;
        self.set_lane(lane, &Watched::idle(), (|_| None, MAX_ACTIVE));
        self.limit.input = input;
    }
}

impl<const K: usize, const N: usize> Carried<Pack<K>, N> {
    fn set_lane(
        &mut self,
        lane: usize,
        from: &Carried<f64, N>,
        own: Own<impl Fn(usize) -> Option<usize> + Copy>,
    ) {
        put(self.moments.as_flattened_mut(), from.moments.as_flattened(), lane);
        put(&mut self.argument, &from.argument, lane);
        self.argument_end.set_lane(lane, &from.argument_end, own);
        put_cubics(&mut self.rate_end, lane, (&from.rate_end, own));
        self.rate.set_lane(lane, &from.rate, own);
        self.second.set_lane(lane, &from.second, own);
        self.law.set_lane(lane, &from.law);
    }

    fn clear_lane(&mut self, lane: usize) {
        let input = self.law.normal.input;
        self.set_lane(lane, &Carried::idle(), (|_| None, MAX_ACTIVE));
        self.law.normal.input = input;
    }
}

impl<const K: usize, const N: usize> StepForm<Pack<K>, N> {
    fn set_lane(
        &mut self,
        lane: usize,
        from: &StepForm<f64, N>,
        (own, slots): Own<impl Fn(usize) -> Option<usize>>,
    ) {
        put(&mut self.state, &from.state, lane);
        self.constant.0[lane] = from.constant;
        put_cubics(&mut self.cubics, lane, (&from.cubics, (own, slots)));
    }
}

/// What stands over the cubics of the carried channels.
fn put_cubics<const K: usize>(
    to: &mut [[Pack<K>; SHAPES]; MAX_ACTIVE],
    lane: usize,
    (from, (own, slots)): (&[[f64; SHAPES]; MAX_ACTIVE], Own<impl Fn(usize) -> Option<usize>>),
) {
    for (slot, cubic) in to.iter_mut().enumerate().take(slots) {
        put(cubic, &own(slot).map_or([0.0; SHAPES], |own| from[own]), lane);
    }
}

impl<const K: usize, const N: usize> Form<Pack<K>, N> {
    fn set_lane(
        &mut self,
        lane: usize,
        from: &Form<f64, N>,
        (own, slots): Own<impl Fn(usize) -> Option<usize>>,
    ) {
        put(&mut self.state, &from.state, lane);
        self.constant.0[lane] = from.constant;
        for (slot, channel) in self.channels.iter_mut().enumerate().take(slots) {
            channel.0[lane] = own(slot).map_or(0.0, |own| from.channels[own]);
        }
    }
}

impl<const K: usize> Law<Pack<K>> {
    fn set_lane(&mut self, lane: usize, from: &Law<f64>) {
        self.sign.0[lane] = from.sign;
        self.normal.set_lane(lane, &from.normal);
        put(&mut self.polynomial, &from.polynomial, lane);
        self.excess.0[lane] = from.excess;
        self.rate.0[lane] = from.rate;
        self.from.0[lane] = from.from;
        self.to.0[lane] = from.to;
    }
}

impl<const K: usize> Line<Pack<K>> {
    fn set_lane(&mut self, lane: usize, from: &Line<f64>) {
        self.input = from.input;
        self.gain.0[lane] = from.gain;
        self.offset.0[lane] = from.offset;
    }
}
