// SPDX-License-Identifier: MIT
//! The linear system of a driveline about an operating point in one friction mode.

use super::output::Output;
use super::run::SimulateError;
use super::start::{StartError, find};
use crate::model::Name;
use crate::model::mechanism::Normal;
use crate::network::linalg::Matrix;
use crate::network::smooth_law::SmoothLaw;
use crate::network::{Branch, ModeKey, Network, RowId};

/// An element that slips at the operating point.
#[derive(Clone, Debug)]
pub struct Slipping {
    /// Its name.
    pub element: String,
    /// Slip, rad/s; its sign is that of the torque.
    pub slip: f64,
    /// Pressure, Pa; without meaning for elements of constant normal load.
    pub pressure: f64,
}

/// `x' = A x + B u`, `y = C x + D u` for small deviations from the operating point.
#[derive(Clone, Debug)]
pub struct Linear {
    /// States × states.
    pub a: Matrix<f64>,
    /// States × inputs.
    pub b: Matrix<f64>,
    /// Outputs × states.
    pub c: Matrix<f64>,
    /// Outputs × inputs.
    pub d: Matrix<f64>,
    /// Names of the states: nodes [rad/s], shafts [rad], lags [N·m].
    pub states: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
}

/// Linearise with `locked` elements at rest and others slipping as stated; elements that are in neither
/// list are open. Loads that depend on speed and laws without a slope at hand (maps, converters, tables
/// of twist and of losses) are taken as constant.
pub fn linearise(
    network: &Network<f64>,
    locked: &[String],
    slipping: &[Slipping],
    outputs: &[Output],
) -> Result<Linear, SimulateError> {
    let element =
        |name: &str| find("friction element", name, network.frictions.iter().map(|f| &f.element));
    let stuck = locked.iter().map(|name| element(name)).collect::<Result<Vec<_>, _>>()?;
    let capacity = vec![1.0; network.frictions.len()];
    let key = ModeKey::new(stuck.into_iter(), &[]);
    let mode = network.mode(key, &capacity).ok_or(SimulateError::Undetermined)?;
    let width = network.first_rate();
    let channels = channel_slopes(network, slipping)?;
    let over = |row: &[f64]| -> Vec<f64> {
        let mut out = row[..width].to_vec();
        for (j, &c) in row[network.first_channel()..].iter().enumerate() {
            out.iter_mut().zip(channels.row(j)).for_each(|(o, &p)| *o += c * p);
        }
        out
    };
    let n = network.states();
    let inputs = network.mechanism.inputs.len();
    let mut linear = Linear {
        a: Matrix::zeros(n, n),
        b: Matrix::zeros(n, inputs),
        c: Matrix::zeros(outputs.len(), n),
        d: Matrix::zeros(outputs.len(), inputs),
        states: state_names(network),
        inputs: network.mechanism.inputs.iter().map(Name::to_string).collect(),
    };
    for i in 0..n {
        let row = over(mode.derivative.row(i));
        linear.a.row_mut(i).copy_from_slice(&row[..n]);
        linear.b.row_mut(i).copy_from_slice(&row[n..]);
    }
    for (i, output) in outputs.iter().enumerate() {
        let torque = |j: usize| match mode.stuck.iter().position(|&s| s == RowId::Friction(j)) {
            Some(position) => mode.stuck_torque.row(position).to_vec(),
            None => {
                let mut row = vec![0.0; network.basis()];
                row[network.first_channel() + j] = 1.0;
                row
            }
        };
        let row = output.find(network)?.row(network, &mode, torque);
        let row = over(&row.ok_or_else(|| StartError::NotLinear { output: output.to_string() })?);
        linear.c.row_mut(i).copy_from_slice(&row[..n]);
        linear.d.row_mut(i).copy_from_slice(&row[n..]);
    }
    Ok(linear)
}

fn element(network: &Network<f64>, name: &str) -> Result<usize, StartError> {
    find("friction element", name, network.frictions.iter().map(|f| &f.element))
}

/// Slopes of the slipping elements' torques over states and inputs, channels × (states, inputs).
fn channel_slopes(
    network: &Network<f64>,
    slipping: &[Slipping],
) -> Result<Matrix<f64>, StartError> {
    let mut channels = Matrix::<f64>::zeros(network.channels.len(), network.first_rate());
    for point in slipping {
        let j = element(network, &point.element)?;
        let row = &network.frictions[j];
        let sign = if point.slip < 0.0 { -1.0 } else { 1.0 };
        let (normal, input) = match row.normal {
            Normal::Pressure { input, gain, p0 } => {
                ((gain * (point.pressure - p0)).max(0.0), Some((input, gain)))
            }
            Normal::Constant(normal) => (normal, None),
        };
        let branch = Branch::Moving { sign, piece: piece_of(network, j, point.slip.abs()) };
        let law = SmoothLaw::from_channel(&network.channels[j], branch)
            .expect("friction is smooth in a branch");
        let m = point.slip.abs() * law.unit;
        let torque = law.expand_at::<false>(m, law.stiction::<false>(m)).value_at_center(normal);
        for (entry, &c) in channels.row_mut(j).iter_mut().zip(row.slip.iter()) {
            *entry += torque.by_argument * law.unit * c;
        }
        if let Some((input, gain)) = input.filter(|_| normal > 0.0) {
            channels[(j, network.first_input() + input)] += sign * torque.by_normal * gain;
        }
    }
    Ok(channels)
}

fn piece_of(network: &Network<f64>, j: usize, slip: f64) -> usize {
    match &network.frictions[j].law {
        crate::model::FrictionLaw::Table(table) => table.cell(slip),
        crate::model::FrictionLaw::Stribeck(_) => 0,
    }
}

fn state_names(network: &Network<f64>) -> Vec<String> {
    let nodes =
        network.coordinates.independent.iter().map(|&i| network.mechanism.nodes[i].to_string());
    let shafts = network.mechanism.springs.iter().map(|spring| spring.element.to_string());
    let lags = (0..network.lags.len()).map(|i| format!("lag {}", i + 1));
    nodes.chain(shafts).chain(lags).collect()
}
