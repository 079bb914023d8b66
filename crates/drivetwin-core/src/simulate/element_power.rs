// SPDX-License-Identifier: MIT
//! Powers and stored energy of elements at an instant.

use crate::model::Name;
use crate::model::mechanism::{Account, ForceLaw, SpringLaw, Stop};
use crate::network::linalg::is_zero;
use crate::network::nonlinear_torque::form;
use crate::network::{GearState, Mode, Network};
use crate::number::{Number, Values};
use crate::solver::HybridState;
use std::sync::Arc;

/// Nodes and weights of Gauss-Legendre quadrature with six points on [0, 1]: over a Taylor step, in which a
/// motion turns by less than 1 rad, powers are exact to round-off.
pub(super) const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_424_03, 0.085_662_246_189_585_14),
    (0.169_395_306_766_867_76, 0.180_380_786_524_069_36),
    (0.380_690_406_958_401_56, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_2, 0.180_380_786_524_069_36),
    (0.966_234_757_101_575_9, 0.085_662_246_189_585_14),
];

/// Kind of a power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PowerKind {
    /// Brought in by a source.
    Source,
    /// Taken by a load.
    Load,
    /// Friction heat.
    Friction,
    /// Lost in a gear.
    Gear,
    /// Heat of a damper.
    Damper,
    /// Heat of a converter or tyre.
    Converter,
}

impl PowerKind {
    /// Return true for a power that becomes heat in its element.
    pub fn is_heat(self) -> bool {
        !matches!(self, Self::Source | Self::Load)
    }
}

/// Hand torque [N·m] and speed [rad/s] of every power of all elements, or of one, at an instant to `add`.
pub(super) fn visit_powers<T: Number>(
    state: &HybridState<'_, T>,
    basis: &[T],
    only: Option<&Name>,
    mut add: impl FnMut(PowerKind, T, T),
) {
    let network = state.network;
    let wanted = |element: &Name| only.is_none_or(|name| name == element);
    let speed = |node| network.node_speed_at(node, basis);
    for (j, row) in network.frictions.iter().enumerate().filter(|(_, f)| wanted(&f.element)) {
        let torque = basis[network.first_channel() + j];
        add(PowerKind::Friction, torque, form(&row.slip, basis));
    }
    for force in network.mechanism.forces.iter().filter(|f| wanted(&f.element)) {
        if let ForceLaw::Constant(torque) = force.law {
            let along =
                force.nodes.iter().fold(T::zero_(), |sum, &(node, way)| sum + way * speed(node));
            add(PowerKind::Load, -torque, along);
        }
    }
    for applied in network.applied_torques.iter().filter(|a| wanted(&a.element)) {
        let along =
            applied.nodes.iter().fold(T::zero_(), |sum, &(node, way)| sum + way * speed(node));
        let torque = basis[applied.basis];
        match applied.account {
            Some(Account::Source) => add(PowerKind::Source, torque, along),
            Some(Account::Load) => add(PowerKind::Load, -torque, along),
            Some(Account::Converter) => add(PowerKind::Converter, -torque, along),
            Some(Account::Gear) => add(PowerKind::Gear, -torque, along),
            Some(Account::Drag) => add(PowerKind::Friction, -torque, along),
            None => add(PowerKind::Damper, -torque, along),
        }
    }
    let springs = network.mechanism.springs.iter().enumerate();
    for (i, spring) in springs.filter(|(_, s)| wanted(&s.element)) {
        let rate = form(network.twist_rates.row(i), basis);
        let twist = basis[network.speeds() + i];
        let torque = match &spring.law {
            SpringLaw::Linear { damping, .. } => *damping * rate,
            // The work of the channel less what the stops store.
            SpringLaw::Regions { stops, .. } => {
                let stored = |stop: &Stop<T>| depth(stop, twist) * stop.stiffness * stop.side;
                stops.iter().fold(T::zero_(), |sum, stop| sum - stored(stop))
            }
        };
        add(PowerKind::Damper, torque, rate);
    }
    let prescribed = network.prescribed.iter().zip(&network.mechanism.prescribed).enumerate();
    for (i, ((row, _), _)) in prescribed.filter(|(_, (_, p))| wanted(&p.element)) {
        let reaction = form(state.mode.stuck_torque.row(state.mode.stuck.len() + i), basis);
        add(PowerKind::Source, -reaction, form(row, basis));
    }
    for (i, gear) in network.losses.iter().enumerate().filter(|(_, g)| wanted(&g.element)) {
        let torque = form(state.mode.gear_torque(network).row(i), basis);
        if let GearState::Meshing { sign, power_reversed } = state.gears[i] {
            let lost = gear.loss.loss_torque(torque, sign, power_reversed);
            add(PowerKind::Gear, lost, form(&gear.speed, basis));
        }
    }
}

