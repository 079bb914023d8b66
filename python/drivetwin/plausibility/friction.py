# SPDX-License-Identifier: MIT
"""Friction and inertias that follow from the card and the signals over spans of a shift."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.channels.roles import format_channel_entry, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.channels.units import BAR
from drivetwin.findings import Code, Finding, report
from drivetwin.plausibility.entries import PLAUSIBILITY, Limits, find_entry, get_gain_key
from drivetwin.shifts.detect import find_gear_spans
from drivetwin.shifts.shift import Shift, make_shift_labels
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.card_fields import get_card_field

POINTS = 60
"""Instants at which a span is sampled."""


def sample_span(channel: Channel, span: Span) -> FloatArray:
    """Sample a channel at `POINTS` instants of a span; NaN outside its samples."""
    return channel.updates.interpolate(np.linspace(*span, POINTS))


def compute_mean(channel: Channel, span: Span) -> float:
    """Mean over a span; NaN if less than half of it is recorded."""
    values = sample_span(channel, span)
    known = np.isfinite(values)
    return float(values[known].mean()) if 2 * np.count_nonzero(known) > POINTS else float("nan")


def compute_slope(channel: Channel, span: Span) -> float:
    """Mean rate over a span [1/s] by a straight line; NaN if less than half of it is recorded."""
    values = sample_span(channel, span)
    known = np.isfinite(values)
    if 2 * np.count_nonzero(known) <= POINTS:
        return float("nan")
    time = np.linspace(*span, POINTS)
    return float(np.polyfit(time[known] - span[0], values[known], 1)[0])


def compute_engine_rate(log: ShiftLog, card: VehicleCard, span: Span) -> float:
    """ω_e' over a span [rad/s^2], of the engine speed or, without it, of the input speed."""
    if "engine_speed" in log:
        return compute_slope(log["engine_speed"], span)
    return (
        card.i_in.value * compute_slope(log["input_speed"], span)
        if "input_speed" in log
        else np.nan
    )


def compute_output_rate(
    log: ShiftLog,
    card: VehicleCard,
    span: Span,
    roles: Sequence[str] = ("output_speed", "wheel_speed"),
) -> float:
    """ω_out' over a span [rad/s^2], of the first of the speeds `roles` that the log has."""
    for role in roles:
        if role in log:
            ratio = card.final_drive.value if role == "wheel_speed" else 1.0
            return ratio * compute_slope(log[role], span)
    return np.nan


LEAST_POINTS = 15
"""Fewest of the sampled instants of an inertia phase at which one element acts alone."""
P0_ERROR = 0.1 * BAR
"""Error of a pressure above P0 [Pa]: sensor offset and rounding of the design value."""


@dataclass(frozen=True)
class FrictionProduct:
    """Product of μ and gain [m^3] of an element in a shift, from `low` to `high`."""

    element: str
    low: float
    high: float
    shift: str

    @property
    def middle(self) -> float:
        """Geometric mean [m^3]."""
        return float(np.sqrt(self.low * self.high))


def get_slipping(shift: Shift) -> tuple[str, str]:
    """Return the element that slips in the inertia phase, and the other one."""
    if shift.kind.has_torque_phase_first:
        return shift.oncoming, shift.offgoing
    return shift.offgoing, shift.oncoming


