# SPDX-License-Identifier: MIT
"""Made vehicles with hydraulics that depart from the model, and controlled shifts on them.

The true shift is simulated without the closed loop of the core, by the controller of
`tests.support.upshift.closed_loop`. Before each task the network of the departed vehicle runs from
the start to that task, with the pressures of the true actuators.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TypedDict

import numpy as np
from scipy.signal import lfilter

from benchmarks.estimation.mismatch_log import Rates, hold_load, set_rates
from benchmarks.estimation.validity import draw_size
from benchmarks.estimation.vehicles import (
    FILL,
    SHIFT,
    Vehicle,
    add_tolerances,
    draw_vehicle,
    misread,
)
from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import ActuatorModel, HeldSignal
from drivetwin.calibration.maneuver import ClosedLoop, Maneuver
from drivetwin.calibration.metrics import Metric, Runs, compute_metrics
from drivetwin.calibration.objective import CalibrationSettings
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.twin_task import Request
from drivetwin.channels.roles import Quantity, make_command_role
from drivetwin.channels.units import BAR
from drivetwin.dyno.dyno import DynoRun, apply_effects, run
from drivetwin.dyno.scenario import ControlledActuator, Program, Scenario, Sensor
from drivetwin.dyno.scenario_file import convert_channels
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import (
    NominalRun,
    SyntheticVehicle,
)
from drivetwin.logs.read import read_log
from drivetwin.logs.write import write_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.simulation.dual_clutch import Signal, Trajectory
from drivetwin.simulation.shift_control import ShiftController
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.effects import EffectId
from tests.support.upshift.closed_loop import Controller

EFFECTS = (
    EffectId.EFFICIENCY_BY_GEAR,
    EffectId.FRICTION_PRESSURE,
    EffectId.PRESSURE_DELAY,
    EffectId.TYRE_SLIP,
    EffectId.FRICTION_SHAPE,
    EffectId.DRUM_INERTIA,
    EffectId.INPUT_DRAG,
    EffectId.PROGRESSIVE_SHAFT,
    EffectId.TORQUE_LAG,
)
"""Effects that take turns."""
COMMAND_RATE = 100.0
"""Rate of the logged commands [Hz]."""
_STEP = 1e-3
"""Sampling step of inputs and pressures [s]."""


class ActingInputs(TypedDict):
    """Engine torque [N m] and pressures [Pa] as they act on a vehicle."""

    engine_torque: Signal
    pressures: Mapping[str, Signal]


@dataclass(frozen=True)
class _LogRanges(NominalRun):
    """Nominal run with other inputs than those of the log, whose pressure ranges it keeps."""

    log: NominalRun

    def get_pressure_range(self, element: str, P0: float) -> float:
        """Return the range of the log [Pa]."""
        return self.log.get_pressure_range(element, P0)


@dataclass(frozen=True, eq=False)
class MadeVehicle:
    """A vehicle with the effect of a size, the run of its log, and the twin of that log."""

    seed: int
    scenario: Scenario
    effects: dict[EffectId, float]
    recorded: DynoRun
    engine_lag: float
    twin: Twin

    @cached_property
    def nominal(self) -> NominalRun:
        """Run of the log without effects, to which their sizes are related."""
        clean = run(self.scenario, self.seed, noise=0.0)
        grid = np.arange(0.0, self.scenario.duration, _STEP)
        pressures = {
            name: Signal(grid, one.compute_pressure(grid))
            for name, one in self.scenario.actuators.items()
        }
        torque = Signal(grid, self.scenario.compute_torque(grid))
        return NominalRun(self.scenario.model, clean.trajectory, torque, pressures)

    @cached_property
    def vehicle(self) -> SyntheticVehicle:
        """Vehicle with the effects."""
        gears = [gear.element for gear in self.scenario.gears]
        return apply_effects(self.nominal, self.effects, gears, self.seed)

    def simulate(
        self, shift: Maneuver, torque: Signal, pressures: dict[str, Signal], time: FloatArray
    ) -> Trajectory:
        """Simulate a shift with pressures at the clutches on `time` (n,) [s]."""
        start = replace(shift, model=self.scenario.model).build_start()
        acting = self.build_acting(torque, pressures)
        return replace(self.vehicle, **acting).simulate(start, time)

    def build_request(self, policy: PolicyKind, settings: CalibrationSettings) -> Request:
        """Return the calibration of the log's shift on the twin, at its operating point."""
        motion, drive = self.recorded.trajectory, self.scenario
        return Request(
            gears=(drive.start_gear, drive.end_gear),
            wheel_radius=0.5,
            engine_torque=drive.engine_torque.knots[-1][1],
            engine_speed=float(np.interp(SHIFT, motion.time, motion.engine_speed)),
            policy=policy,
            settings=settings,
            seed=self.seed,
        )

    def build_acting(self, torque: Signal, pressures: dict[str, Signal]) -> ActingInputs:
        """Return engine torque and pressures as they act on the vehicle."""
        given = _LogRanges(
            self.scenario.model, self.nominal.trajectory, torque, pressures, self.nominal
        )
        found = apply_effects(given, self.effects, self.vehicle.gears, self.seed)
        return {"engine_torque": found.engine_torque, "pressures": found.pressures}