/// Linear form: positions in the basis and coefficients.
type Terms<T> = Vec<(usize, T)>;

/// A power of one element.
#[derive(Clone, Debug)]
pub(super) struct ElementPower<T> {
    element: Name,
    /// Its nodes; none for the power that becomes heat.
    nodes: Option<Vec<usize>>,
    /// Torque and speed at each node in the present mode.
    ports: Vec<[Terms<T>; 2]>,
    mode: Option<Arc<Mode<T>>>,
}

impl<T: Number> ElementPower<T> {
    /// Power that becomes heat.
    pub fn heat(element: Name) -> Self {
        Self { element, nodes: None, ports: Vec::new(), mode: None }
    }

    /// Power that enters at the nodes, `-Σ torque · speed`.
    pub fn entering(network: &Network<T>, element: Name) -> Self {
        let nodes = Some(network.nodes_of(&element));
        Self { element, nodes, ports: Vec::new(), mode: None }
    }

    /// Take the torques of the mode of a state.
    pub fn enter_mode(&mut self, state: &HybridState<'_, T>) {
        let Some(nodes) = &self.nodes else { return };
        if self.mode.as_ref().is_some_and(|mode| Arc::ptr_eq(mode, &state.mode)) {
            return;
        }
        let (network, mode) = (state.network, &state.mode);
        let port = |&node: &usize| {
            let torque = terms(&mode.port_torque(network, &self.element, node));
            [torque, terms(&network.over_basis(&[(node, T::of(1.0))]))]
        };
        self.ports = nodes.iter().map(port).collect();
        self.mode = Some(Arc::clone(mode));
    }

    /// Evaluate at an instant of the mode that was entered, W.
    pub fn at(&self, state: &HybridState<'_, T>, basis: &[T]) -> T {
        if self.nodes.is_some() {
            return self.ports.iter().fold(T::zero_(), |sum, [torque, speed]| {
                sum - evaluate_terms(torque, basis) * evaluate_terms(speed, basis)
            });
        }
        let mut sum = T::zero_();
        visit_powers(state, basis, Some(&self.element), |kind, torque, speed| {
            if kind.is_heat() {
                sum += torque * speed;
            }
        });
        sum
    }
}

/// Terms of a row that are not zero.
pub(super) fn terms<T: Number>(row: &[T]) -> Terms<T> {
    row.iter().copied().enumerate().filter(|&(_, c)| !is_zero(c)).collect()
}

/// Value of a linear form.
pub(super) fn evaluate_terms<T: Number>(terms: &[(usize, T)], basis: &[T]) -> T {
    terms.iter().fold(T::zero_(), |sum, &(position, c)| sum + c * basis[position])
}

/// Kinetic and elastic energy that an element stores, J.
pub(super) fn element_energy<T: Number>(network: &Network<T>, element: &Name, basis: &[T]) -> T {
    let mut energy = T::zero_();
    for inertia in network.mechanism.inertias.iter().filter(|i| i.element == *element) {
        let speed = form(&network.over_basis(&inertia.row), basis);
        energy += inertia.inertia * speed * speed * 0.5;
    }
    let springs = network.mechanism.springs.iter().enumerate();
    for (i, spring) in springs.filter(|(_, s)| s.element == *element) {
        energy += spring_energy(&spring.law, basis[network.speeds() + i]);
    }
    energy
}

/// Elastic energy, J.
pub(super) fn spring_energy<T: Number>(law: &SpringLaw<T>, twist: T) -> T {
    match law {
        SpringLaw::Linear { stiffness, .. } => *stiffness * twist * twist * 0.5,
        SpringLaw::Regions { stops, .. } => stops.iter().fold(T::zero_(), |sum, stop| {
            let depth = depth(stop, twist);
            sum + depth * depth * stop.stiffness * 0.5
        }),
    }
}

/// Compression of a stop, rad.
fn depth<T: Number>(stop: &Stop<T>, twist: T) -> T {
    let depth = (twist - stop.at) * stop.side;
    if depth.re().decide(|depth| depth > 0.0) { depth } else { T::zero_() }
}
