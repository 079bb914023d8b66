// SPDX-License-Identifier: MIT
//! The state a run starts from, stated by names.

use crate::model::Name;
use crate::network::linalg::{Matrix, independent_rows, is_nothing, least_norm, solve};
use crate::network::nonlinear_torque::form;
use crate::network::{Network, SpeedForm};
use crate::number::{Number, Values};
use thiserror::Error;

/// Speeds of nodes, twists of shafts, and the elements that start without slip. Gears, elements without slip
/// and prescribed speeds determine what the stated speeds leave open.
#[derive(Clone, Debug, Default)]
pub struct Start<T> {
    /// Node and its speed, rad/s.
    pub speeds: Vec<(String, T)>,
    /// Shaft and its twist, rad; 0 where not stated.
    pub twists: Vec<(String, T)>,
    /// Friction elements brought to zero slip.
    pub locked: Vec<String>,
}

/// A start resolved against a network.
#[derive(Clone, Debug)]
pub struct State<T> {
    /// States (speeds, twists, lagging torques).
    pub x: Vec<T>,
    /// Indices of the friction elements without slip.
    pub locked: Vec<usize>,
    /// Change of the independent speeds per prescribed speed, speeds × prescribed speeds: the start leaves some
    /// to these.
    pub driven: Matrix<T>,
}

/// Reason why a start does not define a state.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StartError {
    /// A name that the network does not have.
    #[error("{kind} {name:?} is unknown; known are {known}")]
    Unknown {
        /// Kind of the name.
        kind: &'static str,
        /// The name.
        name: String,
        /// Accepted names.
        known: String,
    },
    /// A speed or twist that is no number.
    #[error("the start of {name:?} is not finite")]
    NotFinite {
        /// Node or shaft.
        name: String,
    },
    /// A power or energy among the outputs of a linear model.
    #[error("the {output} is no linear function of states and inputs")]
    NotLinear {
        /// The output.
        output: String,
    },
    /// Too few speeds.
    #[error(
        "the start leaves speeds undetermined: state the speed of {} as well, or lock an element \
         that determines it",
        missing.join(" and of ")
    )]
    Undetermined {
        /// Nodes whose speeds, stated as well, determine all.
        missing: Vec<String>,
    },
    /// A one-way clutch would slip in the direction that it blocks.
    #[error("{element} starts with a slip of {slip} rad/s in the direction that it blocks")]
    Overrun {
        /// The one-way clutch.
        element: String,
        /// Slip, rad/s.
        slip: f64,
    },
    /// An element to start without slip between members whose speeds are prescribed.
    #[error(
        "{element} starts locked, but with {} its slip is {slip:.4} rad/s; take {element} out of the \
         locked elements, or begin the prescribed speeds without that slip",
        drivers.join(" and ")
    )]
    LockContradicted {
        /// The locked element.
        element: String,
        /// Prescribed speeds and other locked elements that determine its slip.
        drivers: Vec<String>,
        /// Slip, rad/s.
        slip: f64,
    },
    /// Speeds that contradict the rigid couplings.
    #[error(
        "the start speed {stated} rad/s of {node:?} contradicts {}, with which gears make it \
         {implied} rad/s; leave one of them out",
        others.join(" and ")
    )]
    Contradiction {
        /// Node.
        node: String,
        /// Other nodes with stated speeds that determine this one.
        others: Vec<String>,
        /// As stated.
        stated: f64,
        /// As the other speeds imply.
        implied: f64,
    },
}

impl<T: Number> Start<T> {
    /// The state of a network.
    pub fn state(&self, network: &Network<T>) -> Result<State<T>, StartError> {
        let (speeds, twists) = (by_name(&self.speeds), by_name(&self.twists));
        state_of(network, &speeds, &twists, &self.locked)
    }

    /// Find the speed of a node or the twist of a shaft by its name.
    pub fn number_mut(&mut self, name: &str) -> Option<&mut T> {
        let mut numbers = self.speeds.iter_mut().chain(&mut self.twists);
        numbers.find(|(stated, _)| stated == name).map(|(_, number)| number)
    }
}

impl Start<f64> {
    /// Return true if the speed of a node or the twist of a shaft of this name is stated.
    pub(super) fn states(&self, name: &str) -> bool {
        self.speeds.iter().chain(&self.twists).any(|(stated, _)| stated == name)
    }

    /// Return true if both state the same names in one order.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        let same = |a: &[(String, f64)], b: &[(String, f64)]| {
            a.iter().map(|(name, _)| name).eq(b.iter().map(|(name, _)| name))
        };
        std::ptr::eq(self, other)
            || same(&self.speeds, &other.speeds)
                && same(&self.twists, &other.twists)
                && self.locked == other.locked
    }

    /// Join the starts of runs by their numbers. Names are those of run 0.
    pub(super) fn from_lanes<'s, T: Number>(of: impl Fn(usize) -> &'s Self) -> Start<T> {
        let first = of(0);
        let join = |list: fn(&Self) -> &[(String, f64)]| {
            let named = list(first).iter().enumerate();
            let number = |place: usize| {
                let value = |run| list(of(run)).get(place).map_or(f64::NAN, |stated| stated.1);
                T::from_lanes(value)
            };
            named.map(|(place, (name, _))| (name.clone(), number(place))).collect()
        };
        let (speeds, twists) = (join(|start| &start.speeds), join(|start| &start.twists));
        Start { speeds, twists, locked: first.locked.clone() }
    }
}

