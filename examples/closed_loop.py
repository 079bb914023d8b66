# SPDX-License-Identifier: MIT
"""A shift controller with the exported observer inside, against the virtual dynamometer.

The plant is the exact model of the paper's driveline with hydraulic lags and noisy sensors; the
friction of its on-coming clutch fades from shift to shift. The controller runs every 10 ms and asks
for the clutch torque that ends the inertia phase in half a second. It turns torque into pressure by
the friction law of the twin, once times the scale estimated by the C observer, once as identified.

    python examples/closed_loop.py
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.export.c.loaded import CModel, CObserver, Estimates
from drivetwin.export.entries import Subject, compute_steady_start
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import DualClutch, FloatArray, Signal, State, Stribeck

TASK = 0.010
"""Period of the controller [s]."""
LAG = 0.020
"""Time constant of valve and clutch volume [s]."""
ENGINE_TORQUE = 1100.0
ENGINE_SPEED = 178.0
MAIN = 14e5
TARGET = 0.5
"""Wanted duration of the inertia phase [s]."""
FILL_END, HANDOVER_END, LONGEST = 0.20, 0.35, 2.0
SPEED_NOISE, PRESSURE_NOISE, TORQUE_NOISE = (0.1, 0.05), 2e3, 5.0
SHIFTS = 10
FADED = 0.7
"""Friction of the last shift over that of the first."""


@dataclass(frozen=True)
class Shift:
    """What one shift came to: durations in s, friction over that of the twin."""

    true_scale: float
    scale: float
    scale_std: float
    load: float
    inertia_phase: float
    torque_error: float
    """RMS error of the observed output torque over the shift [N m]."""


class Plant:
    """The driveline on the dynamometer, advanced task by task."""

    def __init__(self, model: DualClutch, rng: np.random.Generator) -> None:
        self.model = model
        self.state = compute_steady_start(model, model.elements[0].name, ENGINE_SPEED)
        self.pressures = np.array([MAIN, 0.0])
        self.output_torque = self.model.k_o * self.state.twist
        self._rng = rng

    def run(self, command: FloatArray) -> FloatArray:
        """Hold pressure commands (2,) [Pa] for one task; returns the mean pressures."""
        time = np.linspace(0.0, TASK, 11)
        course = command + np.outer(np.exp(-time / LAG), self.pressures - command)
        names = [element.name for element in self.model.elements]
        signals = {name: Signal(time, course[:, i].copy()) for i, name in enumerate(names)}
        torque = Signal(time, np.full(time.size, ENGINE_TORQUE))
        run = simulate(self.model, torque, signals, self.state, time)
        locked = tuple(n for n in names if abs(run.slip[n][-1]) < 1e-9)
        self.pressures = course[-1]
        self.state = State(
            engine_speed=float(run.engine_speed[-1]),
            output_speed=float(run.output_speed[-1]),
            wheel_speed=float(run.wheel_speed[-1]),
            twist=float(run.twist[-1]),
            locked=locked,
        )
        self.output_torque = float(run.shaft_torque[-1])
        return np.asarray(course.mean(axis=0), dtype=np.float64)

    def speeds(self) -> tuple[float, float]:
        """Measured speeds of engine and output [rad/s]."""
        noise = np.array(SPEED_NOISE) * self._rng.standard_normal(2)
        return self.state.engine_speed + noise[0], self.state.output_speed + noise[1]

    def inputs(self, pressures: FloatArray) -> list[float]:
        """Measured engine torque [N m] and pressures [Pa]."""
        torque = ENGINE_TORQUE + TORQUE_NOISE * self._rng.standard_normal()
        return [torque, *(pressures + PRESSURE_NOISE * self._rng.standard_normal(2))]


class Controller:
    """Pressure commands of a power-on upshift from the twin and the estimates of its observer."""

    def __init__(self, twin: DualClutch, adaptive: bool) -> None:
        self.twin = twin
        self.adaptive = adaptive
        self.locked = False
        self.off, self.on = twin.elements
        self._alpha = [1.0 / (twin.i_in * e.i_c) for e in twin.elements]
        self._inertia = twin.J1 * twin.eta + twin.J2e

    def command(self, time: float, known: Estimates, speeds: tuple[float, float]) -> FloatArray:
        """Pressures [Pa] for the next task."""
        if time < FILL_END or self.locked:
            return np.array([0.0, MAIN]) if self.locked else np.array([MAIN, self.on.P0])
        slip = speeds[0] * self._alpha[1] - self.on.i_out * speeds[1]
        self.locked = time > HANDOVER_END and slip < 1.0
        share = min(1.0, (time - FILL_END) / (HANDOVER_END - FILL_END))
        wanted = self._torque() if share == 1.0 else share * self._balance() / self._alpha[1]
        holding = (1.0 - share) * 1.2 * self._balance() / self._alpha[0]
        return np.array(
            [
                self._pressure(0, holding, 0.0, 1.0) if share < 1.0 else 0.0,
                self._pressure(1, wanted, slip, known.scale[1] if self.adaptive else 1.0),
            ]
        )

    def _balance(self) -> float:
        """Engine torque behind the losses [N m]."""
        return self.twin.eta * ENGINE_TORQUE

    def _torque(self) -> float:
        """Torque of the on-coming clutch that brings the engine down within the target."""
        drop = ENGINE_SPEED * (1.0 - self._ratio(1) / self._ratio(0))
        return (self._balance() + self._inertia * drop / TARGET) / self._alpha[1]

    def _ratio(self, index: int) -> float:
        element = self.twin.elements[index]
        return self.twin.i_in * element.i_c * element.i_out

    def _pressure(self, index: int, torque: float, slip: float, scale: float) -> float:
        element = self.twin.elements[index]
        mu = float(element.friction.evaluate(np.array([slip]))[0])
        return element.P0 + torque / (scale * mu * element.gain)


def faded(model: DualClutch, scale: float) -> DualClutch:
    """The model with the friction of its on-coming element scaled."""
    off, on = model.elements
    law = on.friction
    if not isinstance(law, Stribeck):
        raise TypeError("the scenario states a Stribeck law")
    weak = replace(law, mu_c=scale * law.mu_c, mu_s=scale * law.mu_s, mu_v=scale * law.mu_v)
    return replace(model, elements=(off, replace(on, friction=weak)))


def one_shift(plant: Plant, controller: Controller, observer: CObserver) -> Shift:
    """Drive one upshift; the observer keeps its friction estimate."""
    true_scale = plant.model.elements[1].friction.evaluate(np.zeros(1))[0]
    true_scale /= controller.twin.elements[1].friction.evaluate(np.zeros(1))[0]
    observer.restart_observer(plant.inputs(plant.pressures), plant.speeds())
    command, left, errors = np.array([MAIN, 0.0]), 0.0, []
    for task in range(int(LONGEST / TASK)):
        pressures = plant.run(command)
        speeds = plant.speeds()
        known = observer.update_estimates(plant.inputs(pressures), speeds, TASK)
        errors.append(known.output_torque - plant.output_torque)
        time = (task + 1) * TASK
        off, on = (element.name for element in plant.model.elements)
        if off in plant.state.locked:
            left = time
        if on in plant.state.locked and controller.locked:
            break
        command = controller.command(time, known, speeds)
    return Shift(
        true_scale=float(true_scale),
        scale=known.scale[1],
        scale_std=known.scale_std[1],
        load=known.load,
        inertia_phase=time - left,
        torque_error=float(np.sqrt(np.mean(np.square(errors)))),
    )


def drive(adaptive: bool, shifts: int = SHIFTS, seed: int = 0) -> list[Shift]:
    """Shift after shift while the friction fades from 1 to `FADED`."""
    twin = load_scenario("paper").model
    rng = np.random.default_rng(seed)
    start = compute_steady_start(twin, twin.elements[0].name, ENGINE_SPEED)
    exported = CModel(Subject("paper", twin, start))
    speeds = (start.engine_speed, start.output_speed)
    observer = CObserver(exported, [ENGINE_TORQUE, MAIN, 0.0], speeds)
    return [
        one_shift(Plant(faded(twin, scale), rng), Controller(twin, adaptive), observer)
        for scale in np.linspace(1.0, FADED, shifts)
    ]


def main() -> None:
    """Print both runs side by side."""
    adapted, fixed = drive(adaptive=True), drive(adaptive=False)
    print("friction of the on-coming clutch        inertia phase, wanted 0.50 s")
    print(" true   observed            observed T_o    adaptive   as identified")
    for a, b in zip(adapted, fixed, strict=True):
        print(
            f"{a.true_scale:5.2f}   {a.scale:5.3f} ± {a.scale_std:5.3f}   "
            f"rms {a.torque_error:5.0f} N·m{a.inertia_phase:12.2f} s{b.inertia_phase:14.2f} s"
        )


if __name__ == "__main__":
    main()
