# SPDX-License-Identifier: MIT
"""A calibration as named numbers and curves for calibration tools."""

from __future__ import annotations

from collections.abc import Iterator

from scipy.constants import zero_Celsius

from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.maneuver import OperatingPoint
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

    Of a map each parameter is a curve over the engine speed for each engine torque, and for each
    oil temperature if the map has an axis of it.
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
    columns = sorted({(place[0], *place[2:]) for place in mapped.points})
    for k, one in enumerate(mapped.main.task.policy.parameters):
        for torque, *oil in columns:
            points = [mapped.points[torque, j, *oil] for j in range(len(grid.speeds))]
            values = tuple(float(each.found.values[k]) for each in points)
            label, text = _name_column(points[0].task.maneuver.point)
            yield Curve(f"map.{one.name}.{label}", axis, values, one.unit, f"{one.text}, {text}")


def _name_column(point: OperatingPoint) -> tuple[str, str]:
    """Return label and words of the torque and oil temperature of a column of a map."""
    torque, kelvin = point.engine_torque, point.oil_temperature
    label, text = f"{torque:.0f}_Nm", f"at {torque:.6g} N*m"
    if kelvin is not None:
        label += f".{kelvin - zero_Celsius:.0f}_degC"
        text += f" and oil at {kelvin:.6g} K"
    return label.replace("-", "minus_"), text


def _build_curve(name: str, signal: Signal, request: float, labels: tuple[str, str]) -> Curve:
    times = tuple((signal.time - request).tolist())
    return Curve(name, Axis("time", times, "s"), tuple(signal.values.tolist()), *labels)
