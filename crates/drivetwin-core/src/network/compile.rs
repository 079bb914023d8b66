// SPDX-License-Identifier: MIT
//! From the stated mechanism to matrices in minimal coordinates.

use super::constraints::{Coordinates, Followers, SpeedForm, coordinates};
use super::error::CompileError;
use super::linalg::{Matrix, independent_rows, is_nothing, solve};
use super::mode::{ModeKey, Motion};
use super::nonlinear_torque::{NonlinearTorque, TorqueLaw, form};
use super::table_loss::TableLoss;
use crate::model::mechanism::{Account, ForceLaw, Loss, Mechanism, Normal, Row, SpringLaw};
use crate::model::{Driveline, FrictionLaw, Name};
use crate::number::Number;

/// Most friction elements and lossy gears together: the bits of a mode key.
pub const MAX_ROWS: usize = 32;

/// Inertia given to a massless member between friction elements, relative to the largest inertia: it then
/// follows whichever element is stronger, within nanoseconds.
const MASSLESS: f64 = 1e-12;

/// Compiled friction element.
#[derive(Clone, Debug)]
pub struct FrictionElement<T> {
    /// Name for messages and events.
    pub element: Name,
    /// Slip over the independent speeds.
    pub slip: SpeedForm<T>,
    /// Slip over the nodes; its negative is the direction of the torque.
    pub nodes: Row<T>,
    /// μ over |slip|.
    pub law: FrictionLaw<T>,
    /// Factor of μ.
    pub normal: Normal<T>,
    /// Static over kinetic capacity.
    pub peak: T,
    /// Positive slip is blocked.
    pub one_way: bool,
}

/// Compiled lossy gear.
#[derive(Clone, Debug)]
pub struct LossyGear<T> {
    /// Name for messages and events.
    pub element: Name,
    /// Index of its constraint.
    pub constraint: usize,
    /// Its loss.
    pub loss: Loss<T>,
    /// Speed of the driving side over the independent speeds.
    pub speed: SpeedForm<T>,
}

/// A torque that is a channel or a lagging state.
#[derive(Clone, Debug)]
pub struct AppliedTorque<T> {
    /// Element that it belongs to.
    pub element: Name,
    /// Position of its value in the basis.
    pub basis: usize,
    /// Nodes it acts on.
    pub nodes: Row<T>,
    /// Energy account of its work; none for compliances.
    pub account: Option<Account>,
}

/// A first-order lag: `y' = (target - y) / time`.
#[derive(Clone, Debug)]
pub struct FirstOrderLag<T> {
    /// Position of the target in the basis.
    pub target: usize,
    /// Time constant, s.
    pub time: T,
}

/// A compiled mechanism; immutable.
#[derive(Clone, Debug)]
pub struct Network<T> {
    /// Mechanism the network was compiled from.
    pub mechanism: Mechanism<T>,
    /// See [`Network::states`].
    states: usize,
    /// Independent speeds and their map to all nodes.
    pub coordinates: Coordinates<T>,
    /// Kinetic energy over the nodes, `½ ωᵀ I ω`.
    pub inertia: Matrix<T>,
    /// Kinetic energy over the independent speeds, `½ vᵀ M v`.
    pub mass: Matrix<T>,
    /// Rates of twist over the independent speeds, or with followers over the basis; springs × terms.
    pub twist_rates: Matrix<T>,
    /// Friction elements; element j is channel j.
    pub frictions: Vec<FrictionElement<T>>,
    /// Lossy gears.
    pub losses: Vec<LossyGear<T>>,
    /// Gears with tables of losses.
    pub table_losses: Vec<TableLoss>,
    /// Prescribed speeds over the independent speeds, and their inputs.
    pub prescribed: Vec<(SpeedForm<T>, usize)>,
    /// Scalar channels: frictions first.
    pub channels: Vec<NonlinearTorque<T>>,
    /// Torques that are channels other than friction, or lagging states.
    pub applied_torques: Vec<AppliedTorque<T>>,
    /// Lags; their states come after speeds and twists.
    pub lags: Vec<FirstOrderLag<T>>,
    /// Node torques of everything but rigid couplings and stuck friction, over the basis: nodes ×
    /// basis.
    pub node_torques: Matrix<T>,
    /// Independent speeds of members without mass between friction elements, which got [`MASSLESS`].
    pub massless: Vec<usize>,
    /// Members without mass between compliances, where there are any.
    pub followers: Option<Followers<T>>,
    /// Matrices shared by all modes if no gear loss depends on its state.
    pub(super) motion: Option<Motion<T>>,
}