def make_vehicle(
    seed: int,
    *,
    whole: bool = True,
    parts: bool = False,
    turns: Sequence[EffectId | None] = EFFECTS,
) -> MadeVehicle:
    """Make the vehicle of `seed`, its log and the twin; without `whole` it has no effect.

    The effect is that of `turns` whose turn it is. The twin has parts beside the dual clutch only
    with `parts`.
    """
    drawn = draw_vehicle(seed)
    scenario = add_hydraulics(drawn.scenario, np.random.default_rng([seed, 41]))
    effect = turns[seed % len(turns)] if whole else None
    effects = {} if effect is None else {effect: draw_size(seed, effect, 1.0)}
    recorded = misread(run(scenario, seed, effects=effects), seed)
    twin = _identify(replace(drawn, card=add_tolerances(drawn.card, scenario)), recorded)
    twin = twin if parts else twin.drop_added_elements()
    lag = float(np.random.default_rng([seed, 42]).uniform(0.03, 0.07))
    return MadeVehicle(seed, scenario, effects, recorded, lag, twin)


def measure_true_shift(
    made: MadeVehicle, shift: Maneuver, control: ClosedLoop
) -> dict[Metric, float]:
    """Return the metrics of a controlled shift of the true vehicle."""
    run_true = run_controlled(made, shift, control)
    columns = np.stack(
        [
            run_true.shaft_torque,
            *(
                one[name]
                for name in (shift.offgoing.name, shift.oncoming.name)
                for one in (run_true.clutch_torque, run_true.slip)
            ),
        ]
    )
    name = shift.oncoming.name
    locks = [one.time for one in run_true.events if one.kind == "lock" and one.element == name]
    lock = locks[-1] if locks else float("nan")
    vehicle = np.array([made.scenario.model.J_v])
    outcome = compute_metrics(shift, Runs(columns[None], np.array([lock])), vehicle)
    return {metric: float(values[0]) for metric, values in outcome.values.items()}


def run_controlled(made: MadeVehicle, shift: Maneuver, control: ClosedLoop) -> Trajectory:
    """Simulate a shift task by task, each by a run from the start."""
    given = control.controller
    assert isinstance(given, ShiftController), "the built-in controller is restated here"
    names = given.offgoing, given.oncoming
    controller, slips = Controller(_list_numbers(given)), (0.0, 0.0)
    count = (shift.time.size - 1) // round(given.task / _STEP)
    tasks: FloatArray = given.task * np.arange(count, dtype=np.float64)
    commands: list[tuple[float, float, float]] = []
    for number, task in enumerate(tasks.tolist()):
        if number:
            held = tasks[:number], np.array(commands)
            motion = _simulate(made, shift, held, np.array([0.0, task]))
            slips = float(motion.slip[names[0]][-1]), float(motion.slip[names[1]][-1])
        commands.append(controller.command(task, slips))
    return _simulate(made, shift, (tasks, np.array(commands)), shift.time)


