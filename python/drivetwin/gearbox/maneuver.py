# SPDX-License-Identifier: MIT
"""Gears of a gearbox, and a reference shift with errors by which two models of it are compared.

The shift is a clean up-shift under power or a coasting down-shift. The off-going element gives its
torque up to the on-coming one, then the on-coming torque, constant but for the slope of μ, brings
the input to the new gear within the inertia phase, and holds.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin._native import gear_statics as native_gear_statics
from drivetwin.errors import InputError, NoFixedRatioError, ReductionError
from drivetwin.gearbox.reduction import Reduction, as_json
from drivetwin.gearbox.spec import POWER_SPLIT_REMEDY, Capacity, Drive, Gearbox
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.element_schema import GROUND


@dataclass(frozen=True)
class Flange:
    """Torque that `element` exerts on `member` per unit input torque, positive with its speed."""

    element: str
    member: str
    torque: float


@dataclass(frozen=True)
class GearStatics:
    """A gear, driven with unit torque and unit speed at the input.

    `ratio` = ω_in/ω_out; `speeds` of all members, None for one that idles; `flanges` the torques
    of all sets, pairs and engaged elements on all members. `power_error` and `torque_error` are
    the largest sums of power through one element and of torque on one member: round-off.
    """

    gear: str
    elements: tuple[str, ...]
    ratio: float
    speeds: Mapping[str, float | None]
    flanges: tuple[Flange, ...]
    power_error: float
    torque_error: float

    def get_torque(self, element: str, member: str) -> float:
        """Torque of an element on a member per unit input torque; 0 where it has none."""
        return sum(f.torque for f in self.flanges if (f.element, f.member) == (element, member))

    def compute_power(self, element: str, member: str) -> float:
        """Power from an element into a member per unit input power."""
        return self.get_torque(element, member) * (self.speeds[member] or 0.0)


def describe_ratio_differences(gearbox: Gearbox, ratios: Mapping[str, float]) -> list[str]:
    """One sentence for each gear whose computed ratio, by its name, is not the published one."""
    entries = ((gearbox.get_gear(name), ratio) for name, ratio in ratios.items())
    return [
        f"gear {entry.name}: the computed ratio {ratio:.4f} is not the published "
        f"{entry.published:.6g} ± {entry.tolerance:.2g}: check teeth and elements, or state a "
        "tolerance"
        for entry, ratio in entries
        if not entry.matches_ratio(ratio)
    ]


def solve_gear(gearbox: Gearbox, gear: str) -> GearStatics:
    """Solve one gear.

    Raises NoFixedRatioError if its elements leave more than one speed free, InputError if they
    make no ratio otherwise or a freewheel works against its direction.
    """
    entry = gearbox.get_gear(gear)
    try:
        speeds, torques, (power, torque) = native_gear_statics(
            as_json(gearbox), list(entry.elements), gearbox.input, gearbox.output
        )
    except ValueError as error:
        raise _describe_refusal(gearbox, gear, error) from error
    by_member = dict(speeds)
    statics = GearStatics(
        gear=gear,
        elements=entry.elements,
        ratio=1.0 / (by_member[gearbox.output] or float("nan")),
        speeds=by_member,
        flanges=tuple(Flange(*flange) for flange in torques),
        power_error=power,
        torque_error=torque,
    )
    _check_freewheels(gearbox, statics)
    return statics


_FREE_SPEEDS = re.compile(r"(\d+) free speeds remain where 1 must")


def _describe_refusal(gearbox: Gearbox, gear: str, error: ValueError) -> InputError:
    """Return the error of a gear that makes no ratio; the core's text counts the free speeds."""
    what, remedy = (
        f"gear {gear} of {gearbox.name}: {error}",
        "correct the gear's elements in the card",
    )
    counted = _FREE_SPEEDS.search(str(error))
    if counted and int(counted[1]) > 1:
        return NoFixedRatioError(what, f"{remedy}, or {POWER_SPLIT_REMEDY}")
    return InputError(what, remedy)


_ROUND_OFF = 1e-9
"""Torque or speed per unit at the input that counts as none."""


