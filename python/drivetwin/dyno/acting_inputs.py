# SPDX-License-Identifier: MIT
"""Inputs as they act on the driveline, from those that are logged."""

from __future__ import annotations

import numpy as np

from drivetwin._util.signal_processing import apply_lag
from drivetwin.dyno.effects import Effects
from drivetwin.dyno.nominal import NominalRun, compute_friction_work
from drivetwin.simulation.dual_clutch import FloatArray, ShiftElement, Signal, Trajectory
from drivetwin.vehicle.effects import EffectId


def lag_input(logged: Signal, time_constant: float) -> Signal:
    """Apply a first-order lag [s] to an evenly sampled input, at rest before its start."""
    if time_constant == 0.0:
        return logged
    step = float(logged.time[1] - logged.time[0])
    return Signal(logged.time, apply_lag(logged.values, step, time_constant))


def delay_input(logged: Signal, delay: float) -> Signal:
    """Delay an input by a time [s]; it has its first value before it starts."""
    if delay == 0.0:
        return logged
    time = np.concatenate([[logged.time[0] - delay], logged.time])
    return Signal(time, np.concatenate([logged.values[:1], logged.values]), delay)


def scale_capacity(
    acting: Signal, element: ShiftElement, nominal: NominalRun, effects: Effects, work: FloatArray
) -> Signal:
    """Replace a pressure [Pa] by the one at which the element has the capacity with effects.

    The capacity is μ·gain·(P - P0), so a factor of μ acts as the same factor of P - P0. `work` (n,)
    [J] is the friction work on the times of the nominal run.
    """
    excess = np.maximum(acting.values - element.P0, 0.0)
    factor = np.ones_like(excess)
    rise = effects.get(EffectId.FRICTION_PRESSURE, 0.0)
    span = nominal.get_pressure_range(element.name, element.P0)
    if rise > 0.0 and span > 0.0:
        factor *= 1.0 + rise * (np.minimum(excess / span, 1.0) - 0.5)
    fall = effects.get(EffectId.FRICTION_HEAT, 0.0)
    whole = float(compute_friction_work(nominal.trajectory, element.name)[-1])
    if fall > 0.0 and whole > 0.0:
        share = np.interp(acting.arrival, nominal.trajectory.time, work) / whole
        factor *= np.maximum(1.0 - fall * share, 0.0)
    return Signal(acting.time, acting.values + (factor - 1.0) * excess, acting.delay)


def build_acting_inputs(
    nominal: NominalRun, effects: Effects, heated: Trajectory
) -> tuple[Signal, dict[str, Signal]]:
    """Return engine torque [N m] and pressures [Pa] as they act.

    `heated` is a run on the times of the nominal one, from whose friction work μ falls.
    """
    torque = lag_input(nominal.engine_torque, effects.get(EffectId.TORQUE_LAG, 0.0))
    late = effects.get(EffectId.PRESSURE_DELAY, 0.0)
    pressures = {
        each.name: scale_capacity(
            delay_input(nominal.pressures[each.name], late),
            each,
            nominal,
            effects,
            compute_friction_work(heated, each.name),
        )
        for each in nominal.model.elements
    }
    return torque, pressures