def _list_numbers(given: ShiftController) -> dict[str, float]:
    return {name: value for name, value in vars(given).items() if isinstance(value, float)}


def _simulate(
    made: MadeVehicle, shift: Maneuver, held: tuple[FloatArray, FloatArray], time: FloatArray
) -> Trajectory:
    """Simulate under held commands: their times (k,), torque and both pressures (k, 3)."""
    tasks, commands = held
    names = shift.offgoing.name, shift.oncoming.name
    pressures = {}
    for name, values in zip(names, commands.T[1:], strict=True):
        actuator = made.scenario.actuators[name]
        assert isinstance(actuator, ControlledActuator)
        pressure = actuator.model.compute_pressure(HeldSignal(tasks, values.copy()), shift.time)
        pressures[name] = Signal(shift.time, pressure)
    wanted = HeldSignal(tasks, commands[:, 0].copy()).evaluate(shift.time)
    decay = float(np.exp(-_STEP / made.engine_lag))
    first = [wanted[0] * decay]
    torque, _ = lfilter([1.0 - decay], [1.0, -decay], wanted[:-1], zi=first)
    torque = np.concatenate([wanted[:1], torque])
    return made.simulate(shift, Signal(shift.time, torque), pressures, time)


def add_hydraulics(scenario: Scenario, random: np.random.Generator) -> Scenario:
    """Put controlled actuators and their commands in the place of the drawn ones."""
    going, coming = (scenario.get_element(gear.element) for gear in scenario.gears)
    common = {
        "dead_time": float(random.uniform(0.01, 0.03)),
        "rising_lag": float(random.uniform(0.012, 0.03)),
        "falling_lag": float(random.uniform(0.015, 0.035)),
        "damping": float(random.uniform(0.7, 1.1)),
        "hysteresis": float(random.uniform(0.0, 1.5e4)),
    }
    models = {
        one.name: ActuatorModel(
            **common, kiss_pressure=0.92 * one.P0, fill_time=float(random.uniform(0.08, 0.15))
        )
        for one in (going, coming)
    }
    drawn = {name: one.command.knots for name, one in scenario.actuators.items()}
    kiss = models[coming.name].kiss_pressure
    fast, slow, last = kiss + 2.8 * BAR, kiss + BAR, drawn[coming.name][3:]
    knots = (
        *((0.30, 0.0), (0.31, fast), (0.36, fast), (0.37, 0.95 * kiss), (0.60, 0.0)),
        *((0.90, 0.0), (0.91, slow), (1.00, slow), (1.01, 0.0)),
        *((SHIFT, 0.0), (SHIFT + 0.01, fast), (SHIFT + 0.06, fast), (SHIFT + 0.07, kiss)),
        *((SHIFT + FILL, kiss), *last),
    )
    commands = {going.name: Program(drawn[going.name]), coming.name: Program(knots)}
    sensors = tuple(
        Sensor(
            make_command_role(name), Quantity.PRESSURE, f"Prs{name}Cmd", "bar", COMMAND_RATE, 0.0
        )
        for name in models
    )
    actuators = {name: ControlledActuator(commands[name], models[name]) for name in models}
    given = set_rates(hold_load(scenario), Rates.LOGGER)
    return replace(given, actuators=actuators, sensors=(*given.sensors, *sensors))


def _identify(vehicle: Vehicle, recorded: DynoRun) -> Twin:
    """Identify the log of a vehicle as it is written and read."""
    with tempfile.TemporaryDirectory() as folder:
        log_file, card_file = Path(folder) / "log.csv", Path(folder) / "card.toml"
        write_log(log_file, convert_channels(recorded))
        card_file.write_text(vehicle.card, encoding="utf-8")
        card = load_card(card_file)
        log = read_log(log_file, card)
        return build_twin(identify(log, card, detect_shifts(log, card)), card)
