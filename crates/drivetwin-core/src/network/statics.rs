// SPDX-License-Identifier: MIT
//! A gear at steady speed: speed and torque of every member per unit at the input (virtual work,
//! THEORY section 1), lossless.

use super::linalg::{Matrix, least_norm};
use super::mobility::{EngagedError, EngagedMechanism, member_index};
use crate::model::Mechanism;
use crate::number::Real;

/// Torque that an element exerts on a member.
#[derive(Clone, Debug, PartialEq)]
pub struct Flange<T> {
    /// Gear, planetary set, or engaged friction element.
    pub element: String,
    /// Member.
    pub member: String,
    /// N·m on the member per N·m at the input, positive with the member's speed.
    pub torque: T,
}

/// Speeds and torques of one gear.
#[derive(Clone, Debug, PartialEq)]
pub struct Statics<T> {
    /// Members and their speeds per unit input speed; `None` where a member idles.
    pub speeds: Vec<(String, Option<T>)>,
    /// Torques of all elements on all members.
    pub flanges: Vec<Flange<T>>,
    /// Torque that the load must exert on the output per unit input torque.
    pub load_torque: T,
}

impl<T: Real> Statics<T> {
    /// Solve a gear: the elements `engaged`, driven at `input`, loaded at `output`.
    pub fn solve(
        m: &Mechanism<T>,
        engaged: &[String],
        input: &str,
        output: &str,
    ) -> Result<Self, EngagedError> {
        let (input, output) = (member_index(m, input)?, member_index(m, output)?);
        let held = EngagedMechanism::new(m, engaged, &[input])?;
        let output_speed = held.speeds[(output, 0)];
        if !held.connected.contains(&output) || output_speed.re().abs() < STANDSTILL {
            let members = vec![m.nodes[output].to_string()];
            return Err(EngagedError::NotFree { members, engaged: engaged.to_vec() });
        }
        let load_torque = -output_speed.recip();
        let mut external = Matrix::zeros(m.nodes.len(), 1);
        external[(input, 0)] += 1.0;
        external[(output, 0)] += load_torque;
        let speeds = (0..m.nodes.len())
            .map(|i| {
                let speed = held.connected.contains(&i).then(|| held.speeds[(i, 0)]);
                (m.nodes[i].to_string(), speed)
            })
            .collect();
        Ok(Self { speeds, flanges: flanges(m, &held, &external), load_torque })
    }

    /// Speed of a member per unit input speed.
    pub fn speed(&self, member: &str) -> Option<T> {
        self.speeds.iter().find(|(name, _)| name == member).and_then(|(_, speed)| *speed)
    }

    /// Speed of the input over that of the output.
    pub fn ratio(&self) -> T {
        -self.load_torque
    }

    /// Largest sum of powers through one element, and largest sum of torques on one member, of
    /// magnitude; both vanish in exact arithmetic.
    pub fn imbalance(&self, input: &str, output: &str) -> (f64, f64) {
        let mut powers: Vec<(&str, f64)> = Vec::new();
        let mut torques: Vec<(&str, f64)> = vec![(input, 1.0), (output, self.load_torque.re())];
        for flange in &self.flanges {
            let speed = self.speed(&flange.member).map_or(0.0, |s| s.re());
            add(&mut powers, &flange.element, flange.torque.re() * speed);
            add(&mut torques, &flange.member, flange.torque.re());
        }
        (largest(&powers), largest(&torques))
    }
}

/// Output speed per input speed below which a gear has no ratio.
const STANDSTILL: f64 = 1e-9;

/// `Cᵀ λ = -f`: the torque that row i exerts on a node is `λ_i` times its coefficient there.
fn flanges<T: Real>(
    m: &Mechanism<T>,
    held: &EngagedMechanism<T>,
    external: &Matrix<T>,
) -> Vec<Flange<T>> {
    let mut balance = Matrix::zeros(m.nodes.len(), held.rows.len());
    for (i, rigid) in held.rows.iter().enumerate() {
        for &(node, coefficient) in &rigid.row {
            balance[(node, i)] -= coefficient;
        }
    }
    let multipliers = least_norm(&balance, external);
    let mut flanges = Vec::new();
    for (i, rigid) in held.rows.iter().enumerate() {
        for &(node, coefficient) in &rigid.row {
            flanges.push(Flange {
                element: rigid.element.clone(),
                member: m.nodes[node].to_string(),
                torque: multipliers[(i, 0)] * coefficient,
            });
        }
    }
    flanges
}

fn add<'a>(sums: &mut Vec<(&'a str, f64)>, name: &'a str, value: f64) {
    match sums.iter_mut().find(|(known, _)| *known == name) {
        Some((_, sum)) => *sum += value,
        None => sums.push((name, value)),
    }
}

fn largest(sums: &[(&str, f64)]) -> f64 {
    sums.iter().fold(0.0, |largest, (_, sum)| largest.max(sum.abs()))
}
