# SPDX-License-Identifier: MIT
"""The table of a torque converter in a vehicle card or powertrain file."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import Field, model_validator

from drivetwin._util.toml import StrictModel
from drivetwin.channels.units import RPM
from drivetwin.simulation.added_elements import Converter

_PER_1000RPM = 1000.0 * RPM

Curve = Annotated[list[float], Field(min_length=2)]

_MEASURED, _OF_LARGEST = 0.02, 0.01
"""Power that a measured map may give too much: over that taken, or over that of the largest torque
of the pump, which is what errors near synchronism are small against."""


class ConverterTable(StrictModel):
    """`[converter]`: pump torque at 1000 rpm times `scale`, and torque ratio, over speed ratio."""

    speed_ratio: Curve
    torque_ratio: Curve
    pump_torque_at_1000rpm_Nm: Curve
    scale: Annotated[float, Field(gt=0)] = 1.0

    @model_validator(mode="after")
    def _check_lengths(self) -> ConverterTable:
        lengths = {len(self.torque_ratio), len(self.pump_torque_at_1000rpm_Nm)}
        if lengths != {len(self.speed_ratio)}:
            raise ValueError("torque_ratio and pump_torque go with the points of speed_ratio")
        if not all(a < b for a, b in pairwise(self.speed_ratio)):
            raise ValueError("speed_ratio must increase")
        if min(self.torque_ratio) < 0.0:
            raise ValueError("torque_ratio must not be negative")
        points = zip(
            self.speed_ratio, self.torque_ratio, self.pump_torque_at_1000rpm_Nm, strict=True
        )
        largest = max(map(abs, self.pump_torque_at_1000rpm_Nm))
        # Of the pump's power the share 1 - mν is lost; in overrun the pump gives the power.
        creating = [
            nu
            for nu, m, torque in points
            if torque * (1 - m * nu) < -max(_MEASURED * abs(torque), _OF_LARGEST * largest)
        ]
        if creating:
            at = ", ".join(f"{nu:g}" for nu in creating)
            raise ValueError(f"more power leaves than enters at speed_ratio {at}")
        return self

    @classmethod
    def from_converter(cls, converter: Converter) -> ConverterTable:
        """The table of a map in SI."""
        return cls(
            speed_ratio=list(converter.speed_ratio),
            torque_ratio=list(converter.torque_ratio),
            pump_torque_at_1000rpm_Nm=[
                round(each * _PER_1000RPM**2, 9) for each in converter.capacity
            ],
        )

    def to_spec(self) -> Converter:
        """Return the map in SI."""
        per_square = self.scale / _PER_1000RPM**2
        return Converter(
            speed_ratio=tuple(self.speed_ratio),
            capacity=tuple(torque * per_square for torque in self.pump_torque_at_1000rpm_Nm),
            torque_ratio=tuple(self.torque_ratio),
        )
