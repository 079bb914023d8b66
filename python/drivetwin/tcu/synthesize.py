# SPDX-License-Identifier: MIT
"""Made logs of a gearbox control with known truth, from the plant of the identification.

Vehicle and clutches are drawn from their priors. A schedule of commands shifts by the control's
belief, which is off by some percent: fast fill, hold, overlap, capacity for the inertia phase.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import tomlkit
from scipy.constants import bar
from scipy.optimize import brentq

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.units import RPM
from drivetwin.errors import IdentificationError, InputError
from drivetwin.likelihood.point import ParameterVector
from drivetwin.tcu.card import ControllerCard, ControllerCardFile, make_card
from drivetwin.tcu.log import REFERENCE_OIL, SPEEDS, ControllerShift
from drivetwin.tcu.plant import build_term
from drivetwin.tcu.unknowns import J_VEHICLE, Numbers, Own, list_common, list_element

_TASK = 0.02
"""Period of the control's task [s]."""
_SPAN, _CHANGE, _PAUSE = 3.4, 1.0, 30.0
"""Length of a record, change of the commanded gear in it, time between two records [s]."""
_HOLD, _FILL = 9.0 * bar, 5.0 * bar
"""Pressures of a locked clutch and of the fast fill [Pa]."""
_KINDS = (("1", "2"), ("2", "3"), ("3", "4"))
_NOISE = 0.8
"""Noise of a speed [rpm]."""
_LOCKED = 20.0 * RPM
"""Slip of a gear that holds, between speeds of different delays [rad/s]."""
_ATTEMPTS = 20
"""Largest number of schedules that are tried for a shift [count]."""
_ERRORS = (Own.LOAD, Own.RATE, Own.OFFSET, Own.GAIN_OFF, Own.GAIN_ON, Own.FILL)
"""Numbers that change from shift to shift."""
_SPREAD = 0.7
"""Spread of the truth over that of the priors: draws from the whole priors give rare vehicles that
no schedule shifts [ratio]."""
CARD: dict[str, object] = {
    "name": "made automatic",
    "final_drive": 2.87,
    "mass_kg": {"value": 1900.0, "std": 47.5},
    "wheel_radius_m": {"value": 0.32, "std": 0.0032},
    "J_engine_kgm2": {"value": 0.25, "std": 0.05},
    "J_turbine_kgm2": {"value": 0.1, "std": 0.03},
    "converter": {
        "speed_ratio": [0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.93, 0.96, 0.98, 1.0],
        "capacity_Nms2": [
            0.0043,
            0.0044,
            0.0045,
            0.0044,
            0.0042,
            0.0037,
            0.0033,
            0.0026,
            0.002,
            0.0013,
            0.0007,
            0.0,
        ],
        "torque_ratio": [1.95, 1.72, 1.5, 1.28, 1.18, 1.07, 1.02, 1.0, 1.0, 1.0, 1.0, 1.0],
    },
    "elements": {
        name: {"gain_Nm_per_bar": {"value": gain, "std": 0.15 * gain}}
        for name, gain in {"K1": 40.0, "K2": 60.0, "K3": 30.0, "B1": 38.0, "B2": 26.0}.items()
    },
    "gears": [
        {"name": "1", "ratio": 3.595, "elements": ["B1", "B2", "K3"]},
        {"name": "2", "ratio": 2.186, "elements": ["K1", "B2", "K3"]},
        {"name": "3", "ratio": 1.405, "elements": ["K1", "K2", "B2"]},
        {"name": "4", "ratio": 1.0, "elements": ["K1", "K2", "K3"]},
    ],
    "changes": [
        {"gears": ["1", "2"], "levers": {"B1": 1.5515, "K1": 1.5515}},
        {"gears": ["2", "3"], "levers": {"K3": 1.799, "K2": 1.0}},
        {"gears": ["3", "4"], "levers": {"B2": 2.469, "K3": 3.469}},
    ],
}
"""Card of a planetary automatic with four gears, in the form of its file."""


@dataclass(frozen=True)
class MadeLog:
    """Texts of a log, its card and its truth."""

    log: str
    card: str
    truth: str


