// SPDX-License-Identifier: MIT
//! A gearbox in the middle of a shift as a dual clutch (THEORY section 2).

use super::mobility::{EngagedError, EngagedMechanism, friction_index, member_index};
use crate::model::Mechanism;
use crate::number::Real;
use thiserror::Error;

/// Reason why a shift has no dual-clutch form.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ReductionError {
    /// Members or elements without definite speeds.
    #[error(transparent)]
    EngagedMechanism(#[from] EngagedError),
    /// Not one element off and one on, such as a double transition.
    #[error(
        "not one element off and one on: released {}; applied {}",
        listed(released),
        listed(applied)
    )]
    NotOneForOne {
        /// Elements that only the old gear has.
        released: Vec<String>,
        /// Elements that only the new gear has.
        applied: Vec<String>,
    },
    /// The slip of an element does not depend on the input speed, so i_c is infinite.
    #[error("the slip of {element} does not depend on the input speed")]
    NoInputShare {
        /// The element.
        element: String,
    },
}

fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// Elements exchanged in a shift: one friction element is released, one is applied, the others stay
/// engaged.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchange {
    /// Element of the old gear that is released.
    pub off_going: String,
    /// Element of the new gear that is applied.
    pub on_coming: String,
    /// Elements engaged throughout.
    pub common: Vec<String>,
}

impl Exchange {
    /// Compare the elements of two gears. Dog clutches (`dogs`) do not slip under load: where
    /// friction elements change, the dogs of both gears are engaged throughout (preselection).
    pub fn between(
        from: &[String],
        to: &[String],
        dogs: &[String],
    ) -> Result<Self, ReductionError> {
        let missing_in = |gear: &[String], other: &[String]| -> Vec<String> {
            gear.iter().filter(|name| !other.contains(name)).cloned().collect()
        };
        let (mut released, mut applied) = (missing_in(from, to), missing_in(to, from));
        let mut common: Vec<String> =
            from.iter().filter(|name| to.contains(name)).cloned().collect();
        let single = |a: &[String], b: &[String]| a.len() == 1 && b.len() == 1;
        if !single(&released, &applied) {
            let (was, will) = (released.clone(), applied.clone());
            released.retain(|name| !dogs.contains(name));
            applied.retain(|name| !dogs.contains(name));
            if !single(&released, &applied) {
                return Err(ReductionError::NotOneForOne { released: was, applied: will });
            }
            common.extend(was.into_iter().chain(will).filter(|name| dogs.contains(name)));
        }
        let (off_going, on_coming) = (released.remove(0), applied.remove(0));
        Ok(Self { off_going, on_coming, common })
    }
}

/// The ratios of one shift element: `slip = ω_in / i_c - i_out ω_out` (eq. 15).
#[derive(Clone, Debug, PartialEq)]
pub struct ElementRatios<T> {
    /// Element.
    pub element: String,
    /// Ratio between input and clutch, > 0.
    pub i_c: T,
    /// Ratio between clutch and output.
    pub i_out: T,
    /// 1 where this slip is that of the element, `ω_a - ω_b`; -1 where it is the negative.
    pub sense: f64,
}

/// One inertia at `ω = a ω_in - b ω_out`: it adds `I a²`, `I b²` to the diagonal and `-I a b`
/// beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberInertia<T> {
    /// Member, or members joined by a plus sign.
    pub member: String,
    /// I, kg·m².
    pub inertia: T,
    /// Speed per input speed.
    pub a: T,
    /// Minus speed per output speed.
    pub b: T,
}

impl<T: Real> MemberInertia<T> {
    /// Contribution to the off-diagonal term of the mass matrix, kg·m².
    pub fn coupling(&self) -> T {
        -self.inertia * self.a * self.b
    }
}

/// The dual-clutch form of a shift.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduction<T> {
    /// Ratios of the element that is released.
    pub off_going: ElementRatios<T>,
    /// Ratios of the element that is applied.
    pub on_coming: ElementRatios<T>,
    /// Elements engaged throughout.
    pub common: Vec<String>,
    /// Every inertia of the gearbox that moves.
    pub members: Vec<MemberInertia<T>>,
}

impl<T: Real> Reduction<T> {
    /// Reduce one exchange of elements of a gearbox between `input` and `output`.
    pub fn of(
        m: &Mechanism<T>,
        exchange: &Exchange,
        input: &str,
        output: &str,
    ) -> Result<Self, ReductionError> {
        let free = [member_index(m, input)?, member_index(m, output)?];
        let middle = EngagedMechanism::new(m, &exchange.common, &free)?;
        let members = m
            .inertias
            .iter()
            .filter(|term| term.inertia.re() != 0.0)
            .filter(|term| term.row.iter().any(|(node, _)| middle.connected.contains(node)))
            .map(|term| {
                let speed = middle.in_free_coordinates(&term.row);
                let names: Vec<&str> =
                    term.row.iter().map(|&(node, _)| m.nodes[node].as_str()).collect();
                let (a, b) = (speed[0], -speed[1]);
                MemberInertia { member: names.join(" + "), inertia: term.inertia, a, b }
            })
            .collect();
        Ok(Self {
            off_going: ratios(m, &middle, &exchange.off_going)?,
            on_coming: ratios(m, &middle, &exchange.on_coming)?,
            common: exchange.common.clone(),
            members,
        })
    }

    /// Mass matrix over (ω_in, ω_out), kg·m².
    pub fn mass(&self) -> [[T; 2]; 2] {
        let mut mass = [[T::zero_(); 2]; 2];
        for member in &self.members {
            mass[0][0] += member.inertia * member.a * member.a;
            mass[1][1] += member.inertia * member.b * member.b;
            mass[0][1] += member.coupling();
        }
        mass[1][0] = mass[0][1];
        mass
    }

    /// `|M12| / √(M11 M22)`, zero where nothing couples.
    pub fn coupling_ratio(&self) -> T {
        let [[input, coupling], [_, output]] = self.mass();
        if coupling.re() == 0.0 {
            T::zero_()
        } else {
            (coupling * coupling / (input * output)).sqrt()
        }
    }
}

/// Share of the input speed in a slip, relative to the largest share, that counts as none.
const NO_SHARE: f64 = 1e-9;

fn ratios<T: Real>(
    m: &Mechanism<T>,
    middle: &EngagedMechanism<T>,
    element: &str,
) -> Result<ElementRatios<T>, ReductionError> {
    let slip = middle.in_free_coordinates(&m.frictions[friction_index(m, element)?].row);
    let (share, other) = (slip[0].re(), slip[1].re());
    if share.abs() <= NO_SHARE * share.abs().max(other.abs()) {
        return Err(ReductionError::NoInputShare { element: element.to_owned() });
    }
    let sense = share.signum();
    Ok(ElementRatios {
        element: element.to_owned(),
        i_c: (slip[0] * sense).recip(),
        i_out: -slip[1] * sense,
        sense,
    })
}
