# SPDX-License-Identifier: MIT
"""Runs of a driveline with added elements and their derivatives; libraries of controllers."""

from __future__ import annotations

import ctypes
import mmap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin.errors import InputError, Where
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

INPUTS = (
    *("time", "offgoing_slip", "oncoming_slip", "engine_speed", "output_speed"),
    *("engine_torque", "system_pressure", "oil_temperature"),
)
"""Inputs of a call in the order of the trace and of `dt_inputs`; SI."""
_PLACES = 256
"""Runs at once that the trace has a place for: more than cores."""
_FREE, _IN_CALL = 0, 2
_STATE_SIZE, _STEP = "dt_state_size", "dt_step"


@dataclass(frozen=True)
class LibraryAddresses:
    """Addresses of the functions of a loaded library, and of its trace with `places` places."""

    state_size: int
    step: int
    trace: int
    places: int


@dataclass(frozen=True, eq=False)
class Call:
    """Call of a controller in progress: place in the trace, its number, inputs by name."""

    place: int
    number: int
    inputs: dict[str, float]


def name_trace(library: Path) -> Path:
    """Return the path of the trace of a library."""
    return library.with_name(f"{library.name}.trace")


def create_trace(library: Path) -> None:
    """Create the empty trace of a library."""
    name_trace(library).write_bytes(bytes(8 * _PLACES * (2 + len(INPUTS))))


def read_calls(library: Path) -> list[Call]:
    """Read the calls in progress from the trace of a library."""
    data = np.fromfile(name_trace(library), dtype=np.uint64).reshape(_PLACES, -1)
    return [
        Call(place, int(row[1]), dict(zip(INPUTS, _to_floats(row[2:]), strict=True)))
        for place, row in enumerate(data)
        if row[0] == _IN_CALL
    ]


def _to_floats(bits: np.ndarray[tuple[int], np.dtype[np.uint64]]) -> list[float]:
    numbers: list[float] = bits.view(np.float64).tolist()
    return numbers


@cache
def load_library(path: Path) -> LibraryAddresses:
    """Load a library for the rest of this process; its trace is used where it exists.

    Raises InputError where it cannot be loaded or misses a function of the interface.
    """
    try:
        loaded = ctypes.CDLL(str(path))
        functions = [getattr(loaded, name) for name in (_STATE_SIZE, _STEP)]
    except (OSError, AttributeError) as error:
        raise InputError(
            f"the controller has no usable library: {error}",
            f"define {_STATE_SIZE} and {_STEP} as drivetwin_controller.h declares them",
            Where(file=str(path)),
        ) from error
    size, step = (ctypes.cast(one, ctypes.c_void_p).value or 0 for one in functions)
    trace = name_trace(path)
    if not trace.is_file():
        return LibraryAddresses(size, step, 0, 0)
    with trace.open("r+b") as file:
        mapped = mmap.mmap(file.fileno(), 0)
    _MAPS.append(mapped)
    address = ctypes.addressof(ctypes.c_char.from_buffer(mapped))
    return LibraryAddresses(size, step, address, _PLACES)


_MAPS: list[mmap.mmap] = []
"""Traces of loaded libraries; the core keeps their addresses."""


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
