# SPDX-License-Identifier: MIT
"""File of the limits of a calibration and of the spread between units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from pydantic import Field, FiniteFloat
from scipy.constants import zero_Celsius

from drivetwin._util.toml import Fault, raise_faults, read_toml, validate_schema
from drivetwin.calibration.hardware import Hardware
from drivetwin.calibration.objective import Limit, build_limit_keys
from drivetwin.calibration.oil import FRICTION_SLOPE, FRICTION_SLOPE_STD, OilFriction
from drivetwin.calibration.spread import Spread
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.files.records import Record


class OilRecord(Record):
    """Table `[oil]`: oil temperature of the twin's log, and the friction over the temperature.

    A slope without a standard deviation has the usual relative one.
    """

    log_temperature_C: Annotated[FiniteFloat, Field(gt=-50, lt=200)] | None = None
    friction_slope_per_K: Annotated[FiniteFloat, Field(gt=-0.02, lt=0.02)] = FRICTION_SLOPE
    friction_slope_std_per_K: Annotated[FiniteFloat, Field(ge=0, lt=0.02)] | None = None

    def to_friction(self) -> OilFriction:
        """Return the friction over the oil temperature."""
        slope, std = self.friction_slope_per_K, self.friction_slope_std_per_K
        celsius = self.log_temperature_C
        return OilFriction(
            slope,
            FRICTION_SLOPE_STD * abs(slope) if std is None else std,
            None if celsius is None else celsius + zero_Celsius,
        )


class LimitsFile(Record):
    """File of limits: upper bounds, spread between units, oil, hardware, bounds of parameters."""

    limits: dict[str, Annotated[FiniteFloat, Field(gt=0)]]
    spread: Spread = Spread()
    oil: OilRecord = OilRecord()
    hardware: Hardware = Hardware()
    bounds: dict[str, FiniteFloat | tuple[FiniteFloat, FiniteFloat]] = Field(default_factory=dict)

    def list_bounds(self) -> dict[str, tuple[float, float]]:
        """Return lower and upper bounds of parameters; equal ones where a number is given."""
        return {
            name: one if isinstance(one, tuple) else (one, one) for name, one in self.bounds.items()
        }


@dataclass(frozen=True)
class Requirements:
    """Limits, spread, oil and hardware of a file, and bounds of the policy's parameters by name."""

    limits: tuple[Limit, ...]
    spread: Spread = field(default_factory=Spread)
    oil: OilFriction = field(default_factory=OilFriction)
    hardware: Hardware = field(default_factory=Hardware)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def load_limits(path: Path) -> Requirements:
    """Read a file of limits. Raises InputError that names every faulty key."""
    document = read_toml(path, InputError)
    remedy = "correct these entries; the how-to page on calibration lists the keys"
    keys = build_limit_keys()
    table = document.get("limits")
    unknown = [
        Fault(f"limits.{name}", f"unknown key{suggest_spelling(name, keys)}")
        for name in (table if isinstance(table, dict) else ())
        if name not in keys
    ]
    bounds = document.get("bounds")
    reversed_ones = [
        Fault(f"bounds.{name}", f"{one[0]!r} to {one[1]!r} does not increase")
        for name, one in (bounds.items() if isinstance(bounds, dict) else ())
        if isinstance(one, list) and len(one) == 2 and not one[0] < one[1]
    ]
    faults = [*validate_schema(document, LimitsFile), *unknown, *reversed_ones]
    raise_faults(faults, InputError, str(path), remedy)
    content = LimitsFile.model_validate(document)
    limits = tuple(Limit(keys[name][0], bound, keys[name][1])
                   for name, bound in content.limits.items())  # fmt: skip
    drawn = content.spread, content.oil.to_friction()
    return Requirements(limits, *drawn, content.hardware, content.list_bounds())
