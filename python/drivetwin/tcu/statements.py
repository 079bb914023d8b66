# SPDX-License-Identifier: MIT
"""Quantities that a log of a gearbox control determines, with verdicts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.constants import bar

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.verdict import assess_with_prior
from drivetwin.parameters import ParameterSpec
from drivetwin.tcu.card import ControllerCard
from drivetwin.tcu.identify import FittedShifts
from drivetwin.tcu.log import REFERENCE_OIL, ControllerShift
from drivetwin.tcu.predict import find_slip
from drivetwin.tcu.unknowns import J_VEHICLE, Numbers
from drivetwin.vehicle.spec import PriorValue

METHOD = "maximum likelihood with prior"
_STEP = 1e-3
"""Step of a difference over a coordinate [standard deviations]."""

_USUAL_PRESSURE = 3.0
"""Pressure at which a capacity is stated where the log shows none [bar]."""

Values = Mapping[str, float]
Quantity = Callable[[Values], float]

_WITHHELD = {
    Numbers.DROP: "Only a shift that ends in slow slip without control would show it. It stays the "
    "design value.",
    Numbers.DEAD: "The log determines the sum of dead time and lag; see the delay.",
    Numbers.FILL: "It depends on the assumed law of the flow; see the onset.",
}
"""Numbers of an element that are not stated, with the reason."""
_DRUM = (
    "It takes up errors of the valve and of the friction law, which act at the same time. State it "
    "on the card."
)
_DAMPING = "It takes up errors of the law of the tyre, whose slip damps as well."
_STIFFNESS = (
    "It takes up errors of the law of the tyre, which is in series with it. The log shows the sum."
)


@dataclass(frozen=True)
class Statement:
    """Quantity as a function of the absolute numbers."""

    name: str
    unit: str
    meaning: str
    compute: Quantity
    law: Quantity | None = None
    """Standard deviation by a law that the log does not show."""

    @property
    def spec(self) -> ParameterSpec:
        """Declaration of the quantity."""
        low = -math.inf
        return ParameterSpec(
            self.name, self.name, self.name, self.unit, self.meaning, low, math.inf
        )


def state(found: FittedShifts) -> dict[str, Estimate]:
    """Estimate the quantities of vehicle and elements with verdicts, by name."""
    slopes = Slopes.from_fit(found)
    estimates = {
        one.name: assess_quantity(found, slopes, one.name, one.compute, one)
        for one in (*_list_vehicle(), *_list_elements(found))
    }
    reasons = {"J_drum": _DRUM, "shaft_stiffness": _STIFFNESS, "shaft_damping": _DAMPING}
    for element in list_used(found.shifts):
        reasons |= {f"{element}.{number}": text for number, text in _WITHHELD.items()}
    for name, text in reasons.items():
        spec = ParameterSpec(name, name, name, found.coordinates.stated[name].unit, "", 0.0, 1e9)
        verdict = Verdict.NOT_IDENTIFIABLE
        estimates[name] = Estimate(name, None, None, verdict, METHOD, reason=text, spec=spec)
    return estimates


def list_used(shifts: Sequence[ControllerShift]) -> list[str]:
    """List the elements that change in shifts."""
    return sorted({name for one in shifts for name in (one.off, one.on)})


def take(name: str, factor: float = 1.0) -> Quantity:
    """Return the function that takes a number, times a factor."""
    return lambda given: factor * given[name]


def _add(first: str, second: str) -> Quantity:
    """Return the function that adds two numbers."""
    return lambda given: given[first] + given[second]


def _relate(quantity: Quantity) -> Quantity:
    """Return a quantity over the inertia of the vehicle, which no common scale moves."""
    return lambda given: quantity(given) / given[J_VEHICLE]


_VEHICLE = {
    "torque_scale": ("1", "engine torque over that of the bus"),
    "torque_offset": ("N*m", "offset of the engine torque"),
    "J_engine": ("kg*m^2", "inertia at the engine, pump included"),
    "J_turbine": ("kg*m^2", "inertia at the turbine"),
    J_VEHICLE: ("kg*m^2", "vehicle inertia at the gearbox output"),
    "converter_scale": ("1", "capacity of the converter over that of the card"),
    "converter_overrun": ("1", "capacity in overrun over that in drive"),
    "tyre_slip_stiffness": ("N*m", "torque over slip of the tyres, at the output"),
}
"""Units and meanings of the numbers of the vehicle that are stated as they are."""
_NO_TORQUE = (
    "The pressure does not rise over P0 in a shift in which the element applies. Check column, "
    "unit and element of its command."
)
_SCALE_FREE = "independent of the common scale of all torques"


def _list_vehicle() -> Iterator[Statement]:
    """List the quantities of the vehicle."""
    for name, (unit, meaning) in _VEHICLE.items():
        yield Statement(name, unit, meaning, take(name))
    scale, engine = _relate(take("torque_scale")), _relate(take("J_engine"))
    yield Statement("torque_scale/J_vehicle", "1/(kg*m^2)", _SCALE_FREE, scale)
    yield Statement("J_engine/J_vehicle", "1", _SCALE_FREE, engine)
    delay = _add("torque_dead_time", "torque_lag")
    yield Statement("torque_delay", "s", "dead time and lag of the engine torque of the bus", delay)


def _list_elements(found: FittedShifts) -> Iterator[Statement]:
    """List the quantities of each element that changes in the shifts."""
    for name in list_used(found.shifts):
        at = find_used_pressure(found.card, found.shifts, name)
        torque = partial(compute_capacity, element=name, pressure=at)
        yield Statement(
            f"{name}.P0",
            "Pa",
            "pressure at which the clutch begins to transmit",
            take(f"{name}.{Numbers.P0}", bar),
        )
        yield Statement(
            f"{name}.delay",
            "s",
            "dead time and lag from the command to the pressure",
            _add(f"{name}.{Numbers.DEAD}", f"{name}.{Numbers.LAG}"),
        )
        yield Statement(
            f"{name}.slope",
            "s/rad",
            "change of the friction with the slip, relative",
            take(f"{name}.{Numbers.SLOPE}"),
        )
        meaning = f"torque of the element at {at:.2f} bar and 60 °C"
        yield Statement(f"{name}.capacity", "N*m", meaning, torque)
        yield Statement(
            f"{name}.capacity/J_vehicle", "1/s^2", f"{meaning}, {_SCALE_FREE}", _relate(torque)
        )
        if any(one.on == name for one in found.shifts):
            yield Statement(
                f"{name}.onset",
                "s",
                "from the change of the commanded gear to the first torque, mean of the shifts",
                partial(compute_onset, found=found, element=name),
                partial(_compute_rise, found=found, element=name),
            )


def find_used_pressure(
    card: ControllerCard, shifts: Sequence[ControllerShift], element: str
) -> float:
    """Find the median command [bar] of an element where the log shows its torque: while it slips
    as it applies, and before the slip begins as it releases."""
    parts = []
    for one in shifts:
        if element not in (one.off, one.on):
            continue
        slip = find_slip(card, one, one.time, one.speeds[:, 1], one.speeds[:, 2])
        span = (slip.start, slip.end) if element == one.on else (one.change, slip.start)
        rows = (one.time >= span[0]) & (one.time <= span[1])
        parts.append(one.commands[element][rows & (one.commands[element] > 0.0)])
    every = np.concatenate(parts)
    return round(float(np.median(every)) / bar, 2) if every.size else _USUAL_PRESSURE


def compute_capacity(given: Values, *, element: str, pressure: float) -> float:
    """Compute the torque [N·m] of an element at a pressure [bar], 60 °C and vanishing slip, without
    the drop of friction there."""
    over = pressure - given[f"{element}.{Numbers.P0}"]
    bent = 1.0 + given[f"{element}.{Numbers.CURVE}"] * over
    return given[f"{element}.{Numbers.GAIN}"] * over * bent


def _list_onsets(given: Values, found: FittedShifts, element: str) -> FloatArray:
    """List the times (n, 2) [s] from the change of the commanded gear to the end of the fill and to
    the pressure P0, in the shifts in which an element applies.

    In the plant the pressure rises from that of the return spring to P0 before the first torque. A
    spring whose force grows over the stroke reaches P0 with the end of the fill. Both laws have the
    same rise of torque where the first torque of the latter lies midway.
    """
    times = []
    for term, shift in zip(found.problem.terms, found.shifts, strict=True):
        if shift.on == element:
            path, warmth = term.plant.paths["on excess"], shift.oil - REFERENCE_OIL
            excess = path.compute(*(given[name] for name in path.of))
            kiss = given[f"{element}.{Numbers.P0}"] * (1.0 - given["P0_temperature"] * warmth)
            friction = 1.0 - given["friction_temperature"] * warmth
            spring = bar * friction * kiss * (1.0 - given["spring_share"])
            ends = (find_onset(term.record.time, excess + one) for one in (spring, 0.0))
            times.append([one - shift.change for one in ends])
    return np.array(times)


def compute_onset(given: Values, *, found: FittedShifts, element: str) -> float:
    """Compute the mean time [s] from the change of the commanded gear to the first torque of an
    element, over the shifts in which it applies; NaN if one has no rise of its pressure over P0."""
    return float(np.mean(_list_onsets(given, found, element)))


def _compute_rise(given: Values, *, found: FittedShifts, element: str) -> float:
    """Compute the standard deviation [s] of the first torque anywhere between the end of the fill
    and the pressure P0."""
    apart = np.diff(_list_onsets(given, found, element))
    return float(np.mean(np.abs(apart))) / math.sqrt(12.0)


def find_onset(time: FloatArray, excess: FloatArray) -> float:
    """Find the instant [s] at which the excess of a pressure over P0 becomes positive, or NaN."""
    above = np.flatnonzero(excess > 0.0)
    if not above.size or above[0] == 0:
        return math.nan
    k = int(above[0])
    share = -excess[k - 1] / (excess[k] - excess[k - 1])
    return float(time[k - 1] + share * (time[k] - time[k - 1]))


@dataclass(frozen=True, eq=False)
class Slopes:
    """Numbers `values` at a minimum, and those a step above and below along each coordinate.

    `steps` (p,) are the steps, `covariance` (p, p) is that of the coordinates.
    """

    values: Values
    aside: Sequence[tuple[Values, Values]]
    steps: FloatArray
    covariance: FloatArray

    @classmethod
    def from_fit(cls, found: FittedShifts) -> Slopes:
        """Step aside from the minimum of a fit."""
        to_values, point = found.coordinates.to_values, found.point.values
        steps = _STEP * np.sqrt(np.diag(found.covariance))
        aside = [(to_values(point + one), to_values(point - one)) for one in np.diag(steps)]
        return cls(to_values(point), aside, steps, found.covariance)

    def differentiate(self, quantities: Sequence[Quantity]) -> FloatArray:
        """Compute the derivatives (q, p) of quantities by the coordinates."""
        ends = np.array([[[one(x) for x in sides] for sides in self.aside] for one in quantities])
        return np.asarray((ends[:, :, 0] - ends[:, :, 1]) / (2.0 * self.steps))

    def compute_covariance(self, quantities: Sequence[Quantity]) -> FloatArray:
        """Compute the covariance (q, q) of quantities."""
        rows = self.differentiate(quantities)
        return np.asarray(rows @ self.covariance @ rows.T)


def assess_quantity(
    found: FittedShifts,
    slopes: Slopes,
    name: str,
    quantity: Quantity,
    stated: Statement | None = None,
) -> Estimate:
    """Assess a quantity by its standard deviation and by that of its priors."""
    declared = None if stated is None else stated.spec
    value = quantity(slopes.values)
    if math.isnan(value):
        verdict = Verdict.NOT_IDENTIFIABLE
        return Estimate(name, None, None, verdict, METHOD, reason=_NO_TORQUE, spec=declared)
    row = slopes.differentiate([quantity])[0]
    wide = np.linalg.inv(found.coordinates.prior.precision)
    std, before = (math.sqrt(max(float(row @ c @ row), 0.0)) for c in (slopes.covariance, wide))
    if stated is not None and stated.law is not None:
        std = math.hypot(std, stated.law(slopes.values))
    return assess_with_prior(
        (name, value, std), PriorValue(value, before), METHOD, declared=declared
    )