def _check_freewheels(gearbox: Gearbox, statics: GearStatics) -> None:
    """Refuse a gear in which a freewheel drives backwards or overruns forwards."""
    for name in gearbox.freewheels:
        element = gearbox.elements[name]
        a, b = (0.0 if end == GROUND else statics.speeds[end] for end in (element.a, element.b))
        if name in statics.elements:
            pushed = statics.get_torque(name, element.b) - statics.get_torque(name, element.a)
            fault = f"would have to take torque from {element.b}" if pushed < -_ROUND_OFF else ""
        else:
            slip = 0.0 if a is None or b is None else a - b
            fault = f"would block {element.a} against {element.b}" if slip > _ROUND_OFF else ""
        if fault:
            raise InputError(
                f"gear {statics.gear} of {gearbox.name}: the freewheel {name} {fault}",
                f"swap the members of elements.{name}: the first drives the second forward; a "
                "single member cannot turn backwards",
            )


@dataclass(frozen=True)
class CouplingError:
    """Largest differences between full gearbox and dual-clutch form over a shift.

    `shaft_torque` [N m], `input_speed` and `output_speed` [rad/s].
    """

    shaft_torque: float
    input_speed: float
    output_speed: float


@dataclass(frozen=True, eq=False)
class Traces:
    """Shaft torque [N m], speeds of input and output [rad/s] of one model; arrays (n,)."""

    shaft_torque: FloatArray
    input_speed: FloatArray
    output_speed: FloatArray

    def compute_largest_difference(self, other: Traces) -> CouplingError:
        """Compare with another model over the same times."""
        return CouplingError(
            shaft_torque=float(np.max(np.abs(self.shaft_torque - other.shaft_torque))),
            input_speed=float(np.max(np.abs(self.input_speed - other.input_speed))),
            output_speed=float(np.max(np.abs(self.output_speed - other.output_speed))),
        )


LEAD_IN = 0.1
"""Time in the old gear before the torque phase, s."""
AFTER = 0.6
"""Time in the new gear that is looked at, s: several periods of the output shaft."""
RAMP = 0.05
"""Time in which the on-coming torque rises from the handed-over to the synchronising one, s."""
HOLDING = 3.0
"""Capacity of an element that is to hold, over the torque of the gear."""
FILL = 0.02
"""Time in which a pressure falls to or rises from zero, s."""


@dataclass(frozen=True)
class Maneuver:
    """The operating point of a reference shift; torques [N m], speeds [rad/s], times [s].

    The inertia phase begins at `release` with the `output_speed` and ends at `lock`. `handover` and
    `synchronising` are the on-coming torque at its begin and, in the mean, within it; `on_coming`
    is the capacity of the on-coming element. `load` is the load at the output.
    """

    drive: Drive
    engine_torque: float
    load: float
    old_ratio: float
    new_ratio: float
    output_speed: float
    handover: float
    synchronising: float
    on_coming: Capacity
    on_coming_i_c: float
    release: float
    lock: float

    @property
    def slip(self) -> float:
        """Slip of the on-coming element at the release, rad/s, without its sign."""
        per_speed = self.new_ratio / self.old_ratio - 1.0
        return abs(per_speed * self.output_speed * self.old_ratio / self.on_coming_i_c)

    @property
    def vehicle(self) -> float:
        """Vehicle inertia at the output, kg m^2 (J5)."""
        return self.drive.vehicle_inertia / self.drive.final_drive**2

    def compute_speed_gain(self, inertia: float, grip: float) -> float:
        """Speed that the output gains before the release [rad/s].

        `inertia` before the shaft, at the output [kg m^2]; `grip` is the slip of the on-coming
        element per output speed in the old gear.
        """
        pull = self.old_ratio * self.engine_torque - self.load
        taken = 0.5 * grip * self.handover * self.drive.torque_phase
        return (pull * self.release - taken) / (inertia + self.vehicle)