impl<T: Number> Network<T> {
    /// Compile a driveline.
    pub fn compile(driveline: &Driveline<T>) -> Result<Self, CompileError> {
        Self::from_mechanism(driveline.mechanism()?)
    }

    /// Compile a stated mechanism.
    pub fn from_mechanism(mechanism: Mechanism<T>) -> Result<Self, CompileError> {
        let lossy = mechanism.constraints.iter().filter(|c| c.loss.is_some()).count();
        let count = mechanism.frictions.len() + lossy;
        if count > MAX_ROWS {
            return Err(CompileError::TooManyRows { count, limit: MAX_ROWS });
        }
        let coordinates = coordinates(&mechanism)?;
        let empty = Matrix::zeros(0, 0);
        let mut network = Self {
            states: 0,
            inertia: node_inertia(&mechanism),
            mass: empty.clone(),
            twist_rates: empty.clone(),
            node_torques: empty,
            coordinates,
            mechanism,
            frictions: Vec::new(),
            losses: Vec::new(),
            table_losses: Vec::new(),
            prescribed: Vec::new(),
            channels: Vec::new(),
            applied_torques: Vec::new(),
            lags: Vec::new(),
            massless: Vec::new(),
            followers: None,
            motion: None,
        };
        network.count_states();
        network.set_mass();
        let given = network.give_mass_between_frictions();
        if !given.is_empty() {
            network.set_mass();
        }
        network.eliminate_massless()?;
        let places = network.coordinates.independent.iter().enumerate();
        network.massless =
            places.filter(|(_, node)| given.contains(node)).map(|(j, _)| j).collect();
        network.refuse_massless()?;
        network.add_rows();
        network.refuse_prescribed_twice()?;
        network.add_applied_torques();
        network.node_torques = network.assemble_node_torques();
        if !network.losses.iter().any(|gear| gear.loss.is_directional()) {
            network.motion = network.motion(ModeKey::default());
        }
        Ok(network)
    }

    /// Number of independent speeds.
    pub fn speeds(&self) -> usize {
        self.coordinates.independent.len()
    }

    /// Position of the first lagging torque among the states.
    pub fn first_lag(&self) -> usize {
        self.speeds() + self.mechanism.springs.len()
    }

    /// Number of states: speeds, twists, lagging torques.
    pub fn states(&self) -> usize {
        self.states
    }

    /// Position of the first input in the basis (x, u, prescribed accelerations, 1, φ).
    pub fn first_input(&self) -> usize {
        self.states()
    }

    /// Position of the first prescribed acceleration in the basis.
    pub fn first_rate(&self) -> usize {
        self.first_input() + self.mechanism.inputs.len()
    }

    /// Position of the constant 1 in the basis.
    pub fn one(&self) -> usize {
        self.first_rate() + self.mechanism.prescribed.len()
    }

    /// Position of the first channel in the basis.
    pub fn first_channel(&self) -> usize {
        self.one() + 1
    }

    /// Length of the basis.
    pub fn basis(&self) -> usize {
        self.first_channel() + self.channels.len()
    }

