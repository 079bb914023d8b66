// SPDX-License-Identifier: MIT
//! Members without mass between compliances: their speeds follow from the balance of torques.
//!
//! The torques at such a member vanish in sum. With a damper on it this gives its speed (index 1). Without
//! one the sum of spring torques stays the same, and its rate gives the speed (index 2).

use super::compile::Network;
use super::constraints::Followers;
use super::error::CompileError;
use super::linalg::{Matrix, is_nothing, solve};
use crate::model::mechanism::{ForceLaw, Row, SpringLaw};
use crate::number::Number;

/// Balance of the members without mass, before they are taken out of the coordinates.
struct Balance<'n, T> {
    network: &'n Network<T>,
    /// Independent speeds with mass, and those without.
    heavy: Vec<usize>,
    massless: Vec<usize>,
    /// Rates of twist, springs × all speeds.
    rates: Matrix<T>,
}

impl<T: Number> Network<T> {
    /// Take members without mass between compliances out of the independent speeds.
    pub(super) fn eliminate_massless(&mut self) -> Result<(), CompileError> {
        let massless: Vec<usize> = (0..self.speeds()).filter(|&j| self.follows(j)).collect();
        if massless.is_empty() || massless.len() == self.speeds() {
            return Ok(());
        }
        let heavy: Vec<usize> = (0..self.speeds()).filter(|j| !massless.contains(j)).collect();
        let all = self.coordinates.clone();
        self.coordinates.independent = heavy.iter().map(|&j| all.independent[j]).collect();
        self.coordinates.speeds = all.speeds.select_columns(&heavy);
        self.coordinates.sizes = all.sizes.select_columns(&heavy);
        self.count_states();
        let mut rates = Matrix::zeros(self.mechanism.springs.len(), all.speeds.cols);
        for (i, spring) in self.mechanism.springs.iter().enumerate() {
            for &(node, c) in &spring.row {
                rates.subtract_from_row(i, all.speeds.row(node), -c);
            }
        }
        let own = all.speeds.select_columns(&massless);
        let balance = Balance { network: self, heavy, massless, rates };
        let followers = balance.followers(&own).ok_or_else(|| {
            let nodes = &self.mechanism.nodes;
            let moved = |i: &usize| own.row(*i).iter().any(|&v| !is_nothing(v));
            let members = (0..own.rows).filter(moved).map(|i| nodes[i].to_string()).collect();
            CompileError::Massless { members }
        })?;
        self.followers = Some(followers);
        self.set_mass();
        Ok(())
    }

    /// Twists in balance on members without mass and dampers, see [`Followers::twists`].
    pub fn balanced_twists(&self) -> Option<&Matrix<T>> {
        self.followers.as_ref()?.twists.as_ref()
    }

    /// Add `factor` times the twist of a spring to a row over the basis, `balanced` where it is on a member
    /// without mass: round-off of the twists would else pull at one side of the member more than at the other.
    pub(super) fn add_twist(
        &self,
        balanced: Option<&Matrix<T>>,
        spring: usize,
        factor: T,
        row: &mut [T],
    ) {
        let twists = &mut row[self.speeds()..self.first_lag()];
        let Some(balanced) = balanced.map(|all| all.row(spring)) else {
            twists[spring] += factor;
            return;
        };
        twists.iter_mut().zip(balanced).for_each(|(sum, &twist)| *sum += factor * twist);
        row[self.one()] += factor * balanced[balanced.len() - 1];
    }

    /// Return true if an independent speed has no mass and only linear compliances, lossless gears and given
    /// torques act on it.
    fn follows(&self, j: usize) -> bool {
        let n = &self.coordinates.speeds;
        let m = &self.mechanism;
        let moves = |node: usize| !is_nothing(n[(node, j)]);
        let touches = |row: &Row<T>| row.iter().any(|&(node, _)| moves(node));
        let linear = |law: &SpringLaw<T>| matches!(law, SpringLaw::Linear { .. });
        let given = |law: &ForceLaw<T>| matches!(law, ForceLaw::Input(_) | ForceLaw::Constant(_));
        let reads = |law: &ForceLaw<T>| match law {
            ForceLaw::Input(_) | ForceLaw::Constant(_) => false,
            ForceLaw::Quadratic { node, .. } | ForceLaw::Map { node, .. } => moves(*node),
            ForceLaw::Converter { pump, turbine, .. } => moves(*pump) || moves(*turbine),
            ForceLaw::Slip { wheel, road, .. } => moves(*wheel) || moves(*road),
            ForceLaw::Loss { slip, constraint, .. } => {
                touches(slip) || constraint.is_some_and(|i| touches(&m.constraints[i].row))
            }
        };
        is_nothing(self.mass[(j, j)])
            && m.springs.iter().any(|s| touches(&s.row))
            && m.springs.iter().all(|s| linear(&s.law) || !touches(&s.row))
            && !m.frictions.iter().any(|f| touches(&f.row))
            && !m.constraints.iter().any(|c| c.loss.is_some() && touches(&c.row))
            && !m.prescribed.iter().any(|p| moves(p.node))
            && m.forces.iter().all(|f| (given(&f.law) || !touches(&f.nodes)) && !reads(&f.law))
    }
}

