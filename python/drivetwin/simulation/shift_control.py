# SPDX-License-Identifier: MIT
"""Shifts in closed loop: a controller that commands by slip, and actuators, in many runs.

The core simulates the controller at its sample time: a run costs about as much as one with given
inputs. Equations of the controller and of the actuator as in docs/explanation/actuator.md and
docs/howto/calibrate.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from drivetwin._native import simulate_controlled as native_simulate_controlled
from drivetwin.actuator.model import ActuatorModel
from drivetwin.errors import ControllerError, InputError, Where
from drivetwin.simulation.driveline_run import load_library
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    FloatArray,
    Signal,
    run_time,
    to_delayed_core_samples,
)
from drivetwin.simulation.element_schema import as_array, as_json
from drivetwin.simulation.network import Element, Output, Start, stack_sets
from drivetwin.simulation.network_response import NetworkScenario, resolve_native
from drivetwin.simulation.network_sensitivity import require_numbers

INPUTS = (
    *("engine_torque", "pressure.offgoing", "pressure.oncoming"),
    *("command.engine_torque", "command.offgoing", "command.oncoming"),
)
"""Recorded inputs of a controlled run: those of the driveline, then the commands; N·m and Pa.

A command is the one that has held until the sample.
"""

_NOT_FINITE = "the controller's command is not finite"
"""Begin of the core's reason for a run that such a command ended."""


@dataclass(frozen=True)
class ShiftController:
    """Controller of a shift whose torque phase comes first, with a closed loop of the slip.

    Times [s] count from the request where nothing else is said; pressures in Pa, torques in N·m.

    `offgoing` and `oncoming` name the elements; `task` is the time between two commands, `request`
    the time of the request in the run. `engine_torque` is the driver's demand, `direction` the sign
    of the torque intervention, `system_pressure` that of a held element.

    Preparation: the on-coming command is `fill_pressure` until `fill_time`, then rises from
    `kiss_pressure` to `handover_pressure` within `torque_phase_time`. The off-going command falls
    to `hold_pressure` at `hold_time`, and to zero within `release_time` after it.

    The inertia phase begins where the off-going element slips. The slip of the on-coming element
    follows a reference to zero within `inertia_time`, of which the share `end_slope` is a straight
    line: PI controller with `gain` [Pa·s/rad] and `integral_gain` [Pa/rad] about a feed-forward
    that goes from `inertia_pressure` to `sync_pressure`. The engine torque changes by
    `reduction_depth`, `reduction_delay` after its begin, within `reduction_time`; it returns within
    `return_time` from the slip `return_slip`, over that at its begin. A final ramp of `lock_rate`
    [Pa/s] locks. It begins where the slip, predicted by its present rate over `lock_lead`, ends.
    """

    offgoing: str
    oncoming: str
    task: float
    request: float
    engine_torque: float
    direction: float
    system_pressure: float
    fill_pressure: float
    fill_time: float
    kiss_pressure: float
    torque_phase_time: float
    handover_pressure: float
    hold_time: float
    hold_pressure: float
    release_time: float
    inertia_pressure: float
    sync_pressure: float
    inertia_time: float
    end_slope: float
    gain: float
    integral_gain: float
    reduction_depth: float
    reduction_delay: float
    reduction_time: float
    return_slip: float
    return_time: float
    lock_rate: float
    lock_lead: float

    def __post_init__(self) -> None:
        if not self.task > 0.0:
            raise InputError(
                f"a controller task of {self.task:g} s",
                "give a time above 0",
                Where(key="task"),
            )


@dataclass(frozen=True)
class ExternalController:
    """Shift controller in a library, by the interface of `drivetwin_controller.h`.

    Fields as in `ShiftController`; `parameters` are the numbers that its step function reads,
    `oil_temperature` [K] is an input of it, `library` the path of the compiled library. Pressure
    commands stay from zero to system pressure.
    """

    offgoing: str
    oncoming: str
    task: float
    request: float
    engine_torque: float
    system_pressure: float
    oil_temperature: float
    parameters: tuple[float, ...]
    library: Path

    def describe(self) -> dict[str, Any]:
        """Return the fields that the core reads for each controller."""
        names = ("request", "engine_torque", "system_pressure", "oil_temperature", "parameters")
        return {name: getattr(self, name) for name in names}


AnyController = ShiftController | ExternalController
"""Built-in or external controller."""


@dataclass(frozen=True)
class SpeedSensor:
    """Sensor of a speed: noise of a sample and rounding step [rad/s], sampling period, delay [s].

    Without a period there is a sample at each task.
    """

    noise: Annotated[float, Field(ge=0, alias="noise_rad_s")] = 0.0
    quantum: Annotated[float, Field(ge=0, alias="quantum_rad_s")] = 0.0
    period: Annotated[float, Field(ge=0, le=1, alias="period_s")] = 0.0
    delay: Annotated[float, Field(ge=0, le=1, alias="delay_s")] = 0.0


@dataclass(frozen=True)
class Sensors:
    """Sensors of a made unit: of engine and gearbox input, and of the gearbox output.

    `slips` are the factors of both speeds in the slips of the off-going and on-coming element,
    which the controller computes. `seed` is that of noise and sampling instants.
    """

    engine: SpeedSensor
    output: SpeedSensor
    slips: tuple[tuple[float, float], tuple[float, float]]
    seed: int = 0


@dataclass(frozen=True)
class ControlledUnit:
    """Actuators of a made unit, the time constant of its engine torque [s], and its sensors.

    Without sensors the controller has exact speeds.
    """

    offgoing: ActuatorModel
    oncoming: ActuatorModel
    engine_lag: float
    sensors: Sensors | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.engine_lag < float("inf"):
            raise InputError(
                f"an engine lag of {self.engine_lag:g} s",
                "give a time from 0 on",
                Where(key="engine_lag"),
            )