    /// True if an input is itself a torque or the target of a lagging torque, not only a pressure.
    pub fn is_driven_by(&self, input: usize) -> bool {
        let position = self.first_input() + input;
        let turns =
            |i: usize| self.twist_rates.row(i).get(position).is_some_and(|&rate| !is_nothing(rate));
        (0..self.twist_rates.rows).any(turns)
            || self.lags.iter().any(|lag| lag.target == position)
            || (0..self.node_torques.rows).any(|i| !is_nothing(self.node_torques[(i, position)]))
    }

    /// A linear form over nodes, expressed over the independent speeds.
    pub fn express_in_speeds(&self, row: &[(usize, T)]) -> SpeedForm<T> {
        self.coordinates.form(row)
    }

    /// A linear form over nodes, expressed over the basis as far as it has terms.
    pub fn over_basis(&self, row: &[(usize, T)]) -> Vec<T> {
        let mut form = self.express_in_speeds(row).to_vec();
        if let Some(Followers { speeds, .. }) = &self.followers {
            form.resize(speeds.cols, T::zero_());
            for &(node, c) in row {
                form.iter_mut().zip(speeds.row(node)).for_each(|(sum, &v)| *sum += c * v);
            }
        }
        form
    }

    /// Speed of a node at an instant, rad/s.
    pub fn node_speed_at(&self, node: usize, basis: &[T]) -> T {
        let own = form(self.coordinates.speeds.row(node), basis);
        self.followers.as_ref().map_or(own, |f| own + form(f.speeds.row(node), basis))
    }

    /// Return true if the speed of a node is no state: it follows from the balance of torques.
    pub fn is_follower(&self, node: usize) -> bool {
        let followers = self.followers.as_ref();
        followers.is_some_and(|f| f.speeds.row(node).iter().any(|&v| !is_nothing(v)))
    }

    /// Normal load of friction element `j` as `gain (basis[input] - p0)`: input, gain, p0.
    pub fn load_of(&self, j: usize) -> (usize, T, T) {
        match self.frictions[j].normal {
            Normal::Pressure { input, gain, p0 } => (self.first_input() + input, gain, p0),
            Normal::Constant(normal) => (self.one(), normal, T::zero_()),
        }
    }

    fn node_speed(&self, node: usize) -> SpeedForm<T> {
        self.express_in_speeds(&[(node, T::of(1.0))])
    }

    pub(super) fn count_states(&mut self) {
        let lags = self.mechanism.forces.iter().filter(|force| force.lag.is_some()).count();
        self.states = self.speeds() + self.mechanism.springs.len() + lags;
    }

    pub(super) fn set_mass(&mut self) {
        let n = &self.coordinates.speeds;
        self.mass = n.transposed().times(&self.inertia).times(n);
    }

    /// Independent speed of a direction without mass, if there is one.
    fn massless_speed(&self) -> Option<usize> {
        solve(self.mass.clone(), Matrix::zeros(self.mass.rows, 0)).err()
    }

    /// Members without mass between friction elements get a negligible one; their nodes. Behind one element alone
    /// there is nothing to follow while it is open.
    fn give_mass_between_frictions(&mut self) -> Vec<usize> {
        let floor = T::promote(self.inertia.max_abs() * MASSLESS);
        let mut given = Vec::new();
        for j in (0..self.speeds()).filter(|&j| is_nothing(self.mass[(j, j)])) {
            let node = self.coordinates.independent[j];
            let touches = |row: &Row<T>| {
                row.iter().any(|&(n, _)| !is_nothing(self.coordinates.speeds[(n, j)]))
            };
            let rubbed = self.mechanism.frictions.iter().filter(|f| touches(&f.row)).count() > 1;
            let sprung = self.mechanism.springs.iter().any(|s| touches(&s.row));
            if rubbed && !sprung {
                self.inertia[(node, node)] += floor;
                given.push(node);
            }
        }
        given
    }