def make_log(seed: int, shifts: int = 12, *, noise: float = 1.0) -> MadeLog:
    """Make a log of upshifts at different torques and temperatures.

    Parameters
    ----------
    seed
        Seed of vehicle, shifts and noise.
    shifts
        Number of shifts.
    noise
        Factor on the noise of the speeds; 0: neither noise nor rounding.

    Raises
    ------
    InputError
        For a noise that is negative or no number.
    """
    if not (np.isfinite(noise) and noise >= 0.0):
        raise InputError(f"the noise is {noise:g}", "give 0 or more")
    rng = np.random.default_rng(seed)
    card = make_card(ControllerCardFile.model_validate(CARD))
    truth = _draw_truth(card, rng)
    rows: list[list[float]] = []
    for number in range(1, shifts + 1):
        rows += _make_rows(card, truth, number, rng, noise)
    names = list(card.gains)
    head = ["t", "n_engine", "n_turbine", "n_output", "T_engine"]
    head += [*(f"p_{name}_cmd" for name in names), "gear", "gear_target", "T_oil"]
    units = ["s", "rpm", "rpm", "rpm", "Nm", *("mbar" for _ in names), "", "", "degC"]
    lines = [",".join(head), ",".join(units)]
    lines += [",".join(f"{cell:.10g}" for cell in row) for row in rows]
    return MadeLog("\n".join(lines) + "\n", format_card(), json.dumps(truth, indent=1) + "\n")


def format_card() -> str:
    """Write the card of the made gearbox."""
    return tomlkit.dumps(ControllerCardFile.model_validate(CARD).model_dump(mode="json"))


def _draw_truth(card: ControllerCard, rng: np.random.Generator) -> dict[str, float]:
    """Draw the numbers of the vehicle and its elements."""
    stated = list_common(card)
    for element, gain in card.gains.items():
        stated |= {f"{element}.{key}": one for key, one in list_element(gain).items()}
    truth = {J_VEHICLE: card.vehicle_inertia.value}
    for name, one in stated.items():
        drawn = _SPREAD * one.std * float(np.clip(rng.standard_normal(), -2.0, 2.0))
        truth[name] = one.value * float(np.exp(drawn)) if one.is_positive else one.value + drawn
    return truth


def _make_rows(
    card: ControllerCard,
    truth: Mapping[str, float],
    number: int,
    rng: np.random.Generator,
    noise: float,
) -> list[list[float]]:
    """Make the rows of a shift that locks. Raises IdentificationError where none does."""
    for _ in range(_ATTEMPTS):
        shift = _schedule(card, truth, number, rng)
        rows = _simulate_rows(card, truth, shift, rng)
        first, second = (card.ratios[name] for name in shift.gears)
        slip = np.abs(rows[:, 1] - second * rows[:, 2])
        if slip[-1] < _LOCKED and np.all(np.abs(rows[:10, 1] - first * rows[:10, 2]) < _LOCKED):
            if noise > 0.0:
                read = rows / RPM + rng.normal(0.0, noise * _NOISE, rows.shape)
                rows = np.round(read) * RPM
            return _write_rows(card, shift, rows)
    raise IdentificationError(
        f"no schedule locks shift {number} of the made vehicle", "take another seed"
    )


