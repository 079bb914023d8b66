# SPDX-License-Identifier: MIT
"""Sensor classes with typical tolerances; `sensor_classes.toml` has values and sources."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from pydantic import Field, RootModel

from drivetwin._util.toml import StrictModel, read_toml
from drivetwin.channels.roles import Quantity, get_pressure_element, get_quantity
from drivetwin.errors import CardError

_TABLE = Path(__file__).with_suffix(".toml")

UNITS = {Quantity.TORQUE: "Nm", Quantity.SPEED: "rpm", Quantity.PRESSURE: "bar"}
"""Unit of offset tolerances on a card, and suffix of their keys."""


class SensorClass(StrictModel):
    """Largest constant errors of a kind of sensor.

    `roles` are the channel roles that have such sensors, by default all of the quantity.
    `gain_limit` is relative to the value, `offset_limit` [N·m, rpm or bar] absolute and
    `offset_limit_share` relative to the end of the measuring range. `source` names the document and
    `address` its place.
    """

    quantity: str
    roles: list[str] = Field(default_factory=list)
    title: str = Field(min_length=1)
    gain_limit: float = Field(default=0.0, ge=0, lt=1)
    offset_limit: float = Field(default=0.0, ge=0)
    offset_limit_share: float = Field(default=0.0, ge=0, lt=1)
    source: str = Field(min_length=1)
    address: str = Field(pattern="^https://")


@dataclass(frozen=True)
class SensorAnswer:
    """A sensor: name of its class, and end of its measuring range [N·m, rpm or bar]."""

    name: str
    full_scale: float = 0.0

    @property
    def sensor_class(self) -> SensorClass:
        """Class of the sensor."""
        return read_sensor_classes()[self.name]

    @property
    def gain_tolerance(self) -> float:
        """Standard deviation of the relative gain error."""
        return self.sensor_class.gain_limit / math.sqrt(3.0)

    @property
    def offset_tolerance(self) -> float:
        """Standard deviation of the offset error [N·m, rpm or bar]."""
        found = self.sensor_class
        limit = found.offset_limit + found.offset_limit_share * self.full_scale
        return limit / math.sqrt(3.0)


@cache
def read_sensor_classes() -> dict[str, SensorClass]:
    """Read the sensor classes by name."""
    model = RootModel[dict[str, SensorClass]]
    return model.model_validate(read_toml(_TABLE, CardError)).root


def list_classes(role: str) -> list[str]:
    """List the names of the classes of sensors for a channel role, or for `pressure`."""
    quantity = Quantity.PRESSURE if role == "pressure" else get_quantity(role)
    return [
        name
        for name, one in read_sensor_classes().items()
        if one.quantity == quantity and (not one.roles or role in one.roles)
    ]


def get_offset_unit(role: str) -> str:
    """Return the unit of the offset tolerance of a role, as the keys of a card have it."""
    is_pressure = role == "pressure" or get_pressure_element(role) is not None
    return UNITS[Quantity.PRESSURE if is_pressure else get_quantity(role)]


def parse_sensor(text: str, role: str) -> SensorAnswer | None:
    """Parse CLASS, CLASS:RANGE or `none`; ValueError lists the classes of the role."""
    name, _, size = text.strip().partition(":")
    name = name.strip()
    if name == "none":
        return None
    known = list_classes(role)
    if name not in known:
        raise ValueError(f"{name!r} is no sensor class of {role}: {', '.join(known)}, or none")
    if not read_sensor_classes()[name].offset_limit_share:
        if size:
            raise ValueError(f"the class {name} has no range: write {name} alone")
        return SensorAnswer(name)
    unit = get_offset_unit(role)
    try:
        full_scale = float(size)
    except ValueError:
        full_scale = math.nan
    if not 0.0 < full_scale <= 1e9:
        raise ValueError(
            f"the offset of {name} is a share of the measuring range: write {name}:RANGE with the "
            f"largest value that the sensor measures [{unit}]"
        )
    return SensorAnswer(name, full_scale)
