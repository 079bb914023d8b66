# SPDX-License-Identifier: MIT
"""A calibration as named numbers and curves for calibration tools."""

from __future__ import annotations

from collections.abc import Iterator

from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.operating_map import OperatingMap
from drivetwin.calibration.profiles import ClosedLoop
from drivetwin.export.parameters.content import Axis, Curve, ParameterSet, Scalar
from drivetwin.simulation.dual_clutch import Signal

_CURVES = {
    "engine_torque": ("N*m", "engine torque demand"),
    "pressure.offgoing": ("Pa", "pressure of the off-going element, at the clutch"),
    "pressure.oncoming": ("Pa", "pressure of the on-coming element, at the clutch"),
}
"""Units and meanings of the profiles."""


def collect_calibration(
    found: Calibration, name: str, mapped: OperatingMap | None = None
) -> ParameterSet:
    """Collect the policy's parameters, and the profiles over the time from the request [s].

    Of a map each parameter is a curve over the engine speed for each engine torque.
    """
    task = found.task
    values = zip(task.policy.parameters, found.after.values.tolist(), strict=True)
    request = task.maneuver.request
    return ParameterSet(
        name=name,
        scalars=tuple(Scalar(one.name, value, one.unit, one.text) for one, value in values),
        curves=tuple(
            _build_curve(f"profile.{label}", signal, request, _CURVES[label])
            for label, signal in found.after.profiles.signals.items()
        )
        + (() if mapped is None else tuple(_iterate_map_curves(mapped))),
        notes=(
            f"engine torque {task.maneuver.point.engine_torque:.6g} N*m, engine speed "
            f"{task.maneuver.point.engine_speed:.6g} rad/s at the request",
            _describe_pressures(found),
        ),
    )


def _describe_pressures(found: Calibration) -> str:
    if isinstance(found.after.control, ClosedLoop):
        return (
            "pressures of parameters are commands of the controller; profiles are those at the "
            "clutches of the nominal unit"
        )
    return (
        "pressures are those at the clutch, not commands: dead time, lag and filling of the "
        "actuator are not subtracted"
    )


def _iterate_map_curves(mapped: OperatingMap) -> Iterator[Curve]:
    grid = mapped.grid
    axis = Axis("engine_speed", grid.speeds, "rad/s")
    for k, one in enumerate(mapped.main.task.policy.parameters):
        for i, torque in enumerate(grid.torques):
            points = (mapped.points[i, j] for j in range(len(grid.speeds)))
            values = tuple(float(each.found.values[k]) for each in points)
            label = f"map.{one.name}.{torque:.0f}_Nm".replace("-", "minus_")
            yield Curve(label, axis, values, one.unit, f"{one.text}, at {torque:.6g} N*m")


def _build_curve(name: str, signal: Signal, request: float, labels: tuple[str, str]) -> Curve:
    times = tuple((signal.time - request).tolist())
    return Curve(name, Axis("time", times, "s"), tuple(signal.values.tolist()), *labels)
