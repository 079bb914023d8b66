# SPDX-License-Identifier: MIT
"""Motion of a dual clutch, read from the run of a network that contains it."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.simulation.dual_clutch import Trajectory
from drivetwin.simulation.network import NetworkRun, Output

OUTPUT, WHEEL, SHAFT = "output", "wheel", "output shaft"
"""Names of the output node, the wheel node and the output shaft in every such network."""


def list_motion_outputs(elements: Sequence[str], engine: str) -> list[Output]:
    """List the outputs of a trajectory.

    `elements` are the names of the shift elements, `engine` is the node of the engine speed.
    """
    return [
        *(("speed", node) for node in (engine, OUTPUT, WHEEL)),
        ("twist", SHAFT),
        ("shaft_torque", SHAFT),
        *(("slip", name) for name in elements),
        *(("friction_torque", name) for name in elements),
    ]


def build_trajectory(run: NetworkRun, elements: Sequence[str], engine: str) -> Trajectory:
    """Build the trajectory from a run with the outputs of `list_motion_outputs`."""
    motion = run.columns
    return Trajectory(
        time=run.time,
        engine_speed=motion["speed", engine],
        output_speed=motion["speed", OUTPUT],
        wheel_speed=motion["speed", WHEEL],
        twist=motion["twist", SHAFT],
        shaft_torque=motion["shaft_torque", SHAFT],
        clutch_torque={name: motion["friction_torque", name] for name in elements},
        slip={name: motion["slip", name] for name in elements},
        events=run.events,
        status=run.status,
        audit=run.audit,
    )
