# SPDX-License-Identifier: MIT
"""Bounds of usual hardware: torque intervention, its rate, pressure rates, kiss pressure.

The defaults are those of commercial-vehicle diesel engines and of electro-hydraulic valves, as
engineering estimates. Own hardware is stated in the file of limits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field
from scipy.constants import bar

from drivetwin.actuator.model import IN_BAR
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.objective import Limit

SOURCES: Mapping[Metric, str] = {
    Metric.TORQUE_REDUCTION: "usual: a diesel engine without loss of boost pressure",
    Metric.TORQUE_RATE: "usual: a diesel engine by its injection",
    Metric.PRESSURE_RATE: "usual: proportional valves and lines",
}
"""Reasons of the limits by metric."""


def _bound(key: str) -> Any:
    return Field(alias=key, gt=0, allow_inf_nan=True)


@dataclass(frozen=True)
class Hardware:
    """Largest values that hardware can do; `inf` stands for no bound.

    Intervention over the engine torque, rates of the engine torque [N m/s] and of pressures [Pa/s],
    kiss pressure over the contact pressure: beyond it the clutch carries torque while it is filled.
    """

    intervention: Annotated[float, _bound("intervention_share")] = 0.4
    torque_rate: Annotated[float, _bound("torque_rate_Nm_s")] = 5e3
    pressure_rate: Annotated[float, _bound("pressure_rate_bar_s"), IN_BAR] = 150.0 * bar
    kiss: Annotated[float, _bound("kiss_over_contact")] = 1.3

    def list_limits(self, torque: float) -> list[Limit]:
        """List the limits at an engine torque [N m], each with its source."""
        bounds = {
            Metric.TORQUE_REDUCTION: self.intervention * abs(torque),
            Metric.TORQUE_RATE: self.torque_rate,
            Metric.PRESSURE_RATE: self.pressure_rate,
        }
        usual = self == Hardware()
        return [
            Limit(name, bound, source=SOURCES[name] if usual else "hardware as stated")
            for name, bound in bounds.items()
            if 0.0 < bound < float("inf")
        ]


def add_hardware(limits: Sequence[Limit], hardware: Hardware, torque: float) -> tuple[Limit, ...]:
    """Add the limits of the hardware whose metrics have no limit of their own."""
    stated = {one.metric for one in limits}
    return (*limits, *(one for one in hardware.list_limits(torque) if one.metric not in stated))


def describe_unusual(values: Mapping[Metric, float], torque: float) -> str:
    """Describe in a line what lies beyond usual hardware; an empty text where nothing does."""
    beyond = [
        f"{METRICS[one.metric].label} {values[one.metric]:.4g} {METRICS[one.metric].unit} "
        f"(usual up to {one.bound:.4g})"
        for one in Hardware().list_limits(torque)
        if values[one.metric] > one.bound
    ]
    return f"Outside usual hardware: {', '.join(beyond)}." if beyond else ""