def find_products(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> list[FrictionProduct]:
    """Compute μ·gain in the inertia phases: clutch torque over pressure above P0.

    The torque follows from the output torque with the usual efficiencies, without it from the
    engine torque with the design range of J'. Shifts with small torque or pressure, or in which
    two elements act at once, are left out.
    """
    found = []
    for shift, label in zip(shifts, make_shift_labels(shifts), strict=True):
        element = get_slipping(shift)[0]
        span = find_single_slip(log, card, shift)
        if span is None:
            continue
        pressure = _compute_pressure(log, card, element, span)
        P0 = card.get_element(element).P0
        error = max(P0_ERROR, 2.0 * P0.std)
        torques = _bound_torque(log, card, element, span)
        if torques is not None and pressure > 2.0 * error:
            low, high = torques[0] / (pressure + error), torques[1] / (pressure - error)
            found.append(FrictionProduct(element, low, high, label))
    return found


def find_single_slip(log: ShiftLog, card: VehicleCard, shift: Shift) -> Span | None:
    """Find the longest part of the inertia phase in which the slipping element acts alone.

    Its pressure is above P0 and that of the other element below. A fifth is left out at both ends,
    where pressures change. None without such a part or without a pressure.
    """
    element, other = get_slipping(shift)
    roles = [make_pressure_role(one) for one in (element, other)]
    if roles[0] not in log or element == other:
        return None
    span = shift.inertia_phase
    pressure = sample_span(log[roles[0]], span) - card.get_element(element).P0.value
    alone = pressure > PLAUSIBILITY.least_pressure * BAR
    if roles[1] in log:
        rest = sample_span(log[roles[1]], span) - card.get_element(other).P0.value
        alone &= rest < P0_ERROR
    edges = np.flatnonzero(np.diff(np.concatenate(([False], alone, [False])).astype(int)))
    if edges.size == 0:
        return None
    starts, stops = edges[::2], edges[1::2]
    longest = int(np.argmax(stops - starts))
    first, stop = int(starts[longest]), int(stops[longest])
    if stop - first < LEAST_POINTS:
        return None
    time = np.linspace(*span, pressure.size)
    margin = 0.2 * (time[stop - 1] - time[first])
    return float(time[first] + margin), float(time[stop - 1] - margin)


def _compute_pressure(log: ShiftLog, card: VehicleCard, element: str, span: Span) -> float:
    """Mean pressure above P0 [Pa]; NaN without the channel."""
    role = make_pressure_role(element)
    if role not in log:
        return float("nan")
    return compute_mean(log[role], span) - card.get_element(element).P0.value


def _bound_torque(
    log: ShiftLog, card: VehicleCard, element: str, span: Span
) -> tuple[float, float] | None:
    """Least and largest torque of the slipping element [N m]; None if it is small or unknown."""
    i_c, i_out = card.get_clutch_ratios(element)
    if "output_torque" in log:
        channel = log["output_torque"]
        torque = compute_mean(channel, span)
        if not abs(torque) > PLAUSIBILITY.least_torque * float(np.abs(channel.values).max()):
            return None
        inertia = 0.0 if card.J_out is None else card.J_out.value
        rate = compute_output_rate(log, card, span)
        torque += inertia * rate if np.isfinite(rate) else 0.0
        low, high = (abs(torque / (eta * i_out)) for eta in get_card_field("eta").usual[::-1])
        return low, high
    if "engine_torque" not in log or card.converter is not None:
        return None
    driving = compute_mean(log["engine_torque"], span)
    rate = compute_engine_rate(log, card, span)
    bounds = sorted(
        i_c * card.i_in.value * (driving - inertia * rate) for inertia in card.J_prime_range
    )
    if not np.isfinite(bounds).all() or min(bounds) <= 0.0:
        return None
    return bounds[0], bounds[1]


def check_friction(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], doubted: frozenset[str]
) -> list[Finding]:
    """Report the gains that make an implausible μ; elements in `doubted` are left out.

    Each element is reported once, by its first shift. Elements without a μ are compared with those
    whose μ is plausible.
    """
    found: dict[str, Finding] = {}
    sound: set[str] = set()
    for product in find_products(log, card, shifts):
        if product.element in doubted | found.keys():
            continue
        sound.add(product.element)
        for finding in _judge_product(card, product):
            found[product.element] = finding
    for shift, label in zip(shifts, make_shift_labels(shifts), strict=True):
        for element, finding in _check_bounds(log, card, shift, label):
            if element not in doubted | found.keys():
                found[element] = finding
    sound -= found.keys()
    rest = card.elements.keys() - sound - found.keys() - doubted
    return [*found.values(), *_compare_gains(card, sorted(rest), sorted(sound))]


def _compare_gains(
    card: VehicleCard, elements: Sequence[str], sound: Sequence[str]
) -> Iterator[Finding]:
    """Compare the gains of elements with the geometric mean of the `sound` ones."""
    if not sound:
        return
    usual = float(np.exp(np.mean([np.log(card.get_element(name).gain.value) for name in sound])))
    limit = PLAUSIBILITY.unequal_gains
    for name in elements:
        factor = card.get_element(name).gain.value / usual
        if not 1.0 / limit <= factor <= limit:
            numbers = {"factor": factor}
            factors = (1.0 / limit / factor, limit / factor)
            code = Code.CARD_GAINS_UNEQUAL
            yield _report_gain(card, name, code, factors, numbers, others=", ".join(sound))


