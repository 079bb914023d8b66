# SPDX-License-Identifier: MIT
"""Units of logs: the closed table of their spellings, and proposals where a file names none.

A general unit parser reads `Nm` as a textile unit and `1/min` without its 2π, so every spelling
is listed. On speed channels `rpm`, `1/min`, `U/min`, `min-1` mean revolutions per minute. A
proposal is a unit that makes the numbers of a channel usual for its role. It is shown to the user
and never used by itself.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pydantic import AfterValidator

from drivetwin.channels.roles import Quantity, format_channel_entry, get_quantity
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import UnitError, Where

BAR = 1e5
"""One bar [Pa]."""
RPM = math.pi / 30.0
"""One revolution per minute [rad/s]."""
IN_RPM, IN_BAR = AfterValidator(RPM.__mul__), AfterValidator(BAR.__mul__)
"""Units of the keys of a file as annotations of fields in SI."""
_REV = 2.0 * math.pi
DEG = math.pi / 180.0
_PSI = 6894.757293168361
_FT_LB = 1.3558179483314004
_KGF = 9.80665
_INCH = 0.0254
_LBF = 0.45359237 * _KGF


@dataclass(frozen=True)
class Unit:
    """SI value = `factor`·value + `offset`; `quantity` is what it measures."""

    factor: float
    offset: float
    quantity: Quantity

    def to_si(self, values: FloatArray) -> FloatArray:
        """Return `values` (n,) in SI."""
        with np.errstate(over="ignore"):  # a damaged number may become infinite: no number then
            return self.factor * values + self.offset

    def from_si(self, values: FloatArray) -> FloatArray:
        """Return `values` (n,), in SI, in this unit."""
        return (values - self.offset) / self.factor


_SPELLINGS: dict[Quantity, dict[float, str]] = {
    Quantity.TORQUE: {
        1.0: "Nm N·m N.m N*m N-m N_m Newtonmeter newton-meter",
        1e3: "kNm kN·m kN.m kN*m kN-m",
        1e-2: "Ncm N·cm N.cm N*cm",
        1e-3: "Nmm N·mm N.mm N*mm",
        10.0: "daNm daN·m daN.m daN*m",
        _FT_LB: "ft·lb ft.lb ft*lb ft-lb ftlb lb·ft lb.ft lb*ft lb-ft lbft lbf·ft lbf*ft lbf-ft "
        "ft·lbs ft.lbs ft*lbs ft-lbs ftlbs lbs·ft lbs-ft ft·lbf ft.lbf ft*lbf ft-lbf ftlbf lbf.ft",
        _INCH * _LBF: "in·lb in.lb in*lb in-lb inlb lb·in lb.in lb*in lb-in lbin in·lbs in.lbs "
        "in*lbs in-lbs inlbs in·lbf in.lbf in*lbf in-lbf inlbf lbf·in lbf.in lbf*in lbf-in lbfin",
        _KGF: "kgf·m kgf.m kgf*m kgfm kp·m kpm",
    },
    Quantity.SPEED: {
        1.0: "rad/s rad·s-1 rad.s-1 rad*s-1 rads-1 rad/sec",
        RPM: "rpm 1/min /min U/min min-1 min^-1 r/min rev/min Upm r.p.m. rot/min U·min-1 tr/min",
        1e3 * RPM: "krpm",
        _REV: "U/s rev/s r/s rps",
        DEG: "deg/s °/s deg/sec grad/s",
    },
    Quantity.PRESSURE: {
        1.0: "Pa Pascal N/m2 N/m^2",
        1e2: "hPa mbar",
        1e3: "kPa kN/m2 kN/m^2",
        BAR: "bar barg bar(g) bar_g",
        1e6: "MPa N/mm2 N/mm^2",
        _PSI: "psi psig lbf/in2 lbf/in^2",
        98066.5: "kgf/cm2 kgf/cm^2 kp/cm2 kp/cm^2",
    },
    Quantity.FRACTION: {1.0: "- 1 [] p.u. pu", 1e-2: "% pct percent Prozent", 1e-3: "‰"},
    Quantity.TEMPERATURE: {1.0: "K Kelvin"},
}

_CELSIUS = "°C degC deg_C Celsius C"
_FAHRENHEIT = "°F degF deg_F Fahrenheit"

_AMBIGUOUS = {
    "revolutions or radians may be meant": "1/s /s s-1 s^-1 Hz",
    "milli- or megapascal may be meant": "mPa mpa MPA",
}
"""Spellings of several units, by the reason; the values may show which one is meant."""

_ATMOSPHERE = {"bar": -1.013, "kPa": -101.3, "hPa": -1013, "mbar": -1013, "psi": -14.7}
"""Offset that turns an absolute pressure into a gauge pressure."""
_CONVERTED = {
    "a vehicle speed needs the tyre radius to become a wheel speed: give scale = 1/r_w for m/s, "
    "1/(3.6·r_w) for km/h and unit = 'rad/s'": "km/h kmh kph m/s mph",
    **{
        f"{unit} absolute holds the ambient pressure: give unit = '{unit}' and offset = {offset}": (
            " ".join(f"{unit}{mark}" for mark in ("a", "(a)", "_a", "abs", "(abs)", "_abs"))
        )
        for unit, offset in _ATMOSPHERE.items()
    },
}
"""Spellings that need more than a unit, by the reason."""

_TIME = {
    "s": 1.0,
    "sec": 1.0,
    "second": 1.0,
    "seconds": 1.0,
    "sek": 1.0,
    "ms": 1e-3,
    "msec": 1e-3,
    "milliseconds": 1e-3,
    "us": 1e-6,
    "μs": 1e-6,
    "microseconds": 1e-6,
    "ns": 1e-9,
    "nanoseconds": 1e-9,
    "ps": 1e-12,
    "min": 60.0,
    "mins": 60.0,
    "minutes": 60.0,
    "h": 3600.0,
    "hr": 3600.0,
    "hrs": 3600.0,
    "hours": 3600.0,
    "d": 86400.0,
    "day": 86400.0,
    "days": 86400.0,
}
"""Seconds of each unit of time; days are what Excel and MATLAB count dates in."""


def _normalise_spelling(spelling: str) -> str:
    """One form for blanks, superscripts, multiplication signs, minus signs and brackets."""
    text = unicodedata.normalize("NFKC", spelling).strip()
    if re.fullmatch(r"\[.+\]|\(.+\)", text):
        text = text[1:-1]
    text = re.sub(r"[\u2212\u2010-\u2014]", "-", re.sub(r"\s+", "", text))
    return re.sub(r"[\u2219\u22c5\u2022\u00d7\u2217]", "·", text)


def _build_unit_table() -> dict[str, Unit]:
    table = {
        _normalise_spelling(spelling): Unit(factor, 0.0, quantity)
        for quantity, by_factor in _SPELLINGS.items()
        for factor, spellings in by_factor.items()
        for spelling in spellings.split()
    }
    for spelling in _CELSIUS.split():
        table[_normalise_spelling(spelling)] = Unit(1.0, 273.15, Quantity.TEMPERATURE)
    for spelling in _FAHRENHEIT.split():
        table[_normalise_spelling(spelling)] = Unit(
            5.0 / 9.0, 459.67 * 5.0 / 9.0, Quantity.TEMPERATURE
        )
    return table


UNITS: dict[str, Unit] = _build_unit_table()
"""Every accepted spelling in its normal form."""

_REASONS = {
    _normalise_spelling(each): why
    for why, all_of in {**_AMBIGUOUS, **_CONVERTED}.items()
    for each in all_of.split()
}
_BY_FOLDED = {spelling.casefold(): unit for spelling, unit in UNITS.items()}
_REASONS_FOLDED = {spelling.casefold(): why for spelling, why in _REASONS.items()}


def find_unit(spelling: str) -> Unit | None:
    """Return the unit of a spelling, or None. Upper and lower case differ only for mPa and MPa."""
    text = _normalise_spelling(spelling)
    if text in UNITS:
        return UNITS[text]
    return None if text.casefold() in _REASONS_FOLDED else _BY_FOLDED.get(text.casefold())


def is_ambiguous(spelling: str | None) -> bool:
    """Return True for no unit and for a spelling of several units."""
    text = _normalise_spelling(spelling or "").casefold()
    return not text or _REASONS_FOLDED.get(text) in _AMBIGUOUS


def is_unit(spelling: str) -> bool:
    """Return True if a text is a spelling of any unit, time and refused ones included."""
    refused = _normalise_spelling(spelling).casefold() in _REASONS_FOLDED
    return find_unit(spelling) is not None or refused or is_time_unit(spelling)


_PERCENT_TORQUE = "in percent of a reference torque give unit = 'Nm', scale = reference torque/100"
_BEGIN = "('drivetwin inspect LOG --write-mapping channels.toml' begins one)"


def resolve_channel_unit(
    spelling: str | None, quantity: Quantity, where: Where, role: str = "<role>"
) -> Unit:
    """Return the unit of a channel that measures `quantity` and has a `role`.

    A state (gear, flag) needs no unit. Raises UnitError where the unit is missing, unknown,
    ambiguous or of another quantity; the message explains how to state it.
    """
    if quantity is Quantity.STATE:
        return Unit(1.0, 0.0, Quantity.STATE)
    usual = ", ".join(map(repr, list_first_spellings(quantity)))
    entry = format_channel_entry(role, where.channel or "...", unit="...")
    remedy = f"assert it in the channel mapping {_BEGIN}: {entry}, for a {quantity} one of {usual}"
    if spelling is None or not spelling.strip():
        raise UnitError("the file names no unit for this channel", remedy, where)
    unit = find_unit(spelling)
    if unit is None:
        reason = _REASONS_FOLDED.get(_normalise_spelling(spelling).casefold())
        what = f"unit {spelling!r} cannot stand as it is: {reason}" if reason else None
        raise UnitError(what or f"unknown unit {spelling!r}", remedy, where)
    if unit.quantity is not quantity:
        percent = unit.quantity is Quantity.FRACTION and quantity is Quantity.TORQUE
        hint = f"; {_PERCENT_TORQUE}" if percent else ""
        what = f"unit {spelling!r} is a {unit.quantity}, the channel is a {quantity}{hint}"
        raise UnitError(what, remedy, where)
    return unit


def is_time_unit(spelling: str) -> bool:
    """Return True if a text is a spelling of a unit of time."""
    return _normalise_spelling(spelling).casefold() in _TIME


def get_time_factor(spelling: str | None, where: Where) -> float:
    """Return the factor to seconds of a time unit; raises UnitError if missing or unknown."""
    remedy = (
        f'assert it in the channel mapping {_BEGIN}: time = {{ unit = "s" }} (or "ms", "us", "min")'
    )
    if spelling is None or not spelling.strip():
        raise UnitError("the file names no unit for its time column", remedy, where)
    try:
        return _TIME[_normalise_spelling(spelling).casefold()]
    except KeyError:
        raise UnitError(f"unknown time unit {spelling!r}", remedy, where) from None


def list_time_spellings() -> list[str]:
    """Return the first spelling of each unit of time."""
    return list({factor: unit for unit, factor in reversed(_TIME.items())}.values())[::-1]


def list_first_spellings(quantity: Quantity) -> list[str]:
    """Return the first spelling of each size of unit of a quantity, SI among them."""
    return [spellings.split()[0] for spellings in _SPELLINGS[quantity].values()]


def list_usual_units(quantity: Quantity, without: str) -> list[tuple[str, float]]:
    """Return the first spelling of each size of unit with its factor relative to `without`.

    Used to propose the unit that numbers would fit; `without` is the present unit and left out.
    """
    present = find_unit(without)
    size = present.factor if present is not None else 1.0
    return [
        (spellings.split()[0], factor / size)
        for factor, spellings in _SPELLINGS[quantity].items()
        if factor != size
    ]


Range = tuple[float, float]

_USUAL: dict[str, Range] = {
    "engine_torque": (30.0, 5e3),
    "output_torque": (100.0, 8e4),
    "input_speed": (60.0, 900.0),
    "engine_speed": (60.0, 900.0),
    "output_speed": (10.0, 900.0),
    "wheel_speed": (4.0, 130.0),
    "throttle": (0.2, 1.1),
}
"""Usual largest magnitude of each role over a log with shifts [SI]."""

_USUAL_PRESSURE: Range = (1.5e5, 4e6)
"""Usual largest pressure of a shift element [Pa]."""

_UNITS: dict[Quantity, tuple[str, ...]] = {
    Quantity.TORQUE: ("Nm", "kNm"),
    Quantity.SPEED: ("rpm", "rad/s"),
    Quantity.PRESSURE: ("bar", "Pa", "kPa", "MPa"),
    Quantity.FRACTION: ("%", "-"),
}
"""Units that are proposed, the most frequent first."""

_LEAST_PERCENT = 1.5
"""Largest number of a pedal above which it is in percent, below a fraction."""

_MOST_PERCENT_TORQUE = 130.0
"""Largest number of an engine torque up to which it may be in percent of the reference torque."""

_MOST_REVERSED = 0.1
"""Largest part of the values on the other side of zero of a speed, pressure or pedal."""

_TIME_UNITS = ("s", "ms", "us")
_USUAL_STEP: Range = (2e-5, 0.25)
"""Usual time between samples of a log with shifts [s]."""


@dataclass(frozen=True)
class Proposal:
    """A unit that makes the values usual, and the reason in words; 0 is the most usual `rank`.

    It is not `certain` if the values are also usual in a unit of another quantity.
    """

    unit: str
    reason: str
    rank: int = 0
    certain: bool = True


def propose_units(role: str, span: Range | None) -> tuple[Proposal, ...]:
    """Return the units that make the values of a role usual, the most frequent first.

    Parameters
    ----------
    role : str
        Role of the channel.
    span : tuple of float or None
        Least and largest number in the file; None where the channel has no number.
    """
    quantity = get_quantity(role)
    if span is None or quantity not in _UNITS:
        return ()
    low, high = span
    largest, smallest = max(abs(low), abs(high)), min(abs(low), abs(high))
    both_signs = low < 0.0 < high and smallest > _MOST_REVERSED * largest
    if both_signs and quantity is not Quantity.TORQUE:
        return ()
    usual = _USUAL_PRESSURE if quantity is Quantity.PRESSURE else _USUAL.get(role)
    if usual is None:
        return ()
    least, most = usual
    factors = {unit: _get_factor(unit) for unit in _UNITS[quantity]}
    fitting = [unit for unit, factor in factors.items() if least <= factor * largest <= most]
    if quantity is Quantity.FRACTION:
        fitting = [one for one in fitting if (one == "%") == (largest > _LEAST_PERCENT)]
    unusual = [unit for unit in factors if unit not in fitting]
    percent = role == "engine_torque" and high <= _MOST_PERCENT_TORQUE
    return tuple(
        Proposal(unit, _explain(span, unit, unusual, percent=percent), rank, not percent)
        for rank, unit in enumerate(factors)
        if unit in fitting
    )


def propose_missing_units(
    spans: Mapping[str, Range | None],
) -> dict[str, tuple[Proposal, ...]]:
    """Return the proposals for all channels of a log whose unit is open, by role.

    The one source of proposals: of the error that refuses the log, and of the mapping that is
    written.

    Parameters
    ----------
    spans : mapping of str to tuple of float or None
        Least and largest number in the file by role; None where the channel has no number.
    """
    return prefer_common_units({role: propose_units(role, span) for role, span in spans.items()})


def prefer_common_units(
    proposals: Mapping[str, tuple[Proposal, ...]],
) -> dict[str, tuple[Proposal, ...]]:
    """Return the proposals by role, with those alone that agree with the other channels.

    Of several proposals of a role one remains if it is the only proposal of all other channels of
    the quantity that have a single one.
    """
    sure: dict[Quantity, set[str]] = {}
    for role, some in proposals.items():
        if len(some) == 1:
            sure.setdefault(get_quantity(role), set()).add(some[0].unit)
    preferred = dict(proposals)
    for role, some in proposals.items():
        common = sure.get(get_quantity(role), set())
        agreeing = [one for one in some if {one.unit} == common]
        if len(some) > 1 and agreeing:
            reason = f"{agreeing[0].reason}; the other {get_quantity(role)} channels are in it too"
            preferred[role] = (Proposal(agreeing[0].unit, reason),)
    return preferred


def propose_time_units(step: float) -> tuple[Proposal, ...]:
    """Return the units of time that make the `step` between samples, in file numbers, usual."""
    least, most = _USUAL_STEP
    rates = {unit: step * get_time_factor(unit, Where()) for unit in _TIME_UNITS}
    return tuple(
        Proposal(unit, f"steps of {step:.4g} are then {1.0 / seconds:.4g} samples per second")
        for unit, seconds in rates.items()
        if least <= seconds <= most
    )


def _get_factor(unit: str) -> float:
    found = find_unit(unit)
    assert found is not None
    return found.factor


def _explain(span: Range, unit: str, unusual: list[str], *, percent: bool) -> str:
    """Return the reason of a proposal."""
    low, high = span
    text = f"{low:.4g} to {high:.4g} is usual in {unit}"
    if unusual:
        text += f", not in {' or '.join(unusual)}"
    else:
        text += ", but other units are possible"
    if percent:
        text += f"; {_PERCENT_TORQUE}"
    return text
