# SPDX-License-Identifier: MIT
"""From a twin and a request to the problem of a calibration."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from drivetwin.calibration.calibrate import (
    Task,
    build_objective,
    draw_for,
    make_quick_plant,
)
from drivetwin.calibration.certificate import compute_quantiles
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint, check_gears
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import (
    CalibrationSettings,
    Hardware,
    Limit,
    Statistic,
    add_hardware,
)
from drivetwin.calibration.options import USUAL_WHEEL_RADIUS, CalibrationOptions
from drivetwin.calibration.policies.slip import UserController
from drivetwin.calibration.policies.table import POLICIES, PolicySetup
from drivetwin.calibration.policy import Policy, Space
from drivetwin.calibration.scenarios import Draw, Purpose, TwinDraws, UnitDraws
from drivetwin.calibration.spread import OilFriction, OilState, Spread
from drivetwin.errors import IdentificationError, InputError, Where
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.simulation.shift_control import Sensors, SpeedSensor
from drivetwin.twin.twin import PRESSURE_DELAY, Twin, build_nominal_shift

DEFAULT_LIMITS = {
    Metric.SHIFT_TIME: Statistic.SHARE_95,
    Metric.VIBRATION_DOSE: Statistic.SHARE_95,
    Metric.FRICTION_ENERGY: Statistic.MEAN,
}
"""Limits without a file: no worse than the start."""
_NOT_IDENTIFIED = (Verdict.WEAK, Verdict.NOT_IDENTIFIABLE)


class Request(CalibrationOptions):
    """Task of a calibration: gears and options, limits, spread between units, effort.

    `controller` is that of the policy `own`, `oil` the friction over the oil temperature.
    `sensors` of `engine_speed` and `output_speed` take the place of those of the twin's log.
    `start` holds starting values and `bounds` bounds (SI) of the policy by name; `limits` None
    stands for those of the start.
    """

    gears: tuple[str, str]
    limits: tuple[Limit, ...] | None = None
    spread: Spread = field(default_factory=Spread)
    oil: OilFriction = field(default_factory=OilFriction)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    settings: CalibrationSettings = field(default_factory=CalibrationSettings)
    controller: UserController | None = None
    sensors: Mapping[str, SpeedSensor] = field(default_factory=dict)
    hardware: Hardware = field(default_factory=Hardware)


def build_task(twin: Twin, request: Request) -> Task:
    """Build the problem of a request.

    Raises IdentificationError for a twin without an identified parameter, InputError for a shift
    that has no such policy, and MissingParameterError where the twin cannot be simulated.
    """
    require_identified(twin)
    shift = build_nominal_shift(twin, request.gears)
    oil = build_oil_state(twin, request)
    model = oil.warm(twin.build_dual_clutch(shift))
    point = choose_point(twin, request)
    added, late = twin.build_added_elements(model), twin.get_value(PRESSURE_DELAY, 0.0)
    radius = request.wheel_radius or twin.wheel_radius or USUAL_WHEEL_RADIUS
    maneuver = Maneuver(model, point, radius, added=added, pressure_delay=late)
    check_gears(maneuver)
    units = None
    if request.policy.commands_actuators:
        units = _build_unit_draws(twin, maneuver, request)
    unit = None if units is None else units.nominal
    pressure = _choose_pressure(twin, request)
    setup = PolicySetup(maneuver, pressure, unit, request.task, request.controller)
    policy = POLICIES[request.policy](setup)
    policy = policy.set_bounds({**_bound_kiss(policy, setup, request), **request.bounds})
    policy = policy.set_start(request.start)
    draw = Draw(TwinDraws(twin, shift, request.spread, oil), units)
    task = Task(maneuver, policy, draw, request.limits or (), request.seed, request.settings)
    if request.limits is None:
        task = task.set_limits(derive_limits(task))
    if task.limits:
        task = task.set_limits(add_hardware(task.limits, request.hardware, point.engine_torque))
    return task


def _bound_kiss(
    policy: Policy, setup: PolicySetup, request: Request
) -> dict[str, tuple[float, float]]:
    """Return the bounds of the kiss pressure [Pa] by the hardware; empty without it."""
    contact = setup.maneuver.oncoming.P0
    if setup.unit is not None:
        contact = max(contact, setup.unit.oncoming.kiss_pressure)
    highest = request.hardware.kiss * contact
    return {
        one.name: (one.low, min(one.high, highest))
        for one in policy.parameters
        if one.name == "kiss_pressure" and one.unit == "Pa" and one.start <= highest
    }


def choose_start(twin: Twin, request: Request, starts: Sequence[Mapping[str, float]]) -> Request:
    """Return a request that starts from the best of several calibrations by a corrected twin.

    The limits are those of the last one, which the next calibration must not exceed.
    """
    last = replace(request, start=starts[-1])
    if len(starts) == 1:
        return last
    task = build_task(twin, last)
    plant, space = make_quick_plant(task), Space(task.policy)
    draws = draw_for(task, task.settings.polish_draws, Purpose.POLISH)
    policies = [task.policy.set_start(one) for one in starts]
    controls = [space.build_control(Space(one).start) for one in policies]
    objective = build_objective(task, plant)
    values = [objective.evaluate(one) for one in plant.evaluate_all(controls, draws)]
    best = starts[int(np.argmin(values))]
    return replace(request, start=best, limits=task.limits)


def require_identified(twin: Twin) -> None:
    """Raise IdentificationError where no parameter of a twin is identified.

    A model that fails its validation has none.
    """
    verdicts = [one.verdict for one in twin.parameters.values()]
    if Verdict.IDENTIFIED not in verdicts:
        estimated = [one for one in twin.parameters.values() if one.verdict in _NOT_IDENTIFIED]
        reasons = Counter(one.reason for one in estimated if one.reason).most_common(1)
        raise IdentificationError(
            "the twin is not valid: none of its parameters is identified"
            + (f" ({reasons[0][0]})" if reasons else ""),
            "correct the vehicle card or take another log, and identify again",
            Where(file=twin.name),
        )


def derive_limits(task: Task) -> tuple[Limit, ...]:
    """Limits at which a calibration is no worse than the start in time, vibration and energy.

    They are upper bounds of the start with the confidence of the certificate, on the draws by
    which the limits of a calibration are checked: the start keeps them.
    """
    plant, space = Plant(task.maneuver, task.settings.threads), Space(task.policy)
    draws = draw_for(task, task.settings.check_draws, Purpose.CHECK)
    outcome = plant.evaluate(space.build_control(space.start), draws)
    limits = []
    for metric, statistic in DEFAULT_LIMITS.items():
        found = compute_quantiles(outcome.values[metric], task.settings.confidence)
        value = found.mean_upper if statistic is Statistic.MEAN else found.upper_95
        bound = found.share_95 if value is None else value
        limits.append(Limit(metric, bound, statistic, "no worse than the start"))
    return tuple(limits)


def choose_point(twin: Twin, request: Request) -> OperatingPoint:
    """Return the operating point: as requested, else that of the log.

    It is the middle over the log's shifts of these gears at their begin, without such shifts that
    of the range of the log.
    """
    torque, speed = request.engine_torque, request.engine_speed
    missing = [
        name
        for name, value in (("torque", torque), ("speed", speed))
        if value is None and name not in twin.validity
    ]
    if missing:
        raise InputError(
            f"the twin {twin.name!r} does not say which engine {' and '.join(missing)} its log had",
            "give --engine-torque and --engine-speed",
        )
    label = "-".join(request.gears)
    middle = {name: 0.5 * sum(ends) for name, ends in twin.validity.items()}
    if torque is None:
        torque = middle.get(f"torque {label}", middle["torque"])
    if speed is None:
        speed = middle.get(f"speed {label}", middle["speed"])
    if not speed > 0.0:
        raise InputError(f"the engine speed is {speed:g} rad/s", "give one above zero")
    return OperatingPoint(torque, speed, request.oil_temperature)


def build_oil_state(twin: Twin, request: Request) -> OilState:
    """Build the oil of a request against that of the twin's log.

    Raises InputError where a temperature is asked for and that of the log is not known.
    """
    wanted, friction = request.oil_temperature, request.oil
    if wanted is None:
        return OilState(0.0, friction)
    known = friction.place(twin).log_temperature
    if known is None:
        raise InputError(
            f"the twin {twin.name!r} does not say which oil temperature its log had",
            "identify a log with the role temperature.oil, or state log_temperature_C under [oil] "
            "in the file of limits",
        )
    return OilState(wanted - known, friction)


def _choose_pressure(twin: Twin, request: Request) -> float:
    """Pressure [Pa] of a held element: as requested, else the largest that the log has."""
    if request.system_pressure is not None:
        return request.system_pressure
    if "pressure" not in twin.validity:
        raise InputError(
            f"the twin {twin.name!r} does not say which pressures its log had",
            "give --system-pressure",
        )
    return twin.validity["pressure"][1]


def _build_unit_draws(twin: Twin, maneuver: Maneuver, request: Request) -> UnitDraws:
    names = maneuver.offgoing.name, maneuver.oncoming.name
    if missing := [name for name in names if name not in twin.actuators]:
        raise InputError(
            f"the twin {twin.name!r} has no actuator of {' and '.join(missing)}",
            "identify a log with the roles pressure_command.ELEMENT, state the actuator on the "
            "vehicle card, or take another --policy",
        )
    delay = twin.get_value(PRESSURE_DELAY, 0.0)
    old, new = (twin.actuators[name].delay(delay) for name in names)
    sensors = _build_sensors(maneuver, {**twin.sensors, **request.sensors})
    return UnitDraws(old, new, request.engine_lag, request.spread, sensors)


def _build_sensors(maneuver: Maneuver, given: Mapping[str, SpeedSensor]) -> Sensors | None:
    """Build the sensors of a controller; None where nothing is known of them."""
    if not given:
        return None
    engine, output = (given.get(name, SpeedSensor()) for name in ("engine_speed", "output_speed"))
    pair = maneuver.offgoing, maneuver.oncoming
    off, on = ((1.0 / (maneuver.model.i_in * one.i_c), -one.i_out) for one in pair)
    return Sensors(engine, output, (off, on))