impl<T: Number> Balance<'_, T> {
    /// `None` where the balance leaves the speeds undetermined.
    fn followers(&self, own: &Matrix<T>) -> Option<Followers<T>> {
        let count = self.massless.len();
        let (mut a, mut right) =
            (Matrix::zeros(count, count), Matrix::zeros(count, self.network.first_channel()));
        let undamped: Vec<usize> = (0..count).filter(|&i| !self.is_damped(i)).collect();
        let twists = if undamped.is_empty() { None } else { Some(self.settled(&undamped, own)?) };
        for i in 0..count {
            let damped = !undamped.contains(&i);
            for (spring, rate, [stiffness, damping]) in self.laws(i) {
                let weight = rate * if damped { damping } else { stiffness };
                for (to, &j) in self.massless.iter().enumerate() {
                    a[(i, to)] += weight * self.rates[(spring, j)];
                }
                for (to, &j) in self.heavy.iter().enumerate() {
                    right[(i, to)] -= weight * self.rates[(spring, j)];
                }
                if damped {
                    let sum = right.row_mut(i);
                    self.network.add_twist(twists.as_ref(), spring, -rate * stiffness, sum);
                }
            }
            self.add_torques(i, own, damped, right.row_mut(i))?;
        }
        let speeds = own.times(&solve(a, right).ok()?);
        Some(Followers { speeds, twists })
    }

    /// Return true if a damper is on a member.
    fn is_damped(&self, i: usize) -> bool {
        self.laws(i).any(|(_, _, [_, damping])| !is_nothing(damping))
    }

    /// Springs on a member: index, rate of twist by its speed, stiffness and damping.
    fn laws(&self, i: usize) -> impl Iterator<Item = (usize, T, [T; 2])> {
        let springs = self.network.mechanism.springs.iter().enumerate();
        springs.filter_map(move |(spring, one)| {
            let rate = self.rates[(spring, self.massless[i])];
            let SpringLaw::Linear { stiffness, damping } = one.law else { return None };
            (!is_nothing(rate)).then_some((spring, rate, [stiffness, damping]))
        })
    }

    /// Given torques on a member, over the basis. Without a damper the twists would follow a torque that
    /// changes at once: `None`.
    fn add_torques(&self, i: usize, own: &Matrix<T>, damped: bool, sum: &mut [T]) -> Option<()> {
        let mut lag = self.network.first_lag();
        for force in &self.network.mechanism.forces {
            let arm = arm(own, &force.nodes, i);
            let position = match (&force.law, force.lag) {
                (_, Some(_)) => lag,
                (ForceLaw::Input(input), None) => self.network.first_input() + input,
                _ => self.network.one(),
            };
            lag += usize::from(force.lag.is_some());
            if is_nothing(arm) {
                continue;
            }
            match (damped, &force.law) {
                (true, ForceLaw::Constant(torque)) => sum[position] += arm * *torque,
                (true, _) => sum[position] += arm,
                (false, ForceLaw::Constant(_)) => {}
                (false, _) => return None,
            }
        }
        Some(())
    }

    /// Twists that balance the members without dampers, which turn until they do.
    fn settled(&self, undamped: &[usize], own: &Matrix<T>) -> Option<Matrix<T>> {
        let (count, springs) = (undamped.len(), self.network.mechanism.springs.len());
        let (mut a, mut right) = (Matrix::zeros(count, count), Matrix::zeros(count, springs + 1));
        for (row, &i) in undamped.iter().enumerate() {
            for (spring, rate, [stiffness, _]) in self.laws(i) {
                for (to, &other) in undamped.iter().enumerate() {
                    let rate_of_other = self.rates[(spring, self.massless[other])];
                    a[(row, to)] += rate * stiffness * rate_of_other;
                }
                right[(row, spring)] -= rate * stiffness;
            }
            for force in &self.network.mechanism.forces {
                if let ForceLaw::Constant(torque) = force.law {
                    right[(row, springs)] += arm(own, &force.nodes, i) * torque;
                }
            }
        }
        let angles = solve(a, right).ok()?;
        let mut twists = Matrix::zeros(springs, springs + 1);
        for spring in 0..springs {
            twists[(spring, spring)] = T::of(1.0);
            for (to, &i) in undamped.iter().enumerate() {
                let rate = self.rates[(spring, self.massless[i])];
                twists.subtract_from_row(spring, angles.row(to), -rate);
            }
        }
        Some(twists)
    }
}

/// Speed of a row of nodes per speed of member `i`.
fn arm<T: Number>(own: &Matrix<T>, row: &Row<T>, i: usize) -> T {
    row.iter().fold(T::zero_(), |sum, &(node, c)| sum + c * own[(node, i)])
}