@dataclass(frozen=True, eq=False)
class ControlledBatch:
    """Result: `values` (units, controllers, outputs, n), SI; NaN for runs that failed.

    `inputs` (units, controllers, 6, n) are those of INPUTS, empty where not asked for. `last_lock`
    (units, controllers) [s] is the time of the last lock-up, NaN without one. `failed` holds the
    reason by the number of the run.
    """

    values: FloatArray
    inputs: FloatArray
    last_lock: FloatArray
    failed: Mapping[int, str]


@dataclass(frozen=True, eq=False)
class ControlledNetwork:
    """Made units of a network: actuators, and values (units,) of numbers by path.

    `start` is the state at the first sample. The controller commands the input `engine_torque` and
    the pressures of its clutches; `inputs` are the others, without jumps. `speeds` are the nodes of
    engine and gearbox output, whose speeds external controllers measure.
    """

    elements: Sequence[Element]
    start: Start
    units: Sequence[ControlledUnit]
    parameters: Mapping[str, FloatArray]
    inputs: Mapping[str, Signal] = field(default_factory=dict)
    engine_torque: str = ENGINE_TORQUE
    speeds: tuple[str, str] | None = None


def simulate_network_controlled(
    plant: ControlledNetwork,
    controllers: Sequence[AnyController],
    time: FloatArray,
    outputs: Sequence[Output],
    *,
    with_inputs: bool = False,
    threads: int = 0,
) -> ControlledBatch:
    """Simulate all controllers on all units of a network.

    Parameters
    ----------
    plant
        Network, its actuators and its parameter sets.
    controllers
        Controllers of the same clutches, task and request.
    time
        Grid (n,) [s], increasing.
    outputs
        Recorded quantities.
    with_inputs
        True if `INPUTS` are recorded too.
    threads
        Number of threads; 0 takes all cores.

    Returns
    -------
    ControlledBatch
        Values (units, controllers, outputs, n), SI.

    Raises
    ------
    InputError
        For a path that leads to no number or an inconsistent description.
    ControllerError
        Where an external controller gives a command that is not finite.
    """
    sets = {name: as_array(values) for name, values in plant.parameters.items()}
    _check(sets, len(plant.units), controllers, threads)
    clutches = {one.get("name"): one["pressure"] for one in plant.elements if "pressure" in one}
    commanded = (controllers[0].offgoing, controllers[0].oncoming)
    for name in commanded:
        if name not in clutches:
            known = ", ".join(map(str, clutches))
            what = f'clutch "{name}" is unknown; known are {known}'
            raise InputError(what, "give a controller of clutches of the network")
    pressures = [clutches[name] for name in commanded]
    held = Signal(np.array([0.0, 1.0]), np.zeros(2))
    inputs = {**dict.fromkeys([plant.engine_torque, *pressures], held), **plant.inputs}
    scenario = NetworkScenario(inputs, plant.start)
    for name, one in plant.inputs.items():
        if np.any(np.diff(one.time) == 0.0):
            what = f"input {name!r} jumps, which no controlled run passes"
            raise InputError(what, "give the jump a width, such as that of a sample")
    native = resolve_native(plant.elements, [scenario], outputs)
    require_numbers(plant.elements, [scenario], sets)
    more = len(INPUTS) if with_inputs else 0
    values = np.empty((len(plant.units), len(controllers), len(native) + more, len(time)))
    try:
        _, last_lock, failed = native_simulate_controlled(
            as_json(list(plant.elements)),
            ((to_delayed_core_samples(plant.inputs), []), plant.start.to_core()),
            stack_sets(sets, len(plant.units)),
            run_time(time),
            _describe(plant, controllers),
            ((native, with_inputs, threads), values.reshape(-1)),
        )
    except ValueError as error:
        raise InputError(str(error), "correct the model, its inputs or the names") from error
    for _, reason in failed:
        if reason.startswith(_NOT_FINITE):
            where = Where(file=str(getattr(controllers[0], "library", "")) or None)
            raise ControllerError(reason, "let the step function set finite commands", where)
    own, recorded = values[:, :, : len(native)], values[:, :, len(native) :]
    return ControlledBatch(own, recorded, last_lock.reshape(values.shape[:2]), dict(failed))


def _describe(plant: ControlledNetwork, controllers: Sequence[AnyController]) -> str:
    """Return controllers, units and names as the core reads them."""
    first = controllers[0]
    given: Mapping[str, Any] = {"built_in": list(controllers)}
    if isinstance(first, ExternalController):
        of = [one.describe() for one in controllers if isinstance(one, ExternalController)]
        given = {"external": {"library": load_library(first.library), "of": of}}
    return as_json(
        {
            "controllers": given,
            "units": list(plant.units),
            "task": first.task,
            "elements": [first.offgoing, first.oncoming],
            "engine_torque": plant.engine_torque,
            "speeds": plant.speeds,
        }
    )


def _check(
    sets: Mapping[str, FloatArray],
    units: int,
    controllers: Sequence[AnyController],
    threads: int,
) -> None:
    lengths = {len(values) for values in sets.values()} | {units}
    common = {(type(one), one.offgoing, one.oncoming, one.task, one.request) for one in controllers}
    if len(lengths) != 1 or 0 in lengths or len(common) != 1 or threads < 0:
        raise InputError(
            f"{units} units, parameters of {sorted(lengths)} values, {len(common)} "
            f"kinds of controllers and {threads} threads make no batch",
            "give a unit for every value, controllers of the same elements, task and request, and "
            "threads from 1 or 0 for all cores",
        )
