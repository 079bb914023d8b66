# SPDX-License-Identifier: MIT
"""Test bench of the user's controller: scenarios over drawn units, assertions, worst runs.

Two controllers are compared on the same draws, by paired statistics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field
from scipy.constants import g, zero_Celsius
from scipy.stats import t, wilcoxon

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.calibration.calibrate import Task
from drivetwin.calibration.certificate import Certificate, certify
from drivetwin.calibration.evaluate import Plant, get_vehicle_inertias
from drivetwin.calibration.guarded_controller import run_guarded
from drivetwin.calibration.maneuver import ClosedLoop
from drivetwin.calibration.metrics import Metric, Outcome, compute_metrics, list_outputs
from drivetwin.calibration.objective import build_limit_keys
from drivetwin.calibration.policies.slip import UserController
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import (
    Draw,
    MakeActuators,
    MakeDriveline,
    Purpose,
    draw_scenarios,
)
from drivetwin.calibration.twin_task import Request, build_task, choose_point
from drivetwin.errors import ControllerError
from drivetwin.simulation.driveline_run import INPUTS as SIGNALS
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.simulation.shift_control import INPUTS, ControlledUnit
from drivetwin.twin.twin import Twin

UNLOCKED, RELOCKED, UNFINISHED = "unlocked", "relocked", "unfinished"
"""Quantities of a run beside its metrics: 1 where the on-coming element ends with slip, where it
slips again after lock-up, and where the inputs at the end are not those of the new gear."""
_REST = 0.05
"""Distance of the inputs from those of the new gear at the end, over system pressure and torque
demand, up to which a shift counts as finished: beyond the error of a usual command."""
_Factor = Annotated[float, Field(gt=0, le=20)]


class Scale(StrEnum):
    """Scale of an assertion's bound, as the ending of its key: none for SI.

    The median of the first scenario, the engine torque; or the bound is that of the relative
    change from the same unit in the first scenario.
    """

    SI = ""
    NOMINAL = "_of_nominal"
    TORQUE = "_of_torque"
    CHANGE = "_change"


def build_assertion_keys() -> dict[str, tuple[str, Scale]]:
    """Return the keys of assertions with quantity and scale of each."""
    limits = {key: metric for key, (metric, _) in build_limit_keys().items()}
    return (
        {name: (name, Scale.SI) for name in (UNLOCKED, RELOCKED, UNFINISHED)}
        | {key: (one, Scale.SI) for key, one in limits.items() if not key.startswith("mean_")}
        | {one + scale: (one, scale) for scale in Scale if scale.value for one in Metric}
    )


@dataclass(frozen=True)
class SignalFault:
    """Fault of a signal from `begin` to `end` [s] after the request.

    The signal arrives `delay` [s] late; without a delay one of `every` messages arrives, none at 0.
    """

    signal: Literal[
        "offgoing_slip",
        "oncoming_slip",
        "engine_speed",
        "output_speed",
        "engine_torque",
        "oil_temperature",
        "command_engine_torque",
        "command_offgoing",
        "command_oncoming",
    ]
    begin: Annotated[float, Field(ge=-1000, alias="from_s")] = 0.0
    end: Annotated[float, Field(le=1000, alias="to_s")] = 1000.0
    delay: Annotated[float, Field(ge=0, le=1, alias="delay_s")] = 0.0
    every: Annotated[int, Field(ge=0)] = 0

    @property
    def numbers(self) -> tuple[float, ...]:
        """Numbers of drivetwin_bench.c."""
        commands = ("command_engine_torque", "command_offgoing", "command_oncoming")
        place = float((*SIGNALS, *commands).index(self.signal))
        return (place, self.begin, self.end, self.delay, float(self.every))


@dataclass(frozen=True)
class Scenario:
    """A shift under conditions, with upper bounds by key for each of its runs.

    `torque` and `speed` are factors on the operating point, `mass` on the inertia of the vehicle,
    `gain_offgoing` and `gain_oncoming` on those of the clutches, `fill` and `lag` on the times of
    the actuators. `oil_temperature` [K] is by default that of the log, `grade` the slope of the
    road; `dead_time` [s] is added. The controller runs for `wait` [s] before the run begins; the
    run ends `duration` [s] after the request. `pedal` has pairs of time after the request [s] and
    factor on the torque demand.
    """

    name: str
    shift: Annotated[str, Field(pattern=r"^[^-]+-[^-]+$")] = ""
    torque: Annotated[float, Field(ge=-5, le=5)] = 1.0
    speed: _Factor = 1.0
    oil_temperature: Annotated[
        Annotated[float, Field(gt=-50, lt=200), AfterValidator(zero_Celsius.__add__)] | None,
        Field(alias="oil_C"),
    ] = None
    mass: _Factor = 1.0
    grade: Annotated[
        float, Field(ge=-50, le=50, alias="grade_percent"), AfterValidator((0.01).__mul__)
    ] = 0.0
    gain_offgoing: _Factor = 1.0
    gain_oncoming: _Factor = 1.0
    fill: _Factor = 1.0
    lag: _Factor = 1.0
    dead_time: Annotated[float, Field(ge=0, le=0.4, alias="dead_time_s")] = 0.0
    wait: Annotated[float, Field(ge=0, le=1000, alias="wait_s")] = 0.0
    duration: Annotated[float, Field(gt=0, le=20, alias="duration_s")] = 1.5
    pedal: Annotated[tuple[tuple[float, float], ...], Field(min_length=1)] = ((0.0, 1.0),)
    faults: tuple[SignalFault, ...] = ()
    bounds: Annotated[Mapping[str, Annotated[float, Field(ge=0, allow_inf_nan=True)]],
                      Field(alias="assert")] = field(default_factory=dict)  # fmt: skip
    draws: Annotated[int, Field(ge=0)] = 0

    def list_numbers(self, task: float) -> tuple[float, ...]:
        """List the numbers of drivetwin_bench.c; `task` [s] is the time between two commands."""
        pedal = [one for column in zip(*self.pedal, strict=True) for one in column]
        faults = [number for one in self.faults for number in one.numbers]
        body = (task, self.wait, len(self.pedal), *pedal, len(self.faults), *faults)
        return (len(body) + 1.0, *map(float, body))

    def change_model(self, model: DualClutch, radius: float) -> DualClutch:
        """Return a driveline with mass, grade and gains of the scenario; wheel `radius` [m]."""
        inertia, (old, new) = self.mass * model.J_v, model.elements
        climb = inertia / radius * g * math.sin(math.atan(self.grade))
        return replace(
            model,
            J_v=inertia,
            load=replace(model.load, constant=model.load.constant + climb),
            elements=(
                replace(old, gain=self.gain_offgoing * old.gain),
                replace(new, gain=self.gain_oncoming * new.gain),
            ),
        )

    def change_unit(self, unit: ControlledUnit) -> ControlledUnit:
        """Return actuators with fill, lag and dead time of the scenario."""
        old, new = (
            replace(
                one,
                fill_time=self.fill * one.fill_time,
                rising_lag=self.lag * one.rising_lag,
                falling_lag=self.lag * one.falling_lag,
                dead_time=one.dead_time + self.dead_time,
            )
            for one in (unit.offgoing, unit.oncoming)
        )
        return replace(unit, offgoing=old, oncoming=new)

    def place_bench(self, given: UserController) -> UserController:
        """Put the numbers of the bench before those of the controller."""
        bench, oil = self.list_numbers(given.task), self.oil_temperature
        return replace(
            given,
            numbers=(*bench, *given.numbers),
            places=tuple(len(bench) + one for one in given.places),
            oil_temperature=given.oil_temperature if oil is None else oil,
        )


@dataclass(frozen=True)
class Check:
    """Assertion by its key: quantity, bound, worst value and its run, number of runs beyond.

    Bound and value are in SI, of `Scale.CHANGE` relative.
    """

    key: str
    quantity: str
    scale: Scale
    bound: float
    worst: float
    place: int
    failed: int


@dataclass(frozen=True, eq=False)
class Trial:
    """Result of a scenario; without an outcome `error` states the fault of the controller.

    `worst` has signals (n,) of the run `place` by name, SI, over `time` from the request [s].
    """

    scenario: Scenario
    outcome: Outcome | None = None
    certificate: Certificate | None = None
    checks: tuple[Check, ...] = ()
    place: int = 0
    worst: Mapping[str, FloatArray] = field(default_factory=dict)
    error: str = ""

    @property
    def failed(self) -> bool:
        """True where an assertion fails or the controller did."""
        return bool(self.error) or any(one.failed for one in self.checks)


def run_trials(
    twin: Twin, request: Request, given: UserController, scenarios: Sequence[Scenario]
) -> list[Trial]:
    """Run a controller through scenarios in a child process.

    Parameters
    ----------
    twin
        Identified driveline with actuators.
    request
        Operating point, spread and seed.
    given
        Controller, compiled with drivetwin_bench.c.
    scenarios
        Scenarios; the first is the one of `Scale.NOMINAL` and `Scale.CHANGE`.

    Returns
    -------
    list of Trial
        One for each scenario. A crash, an endless loop or a command that is not finite fails the
        scenario in which it happens.
    """

    run = partial(run_guarded, given.library, simulate_trials, twin, request, given)
    try:
        return list(run(scenarios))
    except ControllerError:  # it ended the child: each scenario gets one of its own
        return [_catch(partial(run, (scenarios[0], one)), one) for one in scenarios]


def _catch(work: Callable[[], Sequence[Trial]], scenario: Scenario) -> Trial:
    """Return the last result of a scenario, or the error of its controller."""
    try:
        return work()[-1]
    except ControllerError as error:
        return Trial(scenario, error=error.what)


def simulate_trials(
    twin: Twin, request: Request, given: UserController, scenarios: Sequence[Scenario]
) -> list[Trial]:
    """Run the scenarios in this process; see `run_trials`."""
    found: list[Trial] = []
    for number, scenario in enumerate(scenarios):
        notify_progress(number / len(scenarios), scenario.name)
        task = build_trial_task(twin, request, given, scenario)
        found.append(_catch(partial(_simulate_trial, task, scenario, found[:1]), scenario))
    return found


def build_trial_task(
    twin: Twin, request: Request, given: UserController, scenario: Scenario
) -> Task:
    """Build the problem of a scenario: the shift under its conditions, and its draws."""
    oil, point = request.oil, choose_point(twin, request)
    if oil.place(twin).log_temperature is None:
        oil = replace(oil, log_temperature=given.oil_temperature)
    old, new = scenario.shift.split("-")
    at = replace(
        request,
        gears=(old, new),
        engine_torque=scenario.torque * point.engine_torque,
        engine_speed=scenario.speed * point.engine_speed,
        oil_temperature=scenario.oil_temperature,
        oil=oil,
        limits=(),
        controller=scenario.place_bench(given),
    )
    task = build_task(twin, at)
    shift, draw, actuators = task.maneuver, task.draw.driveline, task.draw.actuators
    assert actuators is not None

    change = partial(scenario.change_model, radius=shift.wheel_radius)

    def draw_driveline(random: np.random.Generator) -> MakeDriveline | None:
        if (make := draw(random)) is None:
            return None
        return lambda random: replace(made := make(random), model=change(made.model))

    def draw_actuators(random: np.random.Generator) -> MakeActuators:
        make = actuators(random)
        return lambda random: scenario.change_unit(make(random))

    changed = replace(shift, model=change(shift.model), horizon=shift.request + scenario.duration)
    return replace(task, maneuver=changed, draw=Draw(draw_driveline, draw_actuators))


def _simulate_trial(task: Task, scenario: Scenario, first: Sequence[Trial]) -> list[Trial]:
    """Simulate a scenario; `first` has the result of the first one, if it is another."""
    space, shift, keys = Space(task.policy), task.maneuver, build_assertion_keys()
    control = space.build_control(space.start)
    assert isinstance(control, ClosedLoop)
    drawn = draw_scenarios(shift, task.draw, scenario.draws, task.seed, Purpose.CERTIFICATE)
    runs = Plant(shift, task.settings.threads).simulate(control, drawn, list_outputs(shift))
    outcome = compute_metrics(shift, runs, get_vehicle_inertias(shift, drawn))
    assert runs.inputs is not None
    values: dict[str, FloatArray] = {
        UNLOCKED: outcome.unlocked.astype(np.float64),
        RELOCKED: outcome.relocked.astype(np.float64),
        UNFINISHED: _find_unfinished(runs.inputs, control, scenario.pedal[-1][1]),
        **{name.value: one for name, one in outcome.values.items()},
    }
    nominal = first[0].outcome if first and first[0].outcome else outcome
    scales = {**values, **{name.value: one for name, one in nominal.values.items()}}
    checks = []
    for key, bound in scenario.bounds.items():
        (quantity, scale), torque = keys[key], abs(shift.point.engine_torque)
        of, reference = values[quantity], scales[quantity]
        if scale is Scale.CHANGE:
            both = min(of.size, reference.size)
            of = np.abs(of[:both] / reference[:both] - 1.0)
        factor = {Scale.NOMINAL: float(np.median(reference)), Scale.TORQUE: torque}.get(scale, 1.0)
        place, beyond = int(of.argmax()), int((of > factor * bound).sum())
        if bound < math.inf:
            checks.append(
                Check(key, quantity, scale, factor * bound, float(of[place]), place, beyond)
            )
    # Failed assertions count before others, then the worst value over the bound.
    worst = max(checks, key=lambda one: (one.failed > 0, one.worst / max(one.bound, 1e-9)),
                default=None)  # fmt: skip
    place = int(outcome.values[Metric.PEAK_JERK].argmax()) if worst is None else worst.place
    names = ("time", *(" of ".join(one) for one in list_outputs(shift)), *INPUTS)
    columns = (shift.time - shift.request, *runs.columns[place], *runs.inputs[place])
    signals = dict(zip(names, columns, strict=True))
    certificate = certify(outcome, (), task.settings.confidence)
    return [Trial(scenario, outcome, certificate, tuple(checks), place, signals)]


def _find_unfinished(inputs: FloatArray, control: ClosedLoop, pedal: float) -> FloatArray:
    """Return 1 for runs (runs,) whose inputs at the end are not those of the new gear, else 0."""
    torque, old, new = np.moveaxis(inputs[:, :3, -1], 1, 0)
    demand, pressure = pedal * control.controller.engine_torque, control.controller.system_pressure
    away = np.abs([(torque - demand) / demand, old / pressure, new / pressure - 1.0])
    return np.asarray((away >= _REST).any(axis=0), dtype=np.float64)


CONFIDENCE = 0.95
"""Confidence of intervals, and of all decisions together."""


@dataclass(frozen=True)
class Difference:
    """Paired difference of a metric in a scenario, second minus first controller, SI.

    `first` and `second` are means over `pairs` draws, `low` and `high` the interval of the mean
    difference by Student's t. `p` is that of Wilcoxon's signed-rank test, after Holm's correction
    for all rows of the comparison.
    """

    scenario: str
    metric: Metric
    pairs: int
    first: float
    second: float
    low: float
    high: float
    p: float

    @property
    def differs(self) -> bool:
        """True where the test rejects equal metrics."""
        return self.p < 1.0 - CONFIDENCE


def compare_trials(first: Sequence[Trial], second: Sequence[Trial]) -> list[Difference]:
    """Compare the metrics of two controllers in each scenario that both ran.

    Sources: F. Wilcoxon, Individual comparisons by ranking methods, Biometrics Bulletin 1 (1945);
    S. Holm, A simple sequentially rejective multiple test procedure, Scand. J. Statistics 6 (1979).
    """
    rows = [row for one, two in zip(first, second, strict=True) for row in _compare(one, two)]
    ordered, highest = sorted(range(len(rows)), key=lambda k: rows[k].p), 0.0
    for rank, k in enumerate(ordered):
        highest = max(highest, min(1.0, (len(rows) - rank) * rows[k].p))
        rows[k] = replace(rows[k], p=highest)
    return rows


def _compare(first: Trial, second: Trial) -> list[Difference]:
    if first.outcome is None or second.outcome is None:
        return []
    found = []
    for metric, before in first.outcome.values.items():
        after, pairs = second.outcome.values[metric], before.size
        change = after - before
        middle, spread = float(change.mean()), float(change.std(ddof=1)) if pairs > 1 else np.inf
        half = float(t.ppf(0.5 + 0.5 * CONFIDENCE, max(pairs - 1, 1))) * spread / np.sqrt(pairs)
        p = float(wilcoxon(change).pvalue) if np.any(change) else 1.0
        means = float(before.mean()), float(after.mean())
        found.append(
            Difference(first.scenario.name, metric, pairs, *means, middle - half, middle + half, p)
        )
    return found
