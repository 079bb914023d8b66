# SPDX-License-Identifier: MIT
"""The unit table: spellings in use mean what they say, doubtful ones are refused with a reason."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.units import (
    propose_units,
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
        ("kPa(abs)", Quantity.PRESSURE, "give unit = 'kPa' and offset = -101.3"),
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
    assert not found.certain