def _judge_product(card: VehicleCard, product: FrictionProduct) -> Iterator[Finding]:
    gain = card.get_element(product.element).gain.value
    middle = product.middle / gain
    for code, (low, high), limits in (
        (
            Code.CARD_FRICTION_IMPLAUSIBLE,
            (product.low / gain, product.high / gain),
            PLAUSIBILITY.friction,
        ),
        (Code.CARD_FRICTION_UNUSUAL, (middle, middle), PLAUSIBILITY.usual_friction),
    ):
        if high < limits[0] or low > limits[1]:
            factors = (middle / limits[1], middle / limits[0])
            numbers = {"mu": middle, "product": product.middle}
            yield _report_gain(card, product.element, code, factors, numbers, shift=product.shift)
            return


def _report_gain(
    card: VehicleCard,
    element: str,
    code: Code,
    factors: tuple[float, float],
    numbers: dict[str, float],
    **names: str,
) -> Finding:
    """Report a gain, or the surfaces that it is computed from, and `factors` times it."""
    spec = card.get_element(element)
    found = spec.gain.value if spec.geometry is None else float(spec.geometry.surfaces)
    unit = "m³" if spec.geometry is None else "friction surfaces"
    shown = {"found": found, "low": found * factors[0], "high": found * factors[1], **numbers}
    place = find_entry(card, get_gain_key(spec))
    return report(code, "", place, element=element, unit=unit, **shown, **names)


def _check_bounds(
    log: ShiftLog, card: VehicleCard, shift: Shift, label: str
) -> Iterator[tuple[str, Finding]]:
    """Bound μ of the off-going element: it holds the engine torque before the shift, and slips
    at break-away with no more than that torque.
    """
    role = make_pressure_role(shift.offgoing)
    usable = role in log and "engine_torque" in log and card.converter is None
    if not usable or shift.offgoing == shift.oncoming:
        return
    spec = card.get_element(shift.offgoing)
    i_c = abs(card.get_clutch_ratios(shift.offgoing)[0])
    low, high = PLAUSIBILITY.friction
    before = (shift.before[0], shift.torque_phase[0])
    held = sample_span(log["engine_torque"], before)
    pressure = sample_span(log[role], before) - spec.P0.value
    rate = max(compute_engine_rate(log, card, before), 0.0)
    torque = i_c * card.i_in.value * (held - card.J_prime_range[1] * rate)
    ready = np.isfinite(torque) & (pressure > PLAUSIBILITY.least_pressure * BAR)
    if np.count_nonzero(ready) > 5:
        least = float(np.median(torque[ready] / pressure[ready])) / spec.gain.value / spec.peak
        if least > high:
            numbers = {"mu": least}
            names = {"side": "at least", "event": "holds", "shift": label}
            factors = (least / high, least / low)
            code = Code.CARD_FRICTION_BOUND
            yield shift.offgoing, _report_gain(card, spec.name, code, factors, numbers, **names)


LEAST_WINDOWS = 6
"""Fewest windows of a vehicle balance."""
WINDOW = 0.4
"""Width of the windows of the vehicle balance [s]."""
CORRELATED = 0.9
"""Least correlation of torque and acceleration."""
OPPOSED = 0.8
"""Least correlation of their changes with the wrong sign."""


