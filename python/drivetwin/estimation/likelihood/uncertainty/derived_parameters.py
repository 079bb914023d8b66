# SPDX-License-Identifier: MIT
"""Reported parameters as functions of the unknowns of the fit, and what would narrow them.

J′_g = Je + Jo′/i_g²                                 (THEORY section 4)
J4 = (Je + Σ I_drum·(a - b/i)²)·i² + Jo′,  J5 = J_v/i_f²,  1/J = 1/J4 + 1/J5
ω_n² = k_o/J,  ζ = c_o/(2·sqrt(J·k_o))               (eqs. 12-14 read backwards)

With C the total covariance of unknowns and amounts of the effects, y a parameter and u a number of
the card (parameter, effect or tolerance), the interval of y after u is known exactly shrinks by the
share of the variance that u does not explain (conditional variance of a normal distribution):

    var(y | u) = C_yy - C_yu·C_uu⁻¹·C_uy
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray, propagate_variance
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.direct.friction_law import evaluate_stribeck
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.parametrization import (
    LAW,
    LOG_SPECIFIC,
    DualClutchPlant,
    DualClutchProblem,
)
from drivetwin.estimation.result.cause import Group
from drivetwin.estimation.result.estimate import CardNumber, CardNumberKind
from drivetwin.likelihood.point import ParameterVector
from drivetwin.parameters import OVER_ETA, get_parameter_spec, make_law_id
from drivetwin.simulation.linearize import compute_lockup_oscillation

TORQUE_LIKE = ("J_prime", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "drum", "mu_gain")
"""Stems of parameters that share the one scale that only an output torque shows."""
DIRECT = ("J_out", "te_delay", "J_vehicle", "Tv_over_if", "k_o", "c_o")
"""Unknowns that are parameters themselves."""


def compute_parameters(
    problem: DualClutchProblem,
    point: ParameterVector,
    signals: Sequence[ShiftSignals],
    slips: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Compute every reported parameter by id at `point`, in reporting order.

    `slips` are those [rad/s] at which μ·gain is reported, by element; without it none is.
    """
    structures = [term.plant for term in problem.terms]
    first = structures[0]
    values = {"eta": first.get_value(point, "eta")}
    for structure, s in zip(structures, signals, strict=True):
        before, after = structure.compute_ratio_before(point), structure.compute_ratio_after(point)
        for gear, ratio in ((s.shift.start_gear, before), (s.shift.end_gear, after)):
            J_out = structure.get_value(point, "J_out")
            values[f"J_prime_{gear}"] = structure.get_value(point, "J_e") + J_out / ratio**2
    for name in DIRECT:
        values |= {make_log_id(name, one.log): one.get_value(point, name) for one in structures}
    for structure, s in zip(structures, signals, strict=True):
        model, gear = structure.build_model(point), s.shift.end_gear
        added = structure.build_added_elements(point, model)
        oncoming = structure.driveline.oncoming.name
        ringing = compute_lockup_oscillation(model, oncoming, added.front)
        values |= {f"f_d_{gear}": ringing.frequency, f"zeta_{gear}": ringing.damping}
        for element in structure.elements:
            values[f"P0.{element.name}"] = structure.get_value(point, f"{element.name}.P0")
        for element in structure.elements:
            if element.name in (slips or {}):
                mu = compute_friction(structure, point, element.name, (slips or {})[element.name])
                values[f"mu_gain.{element.name}"] = element.gain * mu
    for element in structures[0].driveline.drums:
        values[f"drum.{element.name}"] = first.get_value(point, f"{element.name}.drum")
    for structure in structures:
        values |= {
            name: point[name] for name in structure.driveline.ratio_priors if name in point.names
        }
    values |= first.compute_added_element_values(point, first.build_model(point))
    return values if signals[0].scale_known else _rename_over_eta(values)


def compute_friction(
    structure: DualClutchPlant, point: ParameterVector, element: str, slip: float
) -> float:
    """Compute μ of an element at one slip [rad/s]."""
    theta = np.array(structure.get_law(point, element))
    return float(evaluate_stribeck(theta, np.array([slip]))[0][0])


def compute_laws(problem: DualClutchProblem, point: ParameterVector) -> dict[str, float]:
    """Compute the coefficients of the friction laws of all elements, by `make_law_id`."""
    return {
        make_law_id(element.name, key): value
        for term in problem.terms
        for element in term.plant.elements
        for key, value in zip(LAW, term.plant.get_law(point, element.name), strict=True)
    }


def make_log_id(name: str, log: int) -> str:
    """Return the id of a parameter in one of several logs, numbered from 1; `name` if shared."""
    return f"{name}.{log}" if log and name in LOG_SPECIFIC else name


def _rename_over_eta(values: dict[str, float]) -> dict[str, float]:
    """Rename the parameters to ratios over η, for a log without an output torque (η = 1 in the
    model)."""
    return {
        name + OVER_ETA if get_parameter_spec(name).stem in TORQUE_LIKE else name: value
        for name, value in values.items()
        if name != "eta"
    }