impl<T: Number> State<T> {
    /// Refuse a locked element whose slip follows from prescribed speeds, `prescribed` [rad/s] in their order,
    /// and is not zero.
    pub fn check_locks(&self, network: &Network<T>, prescribed: &[T]) -> Result<(), StartError> {
        let count = prescribed.len();
        if count == 0 {
            return Ok(());
        }
        let speeds = network.prescribed.iter().map(|(speed, _)| speed);
        let slips = self.locked.iter().map(|&j| &network.frictions[j].slip);
        let rows: Vec<&SpeedForm<T>> = speeds.chain(slips).collect();
        let kept = independent(&rows, network.speeds());
        let largest = prescribed.iter().fold(0.0, |l: f64, w| l.max(w.re().leading().abs()));
        for (i, &j) in (count..rows.len()).zip(&self.locked).filter(|(i, _)| !kept.contains(i)) {
            let weights = combination(&kept.iter().map(|&k| rows[k]).collect::<Vec<_>>(), rows[i]);
            let counts = |k: usize| weights[(k, 0)].re().decide(|weight| weight.abs() > 1e-9);
            let slip = (0..kept.len())
                .filter(|&k| kept[k] < count)
                .fold(T::zero_(), |sum, k| sum + weights[(k, 0)] * prescribed[kept[k]]);
            // The impulse of the start names what a blocking one-way clutch stands against.
            let blocks = network.frictions[j].one_way && slip.re().decide(|slip| slip > 0.0);
            if !blocks && slip.re().decide(|slip| slip.abs() > 1e-6 * (1.0 + largest)) {
                let name = |k: usize| match kept[k].checked_sub(count) {
                    None => format!(
                        "prescribed speed {}",
                        network.mechanism.prescribed[kept[k]].element
                    ),
                    Some(k) => format!("locked {}", network.frictions[self.locked[k]].element),
                };
                return Err(StartError::LockContradicted {
                    element: network.frictions[j].element.to_string(),
                    drivers: (0..kept.len()).filter(|&k| counts(k)).map(name).collect(),
                    slip: slip.re().leading(),
                });
            }
        }
        Ok(())
    }
}

/// Weights of `rows` in `row`, which is a combination of them; rows × 1.
fn combination<T: Number>(rows: &[&SpeedForm<T>], row: &SpeedForm<T>) -> Matrix<T> {
    let target = matrix(&[row], row.len()).transposed();
    least_norm(&matrix(rows, row.len()).transposed(), &target)
}

/// Values by the names of what has them.
type Stated<'n, T> = [(&'n str, T)];

fn by_name<T: Copy>(values: &[(String, T)]) -> Vec<(&str, T)> {
    values.iter().map(|(name, value)| (name.as_str(), *value)).collect()
}

/// The state of a network from speeds of nodes, twists of shafts and elements without slip, see [`Start`].
pub(super) fn state_of<T: Number>(
    network: &Network<T>,
    speeds: &Stated<'_, T>,
    twists: &Stated<'_, T>,
    locked: &[String],
) -> Result<State<T>, StartError> {
    let elements = network.frictions.iter().map(|f| &f.element);
    let indices = locked.iter().map(|name| find("friction element", name, elements.clone()));
    let indices = indices.collect::<Result<Vec<_>, _>>()?;
    let infinite = |(_, v): &&(&str, T)| v.re().decide(|v| !v.is_finite());
    if let Some((name, _)) = speeds.iter().chain(twists).find(infinite) {
        return Err(StartError::NotFinite { name: (*name).to_owned() });
    }
    let (mut x, driven) = speeds_of(network, speeds, &indices)?;
    for (j, friction) in network.frictions.iter().enumerate().filter(|(_, f)| f.one_way) {
        let slip = form(&friction.slip, &x).re();
        let moves = |k: usize| (0..driven.rows).any(|i| !is_nothing(driven[(i, k)]));
        let stated = !(0..driven.cols).any(moves);
        if stated && slip.decide(|slip| slip > 1e-9) && !indices.contains(&j) {
            let slip = slip.leading();
            return Err(StartError::Overrun { element: friction.element.to_string(), slip });
        }
    }
    x.resize(network.states(), T::zero_());
    let springs = network.mechanism.springs.iter().map(|s| &s.element);
    for &(name, twist) in twists {
        x[network.speeds() + find("shaft", name, springs.clone())?] = twist;
    }
    settle(network, &mut x);
    Ok(State { x, locked: indices, driven })
}

/// Bring the twists on members without mass and dampers into balance.
fn settle<T: Number>(network: &Network<T>, x: &mut [T]) {
    let Some(map) = network.balanced_twists() else { return };
    let mut twists = x[network.speeds()..network.first_lag()].to_vec();
    twists.push(T::of(1.0));
    for (i, twist) in x[network.speeds()..network.first_lag()].iter_mut().enumerate() {
        *twist = form(map.row(i), &twists);
    }
}

