# SPDX-License-Identifier: MIT
"""Proposals of units: the usual ranges of each role, and none where nothing fits."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.roles import ROLES, get_quantity
from drivetwin.channels.units import (
    prefer_common_units,
    propose_time_units,
    propose_units,
    resolve_channel_unit,
)
from drivetwin.errors import Where


@pytest.mark.parametrize(
    ("role", "span", "units"),
    [
        ("input_speed", (1143.0, 1491.0), ["rpm"]),
        ("engine_speed", (600.0, 2200.0), ["rpm"]),
        ("input_speed", (119.0, 156.0), ["rad/s"]),
        ("output_speed", (300.0, 600.0), ["rpm", "rad/s"]),
        ("wheel_speed", (150.0, 170.0), ["rpm"]),
        ("input_speed", (-1491.0, -1143.0), ["rpm"]),
        ("pressure.B2", (0.0, 14.0), ["bar"]),
        ("pressure.B2", (-0.1, 6.0), ["bar"]),
        ("pressure.B2", (0.3e6, 0.6e6), ["Pa"]),
        ("pressure.B2", (0.0, 1400.0), ["kPa"]),
        ("pressure.B2", (0.0, 1.4), ["MPa"]),
        ("throttle", (0.0, 100.0), ["%"]),
        ("throttle", (0.0, 1.0), ["-"]),
        ("engine_torque", (-80.0, 2002.0), ["Nm"]),
        ("output_torque", (-961.0, 5558.0), ["Nm"]),
        ("output_torque", (-1.0, 5.6), ["kNm"]),
        ("gear", (1.0, 6.0), []),
        ("input_speed", (-1500.0, 1500.0), []),
        ("pressure.B2", (0.0, 0.0), []),
        ("input_speed", None, []),
    ],
)
def test_units_by_values(role: str, span: tuple[float, float] | None, units: list[str]) -> None:
    found = propose_units(role, span)
    assert [one.unit for one in found] == units
    if span is not None:
        assert all(f"{span[1]:.4g}" in one.reason for one in found)


def test_a_torque_that_may_be_in_percent_is_told() -> None:
    (found,) = propose_units("engine_torque", (0.0, 100.0))
    assert "scale = reference torque/100" in found.reason


def test_of_several_units_that_of_the_other_channels_is_proposed() -> None:
    found = prefer_common_units(
        {
            "input_speed": propose_units("input_speed", (1000.0, 1500.0)),
            "output_speed": propose_units("output_speed", (300.0, 600.0)),
            "pressure.B2": propose_units("pressure.B2", (0.0, 3.0)),
        }
    )
    assert [one.unit for one in found["output_speed"]] == ["rpm"]
    assert "the other speed channels" in found["output_speed"][0].reason
    assert [one.unit for one in found["pressure.B2"]] == ["bar", "MPa"]


@pytest.mark.parametrize(
    ("step", "units"),
    [(1e-3, ["s"]), (0.01, ["s"]), (1.0, ["ms"]), (10.0, ["ms"]), (1e3, ["us"]), (0.0, [])],
)
def test_units_of_time_by_the_step(step: float, units: list[str]) -> None:
    assert [one.unit for one in propose_time_units(step)] == units


_NUMBER = st.floats(-1e9, 1e9)


@given(st.sampled_from([*ROLES, "pressure.K1"]), _NUMBER, _NUMBER)
def test_a_proposed_unit_is_one_of_the_role(role: str, one: float, other: float) -> None:
    for proposal in propose_units(role, (min(one, other), max(one, other))):
        resolve_channel_unit(proposal.unit, get_quantity(role), Where())
