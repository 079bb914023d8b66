# SPDX-License-Identifier: MIT
"""Units as powers of base units."""

from __future__ import annotations

import pytest

from drivetwin.errors import InputError
from drivetwin.export.parameters.spelling import parse_base_units
from drivetwin.parameters import SPECS


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("1", {}),
        ("Pa", {"kg": 1, "m": -1, "s": -2}),
        ("s/rad", {"s": 1, "rad": -1}),
        ("m^3", {"m": 3}),
        ("N*m*s^2/rad^2", {"kg": 1, "m": 2, "rad": -2}),
        ("rad/(s*N^0.5*m^0.5)", None),
        ("N/N", {}),
    ],
)
def test_powers(unit: str, powers: dict[str, int] | None) -> None:
    assert parse_base_units(unit) == powers


@pytest.mark.parametrize("unit", ["bar", "N m", "", "kg^", "m/", "rpm"])
def test_other_units_are_refused(unit: str) -> None:
    with pytest.raises(InputError, match="is not made of"):
        parse_base_units(unit)


def test_every_declared_parameter_has_base_units() -> None:
    assert all(parse_base_units(spec.unit) is not None for spec in SPECS.values())
