# SPDX-License-Identifier: MIT
"""Gain from one more exact number: a parameter, an effect or a sensor tolerance on the card.

With C the total covariance of unknowns and amounts of the effects, y a parameter and u the number,
the interval of y after u is known shrinks by the share of the variance that it does not explain
(conditional variance of a normal distribution):

    var(y | u) = C_yy - C_yu·C_uu⁻¹·C_uy
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.result.cause import Group
from drivetwin.estimation.result.suggestion import CardNumber, CardNumberKind
from drivetwin.parameters import get_parameter_spec

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
    variance = np.einsum("kp,pq,kq->k", rows, covariance, rows)
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