def plan(reduction: Reduction, drive: Drive) -> Maneuver:
    """Plan the reference shift.

    Raises ReductionError where it cannot be: an element without capacity, an open converter, or
    gears of opposite sense.
    """
    _require_lock_up(reduction)
    old, new = reduction.off_going, reduction.on_coming
    step = new.ratio / old.ratio
    if step <= 0.0 or abs(step - 1.0) < 1e-6:
        raise ReductionError(
            f"no reference shift leads from ratio {old.ratio:.4g} to {new.ratio:.4g}",
            "choose two gears of the same sense and of different ratios",
        )
    upshift = step < 1.0
    freewheels = [name for name in reduction.common if name in reduction.gearbox.freewheels]
    if freewheels and not upshift:
        raise ReductionError(
            f"the freewheel {freewheels[0]} opens in a coasting down-shift",
            "choose an up-shift, or gears that a clutch or brake holds instead",
        )
    torque = drive.engine_torque if upshift else drive.overrun_torque
    inertia = drive.engine_inertia + reduction.M11
    vehicle = reduction.M22 + drive.vehicle_inertia / drive.final_drive**2
    load = drive.load_torque / drive.final_drive if upshift else 0.0
    phase = drive.inertia_phase
    # Momentum: what the on-coming torque takes from the input reaches the output i_h times.
    alone = (step - 1.0) * drive.engine_speed
    pulled = (new.ratio * torque - load) / vehicle * phase
    swing = (alone + new.ratio * pulled) / (1.0 + new.ratio**2 * inertia / vehicle)
    synchronising = new.i_c * (torque - inertia * swing / (phase - 0.5 * RAMP))
    return Maneuver(
        drive=drive,
        engine_torque=torque,
        load=load,
        old_ratio=old.ratio,
        new_ratio=new.ratio,
        output_speed=drive.engine_speed / old.ratio,
        handover=new.i_c * torque,
        synchronising=synchronising,
        on_coming=reduction.gearbox.get_capacity(new.element),
        on_coming_i_c=new.i_c,
        release=LEAD_IN + drive.torque_phase,
        lock=LEAD_IN + drive.torque_phase + phase,
    )


def _require_lock_up(reduction: Reduction) -> None:
    """Raise ReductionError if the converter is open in one of the two gears."""
    gearbox = reduction.gearbox
    for gear in (reduction.from_gear, reduction.to_gear):
        if solve_gear(gearbox, gear).speeds[gearbox.engine_member] is None:
            raise ReductionError(
                f"the converter of {gearbox.name} is open in gear {gear}: the engine does not turn "
                "with the input",
                "list a lock-up clutch between pump and turbine in the elements of both gears, or "
                "simulate the network of drivetwin.gearbox.build_network_elements",
            )


def build_signals(reduction: Reduction, maneuver: Maneuver) -> tuple[Signal, Mapping[str, Signal]]:
    """Engine torque and pressures [Pa] by element, common elements included, over the shift."""
    end = maneuver.lock + AFTER
    hold = maneuver.lock + 0.5 * AFTER
    on_coming = maneuver.on_coming
    largest = max(abs(maneuver.engine_torque), abs(maneuver.synchronising))

    def pressure(capacity: Capacity, torque: float, mu: float) -> float:
        return capacity.P0 + abs(torque) / (mu * capacity.gain)

    def holding(capacity: Capacity, share: float) -> float:
        return pressure(capacity, HOLDING * largest * share, capacity.compute_mean_mu(0.0))

    mu = on_coming.compute_mean_mu(maneuver.slip)
    begin = float(on_coming.friction.evaluate(np.full(1, maneuver.slip))[0])
    off_going = reduction.gearbox.get_capacity(reduction.off_going.element)
    rising = [
        (0.0, 0.0),
        (LEAD_IN - FILL, 0.0),
        (LEAD_IN, on_coming.P0),
        (maneuver.release, pressure(on_coming, maneuver.handover, begin)),
        (maneuver.release + RAMP, pressure(on_coming, maneuver.synchronising, mu)),
        (hold, pressure(on_coming, maneuver.synchronising, mu)),
        (hold + FILL, holding(on_coming, reduction.on_coming.ratio)),
        (end, holding(on_coming, reduction.on_coming.ratio)),
    ]
    full = holding(off_going, abs(reduction.off_going.ratio))
    falling = [(0.0, full), (maneuver.release - FILL, full), (maneuver.release, 0.0), (end, 0.0)]
    lines = {reduction.on_coming.element: rising, reduction.off_going.element: falling}
    for name in reduction.common:
        capacity = reduction.gearbox.elements[name].capacity
        if capacity is not None:
            always = holding(capacity, 10.0)
            lines[name] = [(0.0, always), (end, always)]
    torque = Signal(np.array([0.0, end]), np.full(2, maneuver.engine_torque))
    return torque, {name: build_line(points) for name, points in lines.items()}


def build_time_grid(maneuver: Maneuver) -> FloatArray:
    """Times of the whole shift at 2 kHz, above every frequency of the driveline."""
    end = maneuver.lock + AFTER
    return np.linspace(0.0, end, round(2000.0 * end) + 1)


def build_line(points: list[tuple[float, float]]) -> Signal:
    """Return a signal linear between `points` of time [s] and value."""
    time, values = zip(*points, strict=True)
    return Signal(np.array(time), np.array(values))