def list_absolute_ids(signals: Sequence[ShiftSignals]) -> tuple[str, ...]:
    """Return the ids that are not identifiable without an output torque."""
    gears = dict.fromkeys(g for s in signals for g in (s.shift.start_gear, s.shift.end_gear))
    logs = dict.fromkeys(s.log for s in signals)
    others = [make_log_id(stem, log) for stem in TORQUE_LIKE if stem in DIRECT for log in logs]
    return ("eta", *(f"J_prime_{gear}" for gear in gears), *dict.fromkeys(others))


def compute_jacobian(
    problem: DualClutchProblem,
    point: ParameterVector,
    std: FloatArray,
    signals: Sequence[ShiftSignals],
) -> FloatArray:
    """Compute the derivative (q, p) of the parameters by central differences over a part of
    `std` (p,)."""
    return differentiate(lambda at: compute_parameters(problem, at, signals), point, std, problem)


_LEAST_STEP = 1e-8
"""Step over the value where its standard deviation is rounding: root of the rounding [ratio]."""


def differentiate(
    function: Callable[[ParameterVector], Mapping[str, float]],
    point: ParameterVector,
    std: FloatArray,
    problem: DualClutchProblem,
) -> FloatArray:
    """Compute the derivative (q, p) of quantities by central differences over a part of `std`
    (p,), one-sided at a bound of the `problem`."""
    columns = []
    for k, width in enumerate(np.maximum(0.01 * std, _LEAST_STEP * np.abs(point.values))):
        shift = np.zeros_like(std)
        shift[k] = width
        high = np.minimum(point.values + shift, problem.upper)
        low = np.maximum(point.values - shift, problem.lower)
        ahead, behind = (
            np.array(list(function(point.replace_values(x)).values())) for x in (high, low)
        )
        columns.append((ahead - behind) / (high[k] - low[k]))
    return np.column_stack(columns)


STATED = frozenset({"eta", "J_prime", "J_out", "J_vehicle", "P0", "drum", "ratio", "i_f"})
"""Stems of parameters that design, a test stand or a weighbridge can give."""


def rank_card_numbers(
    correction: Correction, ids: Sequence[str], jacobian: FloatArray
) -> dict[str, CardNumber]:
    """Find by parameter the number whose exact knowledge narrows its interval most.

    Parameters
    ----------
    correction : Correction
        Fit corrected for effects, with the covariance of unknowns and amounts.
    ids : sequence of str
        Parameter ids (k,).
    jacobian : FloatArray
        Derivatives (k, p) of the parameters by the unknowns.

    Returns
    -------
    dict of str to CardNumber
        One number each, never one of the same kind as the parameter; none for a parameter that no
        number narrows.
    """
    covariance = correction.joint_covariance
    rows = np.zeros((len(ids), len(covariance)))
    rows[:, : jacobian.shape[1]] = jacobian
    numbers = {
        **_list_parameters(ids, rows),
        **_list_amounts(correction, len(covariance)),
    }
    stems = np.array([get_parameter_spec(name).stem for name in ids])
    shares = np.zeros((len(ids), len(numbers)))
    variance = propagate_variance(rows, covariance)
    for column, (number, own) in enumerate(numbers.items()):
        cross = rows @ covariance @ own
        power = float(own @ covariance @ own)
        if power > 0.0:
            share = cross**2 / np.maximum(power * variance, np.finfo(float).tiny)
            shares[:, column] = np.where(stems == _get_stem(number), 0.0, np.minimum(share, 1.0))
    if not numbers:
        return {}
    best = np.argmax(shares, axis=1)
    listed = list(numbers)
    return {
        name: listed[k].set_share(float(np.sqrt(1.0 - shares[place, k])))
        for place, (name, k) in enumerate(zip(ids, best.tolist(), strict=True))
        if shares[place, k] > 0.0
    }


def _list_parameters(ids: Sequence[str], rows: FloatArray) -> dict[CardNumber, FloatArray]:
    """List the parameters that a card can state, each with its row (p+q,)."""
    return {
        CardNumber(CardNumberKind.PARAMETER, name): row
        for name, row in zip(ids, rows, strict=True)
        if get_parameter_spec(name).stem in STATED
    }


def _get_stem(number: CardNumber) -> str:
    """Return the kind of a parameter, empty for an effect or a sensor error."""
    is_parameter = number.kind is CardNumberKind.PARAMETER
    return get_parameter_spec(number.name).stem if is_parameter else ""


def _list_amounts(correction: Correction, size: int) -> dict[CardNumber, FloatArray]:
    """List the effects and sensor errors that have one size each, each with its row (p+q,).

    A random process and a group of several columns have no single number to state.
    """
    step, found = correction.step, {}
    for group in dict.fromkeys(step.columns.groups):
        columns = step.columns.find_columns(group)
        if len(columns) == 1 and not (group.effect is not None and EFFECTS[group.effect].random):
            row = np.zeros(size)
            row[step.moves.size + columns[0]] = 1.0
            found[_name_group(group)] = row
    return found


def _name_group(group: Group) -> CardNumber:
    if group.effect is None:
        return CardNumber(CardNumberKind.SENSOR, group.subject)
    return CardNumber(CardNumberKind.EFFECT, group.effect.value, group.subject)