    fn refuse_massless(&self) -> Result<(), CompileError> {
        let Some(column) = self.massless_speed() else { return Ok(()) };
        let n = &self.coordinates.speeds;
        let moved = |&node: &usize| !is_nothing(n[(node, column)]);
        let members =
            (0..n.rows).filter(moved).map(|i| self.mechanism.nodes[i].to_string()).collect();
        Err(CompileError::Massless { members })
    }

    fn refuse_prescribed_twice(&self) -> Result<(), CompileError> {
        let mut rows = Matrix::zeros(self.prescribed.len(), self.speeds());
        for (i, (speed, _)) in self.prescribed.iter().enumerate() {
            rows.row_mut(i).copy_from_slice(speed);
        }
        let sizes: Vec<T> = self.prescribed.iter().map(|(speed, _)| speed.size).collect();
        if independent_rows(&rows, &sizes).len() == rows.rows {
            return Ok(());
        }
        let elements = self.mechanism.prescribed.iter().map(|p| p.element.to_string()).collect();
        Err(CompileError::PrescribedTwice { elements })
    }

    /// Everything that is a linear form over the speeds: twists, slips, gears, prescribed speeds.
    fn add_rows(&mut self) {
        let width = self.followers.as_ref().map_or(self.speeds(), |f| f.speeds.cols);
        self.twist_rates = Matrix::zeros(self.mechanism.springs.len(), width);
        for i in 0..self.mechanism.springs.len() {
            let rate = self.over_basis(&self.mechanism.springs[i].row);
            self.twist_rates.row_mut(i).copy_from_slice(&rate);
        }
        for f in &self.mechanism.frictions {
            let slip = self.express_in_speeds(&f.row);
            let (mu, normal) = (f.law.clone(), f.normal.clone());
            self.channels.push(NonlinearTorque {
                law: TorqueLaw::Friction { mu, normal, peak: f.peak },
                arguments: vec![self.over_states(&slip)],
            });
            self.frictions.push(FrictionElement {
                element: f.element.clone(),
                slip,
                nodes: f.row.clone(),
                law: f.law.clone(),
                normal: f.normal.clone(),
                peak: f.peak,
                one_way: f.one_way,
            });
        }
        for (constraint, c) in self.mechanism.constraints.iter().enumerate() {
            if let Some(loss) = c.loss.clone() {
                let (element, speed) = (c.element.clone(), self.node_speed(loss.driving));
                self.losses.push(LossyGear { element, constraint, loss, speed });
            }
        }
        for p in &self.mechanism.prescribed {
            self.prescribed.push((self.node_speed(p.node), p.input));
        }
    }

    fn over_states(&self, speeds: &[T]) -> Vec<T> {
        let mut row = Vec::with_capacity(self.states());
        row.extend_from_slice(speeds);
        row.resize(self.states(), T::zero_());
        row
    }

    /// Torques that are no linear function of the state and inputs become channels; lags become
    /// states.
    fn add_applied_torques(&mut self) {
        for (i, spring) in self.mechanism.springs.iter().enumerate() {
            if let SpringLaw::Regions { regions, .. } = &spring.law {
                let mut twist = vec![T::zero_(); self.states()];
                twist[self.speeds() + i] = T::of(1.0);
                let arguments = vec![twist, self.over_states(self.twist_rates.row(i))];
                let basis = self.basis();
                self.channels
                    .push(NonlinearTorque { law: TorqueLaw::Regions(regions.clone()), arguments });
                let nodes = spring.row.iter().map(|&(node, c)| (node, -c)).collect();
                let element = spring.element.clone();
                self.applied_torques.push(AppliedTorque { element, basis, nodes, account: None });
            }
        }
        for force in &self.mechanism.forces {
            let mut basis = match force.law {
                ForceLaw::Input(input) => self.first_input() + input,
                ForceLaw::Constant(_) => self.one(),
                // That of the channel to come.
                _ => self.basis(),
            };
            if let ForceLaw::Loss { constraint: Some(constraint), map, .. } = &force.law {
                let (constraint, channel, map) = (*constraint, self.channels.len(), map.clone());
                let element = force.element.clone();
                self.table_losses.push(TableLoss { element, constraint, channel, map });
            }
            self.channels.extend(self.channel_of(&force.law));
            if let Some(time) = force.lag {
                self.lags.push(FirstOrderLag { target: basis, time });
                basis = self.first_lag() + self.lags.len() - 1;
            }
            if let ForceLaw::Constant(_) = force.law {
                continue;
            }
            let (nodes, element) = (force.nodes.clone(), force.element.clone());
            let account = Some(force.account);
            self.applied_torques.push(AppliedTorque { element, basis, nodes, account });
        }
    }

