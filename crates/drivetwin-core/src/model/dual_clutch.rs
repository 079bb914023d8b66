// SPDX-License-Identifier: MIT
//! The dual-clutch driveline with lock-up engaged (paper eqs. 2-9) as one instance of the network.

#![expect(non_snake_case, reason = "the symbols of the equations")]

use super::elements::{Clutch, Element, Gear, GearLoss, Inertia, RoadLoad, SpringDamper, Torque};
use super::mechanism::LossLaw;
use super::{Driveline, FrictionLaw, Name};
use crate::number::Number;
use serde::Deserialize;
use smol_str::SmolStrBuilder;
use std::marker::PhantomData;

/// Shift element: `slip = ω_in / i_c - i_out ω_out` (eq. 15).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShiftElement<T> {
    /// Name, such as B2.
    pub name: Name,
    /// Ratio between input gear and clutch.
    pub i_c: T,
    /// Ratio between clutch and output.
    pub i_out: T,
    /// N·D·A·r, m³.
    pub gain: T,
    /// Pressure at which the fill ends, Pa.
    #[serde(rename = "P0")]
    pub p0: T,
    /// Friction coefficient over the magnitude of the slip.
    pub friction: FrictionLaw<T>,
    /// Static over kinetic capacity.
    pub peak: T,
    /// Inertia that turns with the slip, kg·m².
    pub drum_inertia: T,
}

/// Load at the wheel, see [`RoadLoad`].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load<T> {
    /// Torque independent of the direction of motion, N·m.
    pub constant: T,
    /// Rolling resistance, N·m.
    pub rolling: T,
    /// Aerodynamic coefficient, N·m·s²/rad².
    pub aero: T,
}

/// Parameters of eqs. 2-9; symbols as in THEORY section 3. The elements of the network check their range.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DualClutch<T> {
    /// Inertia before the input gear, kg·m².
    pub J1: T,
    /// Inertia between input gear and clutches, at the engine, kg·m².
    pub J2e: T,
    /// Lumped efficiency.
    pub eta: T,
    /// Loss law by name.
    pub loss_law: LossLaw,
    /// Input gear.
    pub i_in: T,
    /// Output side before the shaft (Jo'), kg·m².
    pub J_out: T,
    /// Final drive.
    pub i_f: T,
    /// Vehicle at the wheel, kg·m².
    pub J_v: T,
    /// Output shaft stiffness, N·m/rad.
    pub k_o: T,
    /// Output shaft damping, N·m·s/rad.
    pub c_o: T,
    /// Load torque at the wheel.
    pub load: Load<T>,
    /// Shift elements.
    pub elements: Vec<ShiftElement<T>>,
}

/// Node of the engine.
pub const ENGINE: &str = "engine";
/// Node of the gearbox output.
pub const OUTPUT: &str = "output";
/// Node of the wheel.
pub const WHEEL: &str = "wheel";
/// Name of the output shaft.
pub const SHAFT: &str = "output shaft";
/// Name of the engine torque input.
pub const ENGINE_TORQUE: &str = "engine torque";

impl<T: Number> DualClutch<T> {
    /// Convert the driveline to elements of the network.
    pub fn driveline(&self) -> Driveline<T> {
        let [engine, output, wheel] =
            const { [Name::new_inline(ENGINE), Name::new_inline(OUTPUT), Name::new_inline(WHEEL)] };
        let [input, axle] = const { [Name::new_inline("input gear"), Name::new_inline("axle")] };
        let mut elements = Vec::with_capacity(9 + 3 * self.elements.len());
        elements.extend([
            inertia(const { Name::new_inline("J1") }, &engine, self.J1),
            Element::Torque(Torque {
                name: const { Name::new_inline("engine") },
                node: engine.clone(),
                input: const { Name::new_inline(ENGINE_TORQUE) },
                reaction: None,
                number: PhantomData,
            }),
            Element::Gear(Gear {
                loss: Some(GearLoss::by_efficiency(self.loss_law, self.eta)),
                ..gear(const { Name::new_inline("i_in") }, &engine, &input, self.i_in)
            }),
            inertia(const { Name::new_inline("J2e") }, &input, self.J2e * self.i_in * self.i_in),
            inertia(const { Name::new_inline("J_out") }, &output, self.J_out),
            Element::SpringDamper(SpringDamper {
                name: const { Name::new_inline(SHAFT) },
                a: output.clone(),
                b: axle.clone(),
                stiffness: self.k_o,
                damping: self.c_o,
            }),
            Element::Gear(gear(const { Name::new_inline("i_f") }, &axle, &wheel, self.i_f)),
            inertia(const { Name::new_inline("J_v") }, &wheel, self.J_v),
        ]);
        for element in &self.elements {
            elements.extend(element.path(&input, &output));
        }
        // Last: whether it holds the vehicle follows from its values, and shift elements keep their places.
        elements.push(Element::RoadLoad(RoadLoad {
            name: const { Name::new_inline("load") },
            node: wheel,
            constant: self.load.constant,
            rolling: self.load.rolling,
            aero: self.load.aero,
        }));
        Driveline { elements }
    }
}

impl<T: Number> ShiftElement<T> {
    /// Gear i_c, clutch, gear i_out between the input gear and the output (paper Figure 2).
    fn path(&self, input: &Name, output: &Name) -> [Element<T>; 3] {
        let (a, b) = (joined(&self.name, " input side"), joined(&self.name, " output side"));
        [
            Element::Gear(gear(joined("i_c ", &self.name), input, &a, self.i_c)),
            Element::Clutch(Clutch {
                name: self.name.clone(),
                a,
                b: b.clone(),
                friction: self.friction.clone(),
                gain: self.gain,
                p0: self.p0,
                peak: self.peak,
                pressure: self.name.clone(),
                drum_inertia: self.drum_inertia,
                drag: None,
            }),
            Element::Gear(gear(joined("i_out ", &self.name), &b, output, self.i_out)),
        ]
    }
}

fn joined(first: &str, second: &str) -> Name {
    let mut name = SmolStrBuilder::new();
    name.push_str(first);
    name.push_str(second);
    name.finish()
}

fn inertia<T: Number>(name: Name, node: &Name, inertia: T) -> Element<T> {
    Element::Inertia(Inertia { name, node: node.clone(), inertia })
}

fn gear<T: Number>(name: Name, a: &Name, b: &Name, ratio: T) -> Gear<T> {
    Gear { name, a: a.clone(), b: b.clone(), ratio, loss: None, losses: None }
}