def estimate_engine_inertia(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> Limits | None:
    """Estimate J' [kg m^2] at the engine from inertia phases, for the usual efficiencies.

    J' ω_e' = T_e - T_o/(η i) with the ratio i of the slipping element; independent of its gain.
    None without both torques, with a converter, or without a deceleration that is large enough.
    """
    if card.converter is not None or not {"engine_torque", "output_torque"} <= set(log.channels):
        return None
    found: list[Limits] = []
    for shift in shifts:
        i_c, i_out = card.get_clutch_ratios(get_slipping(shift)[0])
        span = find_single_slip(log, card, shift)
        if span is None:
            continue
        rate = compute_engine_rate(log, card, span)
        driving = compute_mean(log["engine_torque"], span)
        torque = compute_mean(log["output_torque"], span)
        inertia = 0.0 if card.J_out is None else card.J_out.value
        turning = compute_output_rate(log, card, span)
        torque += inertia * turning if np.isfinite(turning) else 0.0
        bounds = [
            (driving - torque / (eta * i_c * i_out * card.i_in.value)) / rate
            for eta in get_card_field("eta").usual
        ]
        if np.isfinite(bounds).all() and min(bounds) > 0.0:
            found.append((min(bounds), max(bounds)))
    if not found:
        return None
    return float(np.median([one[0] for one in found])), float(np.median([one[1] for one in found]))


def estimate_vehicle_inertia(log: ShiftLog, card: VehicleCard) -> Limits | None:
    """Estimate J3 [kg m^2] at the wheel from output torque and acceleration, load constant.

    Straight lines of either over the other bound the slope. None without output torque, or where
    both do not vary together.
    """
    if "output_torque" not in log:
        return None
    torque = log["output_torque"]
    first, last = float(torque.time[0]), float(torque.time[-1])
    count = int((last - first) / WINDOW)
    if count < LEAST_WINDOWS:
        return None
    spans: list[Span] = [(first + k * WINDOW, first + (k + 1) * WINDOW) for k in range(count)]
    rates = np.array([compute_output_rate(log, card, one) for one in spans])
    driving = np.array([compute_mean(torque, one) for one in spans])
    known = np.isfinite(rates) & np.isfinite(driving)
    if np.count_nonzero(known) < LEAST_WINDOWS:
        return None
    covariance = np.cov(rates[known], driving[known])
    product = covariance[0, 1]
    if product <= 0.0 or product < CORRELATED * np.sqrt(covariance[0, 0] * covariance[1, 1]):
        return None
    at_wheel = card.final_drive.value**2
    low, high = product / covariance[0, 0], covariance[1, 1] / product
    return float(at_wheel * low), float(at_wheel * high)


def check_torque_signs(log: ShiftLog, card: VehicleCard) -> Iterator[Finding]:
    """Report each torque that falls where the vehicle accelerates more, in gear.

    Changes from one half window to the next are compared: a slope of the road changes slowly, a
    pedal fast. After a shift the shaft rings: its torque accelerates the wheel and brakes the
    gearbox, so that the output torque is compared with the wheel alone.
    """
    spans = find_gear_spans(log, card)
    speeds = {"engine_torque": ("wheel_speed", "output_speed"), "output_torque": ("wheel_speed",)}
    for role, used in speeds.items():
        changes = []
        for gear, (first, last) in spans if role in log else []:
            windows = list(pairwise(np.arange(first, last, 0.5 * WINDOW)))
            ratio = card.compute_ratio(gear) if role == "engine_torque" else 1.0
            torques = [ratio * compute_mean(log[role], one) for one in windows]
            rates = [compute_output_rate(log, card, one, used) for one in windows]
            changes.append(np.diff([torques, rates]))
        torque, rate = np.nan_to_num(np.hstack([np.zeros((2, 0)), *changes]))
        size = float(np.sqrt(np.sum(torque**2) * np.sum(rate**2)))
        if torque.size >= LEAST_WINDOWS and float(torque @ rate) < -OPPOSED * size:
            name, correlation = log[role].source_name, float(torque @ rate) / size
            entry = format_channel_entry(role, name, sign=-1)
            yield report(Code.TORQUE_REVERSED, channel=name, entry=entry, correlation=correlation)


def check_inertias(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], doubted: frozenset[str]
) -> list[Finding]:
    """Report the design ranges that the torque balance contradicts; `doubted` keys are left out."""
    ranges = {
        "inertia.J_prime_kgm2": (card.J_prime_range, estimate_engine_inertia(log, card, shifts)),
        "inertia.J_vehicle_kgm2": (card.J_vehicle_range, estimate_vehicle_inertia(log, card)),
    }
    margin = PLAUSIBILITY.inertia_margin
    findings = []
    for key, (stated, measured) in ranges.items():
        if measured is None or key in doubted:
            continue
        low, high = measured
        if low > margin * stated[1] or margin * high < stated[0]:
            shown = {"found_low": stated[0], "found_high": stated[1], "low": low, "high": high}
            findings.append(report(Code.CARD_INERTIA_DIFFERS, "", find_entry(card, key), **shown))
    return findings
