# SPDX-License-Identifier: MIT
"""From logs of a gearbox control and a card to a plant that held-out shifts have tested."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.special import ndtr

from drivetwin.channels.roles import make_command_role
from drivetwin.channels.units import RPM
from drivetwin.errors import IdentificationError, InputError, PlausibilityError, Where
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.estimation.result.verdict import reject_identified
from drivetwin.tcu.card import ControllerCard
from drivetwin.tcu.identify import FittedShifts, TcuTwin, fit_shifts
from drivetwin.tcu.log import SPEEDS, ControllerLog, ControllerShift, read_controller_log
from drivetwin.tcu.predict import PredictedShift, predict_shift
from drivetwin.tcu.problem import FLOOR
from drivetwin.tcu.statements import find_used_pressure, list_used, state
from drivetwin.tcu.unknowns import Numbers, list_element

_EVERY = 5
"""One shift of so many is held out where none is named."""
_LEAST_SHIFTS = 4
"""Fewest shifts of a fit: gains, fill and P0 of two elements, and load, vary from shift to
shift."""
_LEAST_INSIDE = 0.8
"""Share of the rows of held-out shifts inside the 95 % band below which the band is no band: so few
have a probability of 1 % for one shift in four that is missed."""


_CONTRADICTION = 0.01
"""Probability, over all numbers together, below which a log contradicts a number of the card."""
_LEAST_SHARE = 1e-4
"""Least share of the prior variance that a log takes away in that test [ratio]."""


@dataclass(frozen=True, eq=False)
class TcuIdentification:
    """Result: fit, estimates by name, predictions of held-out shifts, status with its reason."""

    logs: tuple[ControllerLog, ...]
    found: FittedShifts
    estimates: Mapping[str, Estimate]
    predictions: tuple[PredictedShift, ...]
    status: ModelStatus
    reason: str

    @property
    def twin(self) -> TcuTwin:
        """Plant."""
        return self.found.twin


def identify_controller(
    paths: Sequence[Path],
    card: ControllerCard,
    mapping: Path | None = None,
    hold_out: Collection[int] | None = None,
    *,
    seed: int = 0,
) -> TcuIdentification:
    """Identify the plant of one vehicle from logs of its gearbox control.

    Parameters
    ----------
    paths
        Logs; their shifts are numbered in order from 1.
    card
        Card of the gearbox.
    mapping
        Channel mapping, None where columns are recognised by name.
    hold_out
        Numbers of the shifts to predict; None for every fifth.
    seed
        Seed of the draws of the bands.

    Raises
    ------
    InputError
        For a shift that does not exist, where too few are left to fit, and for a command in another
        unit.
    IdentificationError
        Where the simulation cannot be brought onto the shifts.
    """
    logs = tuple(read_controller_log(path, card, mapping) for path in paths)
    shifts = [one for log in logs for one in log.shifts]
    shifts = [replace(one, number=k) for k, one in enumerate(shifts, start=1)]
    held = _find_held(shifts, hold_out)
    fitted = [one for one in shifts if one.number not in held]
    if len(fitted) < _LEAST_SHIFTS:
        raise InputError(
            f"{len(fitted)} shifts are left to fit",
            f"record at least {_LEAST_SHIFTS}; 15 to 20 of every kind of interest are usual",
            Where(file=logs[0].source),
        )
    _require_pressures(card, shifts, logs[0].source)
    found = fit_shifts(card, fitted)
    predictions = predict(found.twin, [one for one in shifts if one.number in held], seed)
    status, reason = _judge(found, predictions)
    estimates = state(found)
    if status is ModelStatus.NOT_VALID:
        estimates = {name: withdraw(one, reason) for name, one in estimates.items()}
    elif status is not ModelStatus.VALID:
        estimates = {name: reject_identified(one, reason) for name, one in estimates.items()}
    return TcuIdentification(logs, found, estimates, predictions, status, reason)


def _require_pressures(card: ControllerCard, shifts: Sequence[ControllerShift], log: str) -> None:
    """Raise PlausibilityError for a command at which an element slips as it applies, but whose
    torque by the card is another than that of the engine: it is in another unit."""
    for name in list_used(shifts):
        applied = [one for one in shifts if one.on == name]
        stated = list_element(card.gains[name])
        torques = [
            abs(np.median(one.torque)) / card.levers[frozenset(one.gears)][name] for one in applied
        ]
        needed = stated[Numbers.P0].value + np.median(torques or 0.0) / card.gains[name].value
        used = find_used_pressure(card, applied, name) if applied else needed
        if not 1.0 / _OTHER_UNIT < used / needed < _OTHER_UNIT:
            raise PlausibilityError(
                f"{name} applies at {used:g} bar, where the card and the engine torque need about "
                f"{needed:.1f} bar",
                "correct the unit of the command, or the gain on the card",
                Where(file=log, channel=make_command_role(name)),
            )


_OTHER_UNIT = 10.0
"""Ratio of pressures that control, converter and scatter do not explain: those of commands are
between 0.9 and 7 times the needed ones [ratio]."""


def predict(
    twin: TcuTwin, shifts: Sequence[ControllerShift], seed: int = 0
) -> tuple[PredictedShift, ...]:
    """Predict shifts with a twin; one that cannot be simulated is left out."""
    rng, predicted = np.random.default_rng(seed), []
    for one in shifts:
        try:
            predicted.append(predict_shift(twin, one, rng))
        except IdentificationError:
            continue
    return tuple(predicted)


def _find_held(shifts: Sequence[ControllerShift], wanted: Collection[int] | None) -> frozenset[int]:
    """Return the numbers of held-out shifts: every fifth where none is named."""
    known = {one.number for one in shifts}
    if wanted is None:
        return frozenset(number for number in known if number % _EVERY == 0)
    for number in wanted:
        if number not in known:
            raise InputError(
                f"there is no shift {number}",
                f"give numbers from 1 to {len(known)}",
                Where(key="hold_out"),
            )
    return frozenset(wanted)


def _judge(found: FittedShifts, predictions: Sequence[PredictedShift]) -> tuple[ModelStatus, str]:
    """Judge the plant by residuals of fitted shifts, bands of held-out ones, and the card."""
    size = max(found.noise.sigma[name] for name in SPEEDS)
    text = f"The speeds of the fitted shifts are met to {size / RPM:.1f} rpm rms"
    name, apart, chance = find_contradiction(found)
    contradicts = ""
    if chance < _CONTRADICTION:
        contradicts = f" The log contradicts the stated {name} by {apart:.1f} standard deviations: "
        contradicts += "check the exact and tight values of the card."
    if size > FLOOR:
        return ModelStatus.NOT_VALID, (
            f"{text}, worse than the {FLOOR / RPM:.0f} rpm that the intervals include: the model "
            f"lacks something. Check ratios, levers and converter of the card.{contradicts}"
        )
    if not predictions:
        return ModelStatus.NOT_VALIDATED, f"{text}; no shift was held out.{contradicts}"
    rows = sum(int(np.count_nonzero(one.rows)) for one in predictions)
    inside = sum(float(np.mean(one.inside)) * np.count_nonzero(one.rows) for one in predictions)
    share = inside / rows
    text += f"; {100.0 * share:.0f} % of the rows of {len(predictions)} held-out shifts are inside "
    text += f"the 95 % band.{contradicts}"
    is_valid = share >= _LEAST_INSIDE and not contradicts
    return ModelStatus.VALID if is_valid else ModelStatus.LIMITED, text


def find_contradiction(found: FittedShifts) -> tuple[str, float, float]:
    """Find the shared number that a fit moves farthest from its prior.

    Where prior and log agree, the move is normal with the variance that the log takes away from the
    prior (Box 1980).

    Returns
    -------
    tuple
        Name, move in standard deviations of the move, and the probability of one as large among all
        numbers.
    """
    own = found.coordinates
    shared = [own.names.index(name) for name in own.get_shared()]
    apart = own.to_absolute @ (found.point.values - own.mean)
    after = np.diag(own.to_absolute @ found.covariance @ own.to_absolute.T)
    taken = np.clip(1.0 - after / own.spread**2, _LEAST_SHARE, 1.0)
    size = (np.abs(apart) / (own.spread * np.sqrt(taken)))[shared]
    worst = int(np.argmax(size))
    chance = len(shared) * 2.0 * float(ndtr(-size[worst]))
    return own.names[shared[worst]], float(size[worst]), min(chance, 1.0)


def withdraw(one: Estimate, reason: str) -> Estimate:
    """Return an estimate without its value, unless it is a design value."""
    if one.verdict is Verdict.DESIGN or one.value is None:
        return one
    verdict = Verdict.NOT_IDENTIFIABLE
    return replace(one, value=None, std_noise=None, verdict=verdict, reason=reason)


def list_unfitted_kinds(twin: TcuTwin, shifts: Sequence[ControllerShift]) -> list[str]:
    """List the kinds of shifts that were not fitted: their bands are too narrow."""
    kinds = dict.fromkeys(one.kind for one in shifts)
    return [kind for kind in kinds if kind not in twin.kinds]
