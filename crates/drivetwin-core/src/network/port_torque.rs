// SPDX-License-Identifier: MIT
//! Torque that an element exerts on a node, and acceleration of a node, as linear forms of one mode.
//!
//! The torques of all elements at a node, inertias included, vanish in sum.

use super::compile::Network;
use super::linalg::is_nothing;
use super::mode::{GearState, Mode, RowId};
use crate::model::Name;
use crate::model::mechanism::{ForceLaw, SpringLaw};
use crate::number::Number;

impl<T: Number> Network<T> {
    /// Names of all elements, in the order of what they state.
    pub fn elements(&self) -> Vec<&Name> {
        let m = &self.mechanism;
        let all = m.inertias.iter().map(|i| &i.element);
        let all = all.chain(m.constraints.iter().map(|c| &c.element));
        let all = all.chain(m.springs.iter().map(|s| &s.element));
        let all = all.chain(m.frictions.iter().map(|f| &f.element));
        let all = all.chain(m.forces.iter().map(|f| &f.element));
        let mut names: Vec<&Name> = Vec::new();
        for name in all.chain(m.prescribed.iter().map(|p| &p.element)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Nodes that an element acts on, the ground apart.
    pub fn nodes_of(&self, element: &Name) -> Vec<usize> {
        let m = &self.mechanism;
        let inertias = m.inertias.iter().map(|i| (&i.element, &i.row[..]));
        let constraints = m.constraints.iter().map(|c| (&c.element, &c.row[..]));
        let springs = m.springs.iter().map(|s| (&s.element, &s.row[..]));
        let frictions = m.frictions.iter().map(|f| (&f.element, &f.row[..]));
        let rows = inertias.chain(constraints).chain(springs).chain(frictions);
        let rows = rows.filter(|(name, _)| *name == element);
        let coupled = rows.flat_map(|(_, row)| row.iter().map(|&(node, _)| node));
        let forces = m.forces.iter().filter(|f| f.element == *element);
        let forces = forces.flat_map(|f| f.nodes.iter().map(|&(node, _)| node));
        let prescribed = m.prescribed.iter().filter(|p| p.element == *element).map(|p| p.node);
        let mut nodes: Vec<usize> = coupled.chain(forces).chain(prescribed).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Torque of a shaft on its driven end, over the basis.
    pub fn spring_torque(&self, i: usize) -> Vec<T> {
        let mut row = vec![T::zero_(); self.basis()];
        match self.mechanism.springs[i].law {
            SpringLaw::Linear { stiffness, damping } => {
                row.iter_mut().zip(self.twist_rates.row(i)).for_each(|(r, &c)| *r = c * damping);
                self.add_twist(self.balanced_twists(), i, stiffness, &mut row);
            }
            SpringLaw::Regions { .. } => {
                let before = self.mechanism.springs[..i].iter().filter(|s| s.law.has_regions());
                row[self.applied_torques[before.count()].basis] = T::of(1.0);
            }
        }
        row
    }
}

impl<T: Number> Mode<T> {
    /// Acceleration of a node over the basis; of one that is no follower.
    pub fn acceleration(&self, network: &Network<T>, terms: &[(usize, T)]) -> Vec<T> {
        let mut row = vec![T::zero_(); network.basis()];
        for (i, &c) in
            network.express_in_speeds(terms).iter().enumerate().filter(|(_, c)| !is_nothing(**c))
        {
            row.iter_mut().zip(self.derivative.row(i)).for_each(|(r, &d)| *r += c * d);
        }
        row
    }

    /// Torque that an element exerts on a node, over the basis.
    pub fn port_torque(&self, network: &Network<T>, element: &Name, node: usize) -> Vec<T> {
        let m = &network.mechanism;
        let mut sum = vec![T::zero_(); network.basis()];
        let mut add = |factor: T, row: &[T]| {
            sum.iter_mut().zip(row).for_each(|(s, &r)| *s += factor * r);
        };
        for inertia in m.inertias.iter().filter(|i| i.element == *element) {
            for &(_, c) in inertia.row.iter().filter(|(n, _)| *n == node) {
                add(-(c * inertia.inertia), &self.acceleration(network, &inertia.row));
            }
        }
        for (i, spring) in m.springs.iter().enumerate().filter(|(_, s)| s.element == *element) {
            for &(_, c) in spring.row.iter().filter(|(n, _)| *n == node) {
                add(-c, &network.spring_torque(i));
            }
        }
        for (j, friction) in m.frictions.iter().enumerate().filter(|(_, f)| f.element == *element) {
            for &(_, c) in friction.row.iter().filter(|(n, _)| *n == node) {
                add(-c, &self.friction_torque(network, j));
            }
        }
        for (i, p) in m.prescribed.iter().enumerate() {
            if p.element == *element && p.node == node {
                add(T::of(-1.0), self.stuck_torque.row(self.stuck.len() + i));
            }
        }
        self.add_constraints(network, element, node, &mut sum);
        add_forces(network, element, node, &mut sum);
        sum
    }

    /// Torque of a friction element over the basis: that of its channel unless it sticks.
    fn friction_torque(&self, network: &Network<T>, j: usize) -> Vec<T> {
        self.holding_torque(RowId::Friction(j)).map_or_else(
            || {
                let mut row = vec![T::zero_(); network.basis()];
                row[network.first_channel() + j] = T::of(1.0);
                row
            },
            <[T]>::to_vec,
        )
    }

    fn add_constraints(&self, network: &Network<T>, element: &Name, node: usize, sum: &mut [T]) {
        let m = &network.mechanism;
        if !m.constraints.iter().any(|c| c.element == *element) {
            return;
        }
        let (multipliers, acting) = (self.multipliers(network), network.force_rows(self.key));
        for (i, _) in m.constraints.iter().enumerate().filter(|(_, c)| c.element == *element) {
            let factor = acting[(i, node)];
            sum.iter_mut().zip(multipliers.row(i)).for_each(|(s, &l)| *s -= factor * l);
        }
        for (g, gear) in network.losses.iter().enumerate().filter(|(_, g)| g.element == *element) {
            if let Some(held) = self.holding_torque(RowId::Gear(g)) {
                if gear.loss.driving == node {
                    sum.iter_mut().zip(held).for_each(|(s, &loss)| *s -= loss);
                }
            } else if let GearState::Meshing { sign, power_reversed } = self.key.gear(g) {
                let drag = gear.loss.drag_torque(sign, power_reversed);
                let driven = &m.constraints[gear.constraint].row[1..];
                for &(_, c) in driven.iter().filter(|(n, _)| *n == node) {
                    sum[network.one()] += c * drag;
                }
            }
        }
    }
}

/// Torques of sources and loads.
fn add_forces<T: Number>(network: &Network<T>, element: &Name, node: usize, sum: &mut [T]) {
    let springs = network.mechanism.springs.iter();
    let mut applied = springs.filter(|s| s.law.has_regions()).count();
    for force in &network.mechanism.forces {
        let own = force.element == *element;
        let ways = force.nodes.iter().filter(|&&(n, _)| own && n == node).map(|&(_, way)| way);
        if let ForceLaw::Constant(torque) = force.law {
            ways.for_each(|way| sum[network.one()] += way * torque);
            continue;
        }
        ways.for_each(|way| sum[network.applied_torques[applied].basis] += way);
        applied += 1;
    }
}
