# SPDX-License-Identifier: MIT
"""The unit table: spellings in use mean what they say, doubtful ones are refused with a reason."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.units import (
    UNITS,
    find_unit,
    get_time_factor,
    is_unit,
    resolve_channel_unit,
)
from drivetwin.errors import UnitError, Where

HERE = Where(file="log.csv", channel="X")
RPM = 2.0 * math.pi / 60.0


@pytest.mark.parametrize(
    ("spelling", "factor"),
    [
        *((text, 1.0) for text in ("Nm", "N·m", "N.m", "N*m", "N m", "[Nm]", "NM", "N⋅m", "N∙m")),
        *((text, 1e3) for text in ("kNm", "kN·m", " kNm ")),
        ("Ncm", 1e-2),
        ("ft·lb", 1.3558179483314004),
        ("lbf-ft", 1.3558179483314004),
        *((text, 1.3558179483314004) for text in ("ft-lbs", "ft lbs", "ft·lbf", "lbf.ft")),
        *((text, 0.0254 * 4.4482216152605) for text in ("in-lb", "in.lbf", "lb-in", "lbf·in")),
    ],
)
def test_torque_spellings(spelling: str, factor: float) -> None:
    assert resolve_channel_unit(spelling, Quantity.TORQUE, HERE).factor == pytest.approx(
        factor, rel=1e-15
    )


@pytest.mark.parametrize(
    ("spelling", "factor"),
    [
        *((text, RPM) for text in ("rpm", "RPM", "1/min", "U/min", "u/min", "min-1", "min⁻¹")),
        *((text, RPM) for text in ("r/min", "rev/min", "1 / min", "min^-1", "/min", "Upm")),
        *((text, 1.0) for text in ("rad/s", "rad·s⁻¹", "rad*s-1", "RAD/S")),
        ("krpm", 1e3 * RPM),
        ("U/s", 2.0 * math.pi),
        ("°/s", math.pi / 180.0),
    ],
)
def test_speed_spellings(spelling: str, factor: float) -> None:
    assert resolve_channel_unit(spelling, Quantity.SPEED, HERE).factor == pytest.approx(
        factor, rel=1e-15
    )


@pytest.mark.parametrize(
    ("spelling", "factor"),
    [
        ("Pa", 1.0),
        ("hPa", 1e2),
        ("mbar", 1e2),
        ("kPa", 1e3),
        ("KPA", 1e3),
        ("bar", 1e5),
        ("Bar", 1e5),
        ("(bar)", 1e5),
        ("MPa", 1e6),
        ("N/mm²", 1e6),
        ("psi", 6894.757293168361),
        ("PSI", 6894.757293168361),
        ("kgf/cm²", 98066.5),
    ],
)
def test_pressure_spellings(spelling: str, factor: float) -> None:
    assert resolve_channel_unit(spelling, Quantity.PRESSURE, HERE).factor == factor


def test_fraction_and_temperature() -> None:
    assert resolve_channel_unit("%", Quantity.FRACTION, HERE).factor == 0.01
    assert resolve_channel_unit("-", Quantity.FRACTION, HERE).factor == 1.0
    celsius = resolve_channel_unit("°C", Quantity.TEMPERATURE, HERE)
    assert celsius.to_si(np.array([20.0])) == pytest.approx(np.array([293.15]))
    fahrenheit = resolve_channel_unit("°F", Quantity.TEMPERATURE, HERE)
    assert fahrenheit.to_si(np.array([212.0])) == pytest.approx(np.array([373.15]))
    assert resolve_channel_unit("℃", Quantity.TEMPERATURE, HERE) == celsius


def test_case_is_told_apart_only_where_it_carries_the_size() -> None:
    assert find_unit("MPa") != find_unit("mPa")
    assert find_unit("mPa") is None
    folded = [spelling.casefold() for spelling in UNITS if spelling.casefold() not in UNITS]
    assert len(folded) == len(set(folded))


@pytest.mark.parametrize(
    ("spelling", "quantity", "reason"),
    [
        ("1/s", Quantity.SPEED, "revolutions or radians"),
        ("Hz", Quantity.SPEED, "revolutions or radians"),
        ("km/h", Quantity.SPEED, "tyre radius"),
        ("m/s", Quantity.SPEED, "tyre radius"),
        ("mpa", Quantity.PRESSURE, "milli- or megapascal"),
        ("bara", Quantity.PRESSURE, "ambient pressure: give unit = 'bar' and offset = -1.013"),
        ("psia", Quantity.PRESSURE, "ambient pressure: give unit = 'psi' and offset = -14.7"),
        ("furlong", Quantity.SPEED, "unknown unit 'furlong'"),
        ("", Quantity.TORQUE, "names no unit"),
        (None, Quantity.TORQUE, "names no unit"),
        ("bar", Quantity.TORQUE, "is a pressure, the channel is a torque"),
        ("%", Quantity.TORQUE, "reference torque"),
    ],
)
def test_refusals_give_reason_and_remedy(
    spelling: str | None, quantity: Quantity, reason: str
) -> None:
    with pytest.raises(UnitError) as caught:
        resolve_channel_unit(spelling, quantity, HERE)
    text = str(caught.value)
    assert reason in text
    assert 'unit = "..."' in text
    assert text.startswith("log.csv, channel 'X': ")


def test_a_state_needs_no_unit() -> None:
    assert resolve_channel_unit(None, Quantity.STATE, HERE).factor == 1.0


@pytest.mark.parametrize(
    ("spelling", "factor"),
    [("s", 1.0), ("[s]", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("min", 60.0), ("d", 86400.0)],
)
def test_time_units(spelling: str, factor: float) -> None:
    assert get_time_factor(spelling, HERE) == factor


@pytest.mark.parametrize("spelling", [None, "", "bar"])
def test_time_without_unit_is_refused(spelling: str | None) -> None:
    with pytest.raises(UnitError, match=r'time = { unit = "s" }'):
        get_time_factor(spelling, HERE)


def test_names_are_not_taken_for_units() -> None:
    assert is_unit("Nm")
    assert is_unit("km/h")
    assert not is_unit("EngTrq")