    /// The channel of a force law, where it needs one.
    fn channel_of(&self, law: &ForceLaw<T>) -> Option<NonlinearTorque<T>> {
        let over = |node| self.over_states(&self.node_speed(node));
        Some(match law {
            ForceLaw::Input(_) | ForceLaw::Constant(_) => return None,
            ForceLaw::Quadratic { coefficient, node } => NonlinearTorque {
                law: TorqueLaw::Quadratic(*coefficient),
                arguments: vec![over(*node)],
            },
            ForceLaw::Map { input, node, map } => NonlinearTorque {
                law: TorqueLaw::Map { input: *input, map: map.clone() },
                arguments: vec![over(*node)],
            },
            ForceLaw::Converter { pump, turbine, map, at_turbine } => NonlinearTorque {
                law: TorqueLaw::Converter { map: map.clone(), at_turbine: *at_turbine },
                arguments: vec![over(*pump), over(*turbine)],
            },
            ForceLaw::Slip { wheel, road, stiffness, least_speed } => {
                let (wheel, road) = (over(*wheel), over(*road));
                let slip = wheel.iter().zip(&road).map(|(&w, &r)| w - r).collect();
                let law = TorqueLaw::Slip { stiffness: *stiffness, least_speed: *least_speed };
                NonlinearTorque { law, arguments: vec![slip, road] }
            }
            ForceLaw::Loss { slip, constraint, map } => NonlinearTorque {
                law: TorqueLaw::Loss { map: map.clone(), coupled: constraint.is_some() },
                arguments: vec![self.over_states(&self.express_in_speeds(slip))],
            },
        })
    }

    fn assemble_node_torques(&self) -> Matrix<T> {
        let mut f = Matrix::zeros(self.mechanism.nodes.len(), self.basis());
        for (i, spring) in self.mechanism.springs.iter().enumerate() {
            if let SpringLaw::Linear { stiffness, damping } = spring.law {
                for &(node, direction) in &spring.row {
                    self.add_twist(
                        self.balanced_twists(),
                        i,
                        -direction * stiffness,
                        f.row_mut(node),
                    );
                    for (j, &rate) in self.twist_rates.row(i).iter().enumerate() {
                        f[(node, j)] -= direction * damping * rate;
                    }
                }
            }
        }
        for (j, row) in self.frictions.iter().enumerate() {
            for &(node, direction) in &row.nodes {
                f[(node, self.first_channel() + j)] -= direction;
            }
        }
        for force in &self.mechanism.forces {
            if let ForceLaw::Constant(torque) = force.law {
                for &(node, way) in &force.nodes {
                    f[(node, self.one())] += way * torque;
                }
            }
        }
        for drive in &self.applied_torques {
            for &(node, direction) in &drive.nodes {
                f[(node, drive.basis)] += direction;
            }
        }
        f
    }
}

fn node_inertia<T: Number>(m: &Mechanism<T>) -> Matrix<T> {
    let mut inertia = Matrix::zeros(m.nodes.len(), m.nodes.len());
    for term in &m.inertias {
        for &(i, a) in &term.row {
            for &(j, b) in &term.row {
                inertia[(i, j)] += a * b * term.inertia;
            }
        }
    }
    inertia
}