/// The independent speeds, from speeds of nodes, locked elements and prescribed speeds in this order, and
/// their change per prescribed speed.
fn speeds_of<T: Number>(
    network: &Network<T>,
    speeds: &Stated<'_, T>,
    locked: &[usize],
) -> Result<(Vec<T>, Matrix<T>), StartError> {
    let nodes = &network.mechanism.nodes;
    let mut stated = Vec::with_capacity(speeds.len());
    for &(name, speed) in speeds {
        let node = find("node", name, nodes.iter())?;
        // The speed of a follower is no state.
        if !network.is_follower(node) {
            stated.push((name, network.express_in_speeds(&[(node, T::of(1.0))]), speed));
        }
    }
    let given = stated.iter().map(|(_, row, _)| row);
    let locked = locked.iter().map(|&j| &network.frictions[j].slip);
    let prescribed = network.prescribed.iter().map(|(speed, _)| speed);
    let first_prescribed = stated.len() + locked.len();
    let rows: Vec<&SpeedForm<T>> = given.chain(locked).chain(prescribed).collect();
    let all = matrix(&rows, network.speeds());
    let keep = independent(&rows, network.speeds());
    if keep.len() < network.speeds() {
        return Err(StartError::Undetermined { missing: missing(network, &rows) });
    }
    let count = network.prescribed.len();
    let mut values = Matrix::zeros(rows.len(), 1 + count);
    for (i, (_, _, speed)) in stated.iter().enumerate() {
        values[(i, 0)] = *speed;
    }
    (0..count).for_each(|k| values[(first_prescribed + k, 1 + k)] = T::of(1.0));
    let v = solve(all.select_rows(&keep), values.select_rows(&keep));
    let v = v.map_err(|_| StartError::Undetermined { missing: missing(network, &rows) })?;
    let mut x = Vec::with_capacity(network.states());
    x.extend((0..v.rows).map(|i| v[(i, 0)]));
    for &(name, ref row, speed) in &stated {
        let (stated_speed, implied) = (speed.re(), form(row, &x).re());
        let contradicts =
            |stated: f64, implied: f64| (stated - implied).abs() > 1e-6 * (1.0 + stated.abs());
        if stated_speed.decide_with(implied, contradicts) {
            return Err(StartError::Contradiction {
                node: name.to_owned(),
                others: determining(&stated, &keep, row),
                stated: stated_speed.leading(),
                implied: implied.leading(),
            });
        }
    }
    Ok((x, v.select_columns(&(1..=count).collect::<Vec<_>>())))
}

/// Rows that are independent of those before them.
fn independent<T: Number>(rows: &[&SpeedForm<T>], width: usize) -> Vec<usize> {
    let sizes: Vec<T> = rows.iter().map(|row| row.size).collect();
    independent_rows(&matrix(rows, width), &sizes)
}

fn matrix<T: Number>(rows: &[&SpeedForm<T>], width: usize) -> Matrix<T> {
    let mut all = Matrix::zeros(rows.len(), width);
    for (i, row) in rows.iter().enumerate() {
        all.row_mut(i).copy_from_slice(row);
    }
    all
}

/// Nodes whose speeds determine all together with rows over the speeds.
fn missing<T: Number>(network: &Network<T>, rows: &[&SpeedForm<T>]) -> Vec<String> {
    let nodes = &network.coordinates.independent;
    let own: Vec<_> =
        nodes.iter().map(|&node| network.express_in_speeds(&[(node, T::of(1.0))])).collect();
    let all: Vec<&SpeedForm<T>> = rows.iter().copied().chain(&own).collect();
    let kept = independent(&all, network.speeds()).into_iter();
    let names = kept.filter_map(|row| nodes.get(row.checked_sub(rows.len())?));
    names.map(|&node| network.mechanism.nodes[node].to_string()).collect()
}

/// Of the nodes with stated speeds that were kept, those that a row is a combination of.
fn determining<T: Number>(
    stated: &[(&str, SpeedForm<T>, T)],
    keep: &[usize],
    row: &SpeedForm<T>,
) -> Vec<String> {
    let kept: Vec<_> = keep.iter().filter_map(|&i| stated.get(i)).collect();
    let weights = combination(&kept.iter().map(|(_, row, _)| row).collect::<Vec<_>>(), row);
    let counts = |i: &usize| weights[(*i, 0)].re().decide(|weight| weight.abs() > 1e-9);
    (0..kept.len()).filter(counts).map(|i| format!("that of {:?}", kept[i].0)).collect()
}

/// Index of a name among the known ones.
pub(super) fn find<'n>(
    kind: &'static str,
    name: &str,
    known: impl Iterator<Item = &'n Name> + Clone,
) -> Result<usize, StartError> {
    known.clone().position(|k| k == name).ok_or_else(|| {
        let names: Vec<&str> = known.map(Name::as_str).collect();
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        StartError::Unknown { kind, name: name.to_owned(), known }
    })
}