def _schedule(
    card: ControllerCard, truth: Mapping[str, float], number: int, rng: np.random.Generator
) -> ControllerShift:
    """Schedule the commands of a shift by what the control believes."""
    gears = _KINDS[(number - 1) % len(_KINDS)]
    first, second = (set(card.elements[name]) for name in gears)
    off, on = (first - second).pop(), (second - first).pop()
    levers = card.levers[frozenset(gears)]
    message, oil = float(rng.uniform(80.0, 230.0)), float(np.round(rng.uniform(30.0, 90.0)))
    torque = truth["torque_scale"] * message + truth["torque_offset"]
    time = np.arange(0.0, _SPAN, _TASK)
    after = time - _CHANGE

    def carry(element: str, share: float) -> float:
        gain = truth[f"{element}.{Numbers.GAIN}"] * rng.uniform(0.93, 1.07)
        kiss = truth[f"{element}.{Numbers.P0}"] * rng.uniform(0.93, 1.07)
        return float(kiss + share * torque / (levers[element] * gain)) * bar

    warm = float(np.exp(truth["fill_temperature"] * (oil - REFERENCE_OIL)))
    fill = truth[f"{on}.{Numbers.FILL}"] / warm / 2.0 * rng.uniform(0.7, 0.95)
    ready = carry(on, 0.0) + 0.3 * bar
    target = carry(on, float(rng.uniform(1.35, 1.7)))
    points = fill + 0.18 + np.array([0.0, 0.25, 1.25, 1.45])
    applied = np.interp(after, points, [ready, target, target + 1.5 * bar, _HOLD])
    applied = np.where(after < fill + 0.18, ready, applied)
    applied = np.where(after < fill, _FILL, applied)
    held = carry(off, 1.3)
    released = np.interp(after, points[:2], [held, 0.0])
    commands = {
        on: np.where(after < -1e-9, 0.0, np.clip(applied, 0.0, _HOLD)),
        off: np.where(after < -1e-9, _HOLD, np.clip(released, 0.0, _HOLD)),
    }
    turbine = float(rng.uniform(1900.0, 2900.0)) * RPM
    speeds = _find_speeds(card, truth, torque, turbine, turbine / card.ratios[gears[0]])
    return ControllerShift(
        number=number,
        gears=gears,
        off=off,
        on=on,
        begin=_PAUSE * (number - 1),
        time=time,
        speeds=np.tile(speeds, (time.size, 1)),
        torque=np.full(time.size, message),
        commands=commands,
        lockup=None,
        change=_CHANGE,
        oil=oil,
    )


def _find_speeds(
    card: ControllerCard, truth: Mapping[str, float], torque: float, turbine: float, output: float
) -> FloatArray:
    """Find the speeds (3,) at which the pump takes the engine torque."""
    scale = truth["converter_scale"]

    def excess(engine: float) -> float:
        capacity = np.interp(turbine / engine, card.speed_ratio, card.capacity)
        return float(scale * capacity * engine**2 - torque)

    engine = brentq(excess, turbine, 3.0 * turbine)
    return np.array([engine, turbine, output])


def _simulate_rows(
    card: ControllerCard,
    truth: Mapping[str, float],
    shift: ControllerShift,
    rng: np.random.Generator,
) -> FloatArray:
    """Simulate the speeds (n, 3) of a shift as the control reads them, without noise."""
    term, stated = build_term(card, shift)
    values = []
    for one in term.plant.sought:
        if one.name in truth:
            values.append(one.to_coordinate(truth[one.name]))
            continue
        own = one.name.partition(".")[2]
        error = rng.standard_normal() if own in _ERRORS else 0.0
        values.append(stated[one.name].value + _SPREAD * stated[one.name].std * float(error))
    point = ParameterVector(tuple(one.name for one in term.plant.sought), np.array(values))
    run = term.build_task(point).simulate()
    if run.status != "completed":
        return np.full((shift.time.size, len(SPEEDS)), np.nan)
    return term.record.sample(term.show(point, run.columns)).reshape(len(SPEEDS), -1).T


def _write_rows(
    card: ControllerCard, shift: ControllerShift, speeds: FloatArray
) -> list[list[float]]:
    """Write rows as the log has them, pressures in whole millibars."""
    read = speeds / RPM
    applied = card.elements[shift.gears[0]]
    rows = []
    for k, time in enumerate(shift.time.tolist()):
        commands = [
            float(np.round(shift.commands[name][k] / bar * 1e3))
            if name in shift.commands
            else (_HOLD / bar * 1e3 if name in applied else 0.0)
            for name in card.gains
        ]
        target = shift.gears[1] if time >= shift.change - 1e-9 else shift.gears[0]
        state = [float(shift.gears[0]), float(target), shift.oil]
        message = float(np.round(2.0 * shift.torque[k]) / 2.0)
        rows.append([shift.begin + time, *read[k].tolist(), message, *commands, *state])
    return rows
