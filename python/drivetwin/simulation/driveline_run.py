# SPDX-License-Identifier: MIT
"""Runs of a driveline with added elements, and their exact derivatives by any unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS, AddedElements
from drivetwin.simulation.driveline import (
    CRANK,
    ENGINE,
    OUTPUT,
    SHAFT,
    WALK,
    WHEEL,
    build_driveline,
    build_start,
)
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    Accuracy,
    DualClutch,
    Signal,
    State,
    Trajectory,
    collect_inputs,
)
from drivetwin.simulation.network import NetworkRun, Output, Start
from drivetwin.simulation.network import simulate as simulate_network

COMPARED: Mapping[str, Output] = {
    "output_torque": ("shaft_torque", SHAFT),
    "engine_speed": ("speed", ENGINE),
    "output_speed": ("speed", OUTPUT),
    "wheel_speed": ("speed", WHEEL),
}
"""Outputs that a log is compared with, by the role of the channel."""


@dataclass(frozen=True, eq=False)
class DrivelineTask:
    """A dual clutch with `added` elements, acting inputs, start, and `time` (n,) [s] of the run.

    `pressures` [Pa] are by shift element. The twist of `start` is the one that makes torque.
    """

    model: DualClutch
    added: AddedElements
    engine_torque: Signal
    pressures: Mapping[str, Signal]
    start: State
    time: FloatArray

    @property
    def inputs(self) -> dict[str, Signal]:
        """Inputs of the network by name."""
        found = {**self.pressures, ENGINE_TORQUE: self.engine_torque}
        if self.added.walk is not None:
            found[WALK] = Signal(self.added.walk.time, -self.added.walk.values)
        return found

    @property
    def names(self) -> list[str]:
        """Names of the shift elements."""
        return [one.name for one in self.model.elements]

    def simulate(self) -> Trajectory:
        """Simulate; a failed run returns its status.

        Raises InputError where the description is inconsistent.
        """
        return build_trajectory(self.record(self._list_outputs()), self.names)

    def record(self, outputs: Sequence[Output]) -> NetworkRun:
        """Simulate and record `outputs`; a failed run returns its status.

        Raises InputError where the description is inconsistent.
        """
        elements = build_driveline(self.model, self.added)
        return simulate_network(elements, self.inputs, self._build_start(), self.time, outputs)

    def _list_outputs(self) -> list[Output]:
        crank: list[Output] = [] if self.added.front is None else [("speed", CRANK)]
        return [*list_motion_outputs(self.names), *crank]

    def _build_start(self) -> Start:
        time = float(self.time[0])
        return build_start(self.model, self.added, self.start, self.engine_torque, time)


@check_arguments
def simulate(
    model: DualClutch,
    engine_torque: Signal,
    pressures: Mapping[str, Signal],
    start: State,
    time: FloatArray,
    *,
    audit: bool = False,
    accuracy: Accuracy | None = None,
) -> Trajectory:
    """Run the model from `time[0]` and return its trajectory on `time` (n,) [s], increasing.

    `pressures` maps element names to gauge pressures [Pa]; the signals must span `time`. Steps
    always end on input samples and events.
    Raises InputError where the description is inconsistent; a run that fails returns its status.
    """
    inputs = collect_inputs(engine_torque, pressures)
    begin = build_start(model, NO_ADDED_ELEMENTS, start, engine_torque, 0.0)
    names = [one.name for one in model.elements]
    given = (build_driveline(model), inputs, begin, time, list_motion_outputs(names))
    run = simulate_network(*given, audit=audit, accuracy=accuracy)
    return build_trajectory(run, names)


def list_motion_outputs(elements: list[str], output: str = OUTPUT) -> list[Output]:
    """List the outputs of a trajectory for the shift elements of these names.

    `output` is the node of the gearbox output.
    """
    return [
        *(("speed", node) for node in (ENGINE, output, WHEEL)),
        ("twist", SHAFT),
        ("shaft_torque", SHAFT),
        *(("slip", name) for name in elements),
        *(("friction_torque", name) for name in elements),
    ]


def build_trajectory(run: NetworkRun, elements: list[str], output: str = OUTPUT) -> Trajectory:
    """Build the trajectory from a run with the outputs of `list_motion_outputs`."""
    motion = run.columns
    return Trajectory(
        time=run.time,
        engine_speed=motion["speed", ENGINE],
        output_speed=motion["speed", output],
        wheel_speed=motion["speed", WHEEL],
        twist=motion["twist", SHAFT],
        shaft_torque=motion["shaft_torque", SHAFT],
        clutch_torque={name: motion["friction_torque", name] for name in elements},
        slip={name: motion["slip", name] for name in elements},
        events=run.events,
        status=run.status,
        audit=run.audit,
        crank_speed=motion.get(("speed", CRANK)),
    )
