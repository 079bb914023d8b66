# SPDX-License-Identifier: MIT
"""Elements that a vehicle may have beside the dual clutch, by their physical values and parameters.

Among them the map of a torque converter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin.simulation.dual_clutch import DualClutch, FloatArray, Signal


@dataclass(frozen=True)
class Converter:
    """Steady-state map over ν = ω_turbine/ω_pump: `capacity` [N m s^2/rad^2] and torque ratio."""

    speed_ratio: tuple[float, ...]
    capacity: tuple[float, ...]
    torque_ratio: tuple[float, ...]

    def compute_pump_torque(
        self, pump: FloatArray | float, turbine: FloatArray | float
    ) -> FloatArray:
        """Torque that the pump takes [N m] at speeds of pump and turbine [rad/s], pump > 0."""
        capacity = np.interp(np.divide(turbine, pump), self.speed_ratio, self.capacity)
        return np.asarray(capacity * np.square(pump), dtype=np.float64)

    def compute_torque_ratio(
        self, pump: FloatArray | float, turbine: FloatArray | float
    ) -> FloatArray:
        """Turbine torque over pump torque."""
        ratio = np.interp(np.divide(turbine, pump), self.speed_ratio, self.torque_ratio)
        return np.asarray(ratio, dtype=np.float64)

    def compute_turbine_torque(
        self, pump: FloatArray | float, turbine: FloatArray | float
    ) -> FloatArray:
        """Torque that the turbine gives [N m] at speeds of pump and turbine [rad/s], pump > 0."""
        return self.compute_torque_ratio(pump, turbine) * self.compute_pump_torque(pump, turbine)

    def compute_point_torques(self, pump: FloatArray, turbine: FloatArray) -> dict[int, FloatArray]:
        """Derivatives of the turbine's torque (n,) [N m] by the relative change of its value at a
        point of the map, by index; without the points at which the converter never works."""
        at = np.divide(turbine, pump)
        torque = self.compute_turbine_torque(pump, turbine)
        near = np.eye(len(self.speed_ratio))
        every = (np.interp(at, self.speed_ratio, one) * torque for one in near)
        return {k: one for k, one in enumerate(every) if np.any(one != 0.0)}

    def change_torque(self, changes: Mapping[int, float]) -> Converter:
        """Return the map with relative changes of the torque at points, by index."""
        capacity = [one * (1.0 + changes.get(k, 0.0)) for k, one in enumerate(self.capacity)]
        return replace(self, capacity=tuple(capacity))

    def compute_turbine_slopes(
        self, pump: FloatArray, turbine: FloatArray, steps: tuple[float, float]
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the turbine's torque (n,) [N m s/rad] by the speeds of pump and turbine.

        As secants over ± `steps` [rad/s] of either speed, so that at a corner of the map the mean
        of both sides counts.
        """
        of_pump = np.minimum(steps[0], 0.5 * pump)
        of_turbine = np.full_like(turbine, steps[1])
        by_pump = self.compute_turbine_torque(
            pump + of_pump, turbine
        ) - self.compute_turbine_torque(pump - of_pump, turbine)
        by_turbine = self.compute_turbine_torque(
            pump, turbine + of_turbine
        ) - self.compute_turbine_torque(pump, turbine - of_turbine)
        return by_pump / (2.0 * of_pump), by_turbine / (2.0 * of_turbine)


RIM_SHARE = 0.02
"""Share of the vehicle's inertia before the tyre: rims, tyres and side shafts; an engineering
estimate [-]."""
_TABLE_END, _TABLE_STEP = 2.5, 1.0 / 32.0
"""Range and step of the table of a progressive shaft, over its reference torque: errors below 1e-3
of the factor."""


def compute_gap(size: float, torque: float, stiffness: float) -> float:
    """Compute the play [rad] of which half times `stiffness` [N m/rad] is `size` of `torque`."""
    return 2.0 * size * torque / stiffness


@dataclass(frozen=True)
class InputShaft:
    """Shaft inside J1: stiffness [N m/rad], damping [N m s/rad], inertia in front [kg m^2]."""

    stiffness: float
    damping: float
    inertia: float

    @classmethod
    def from_mode(cls, inertia: float, frequency: float, damping: float) -> InputShaft:
        """Build the shaft on which `inertia` [kg m^2] swings against a held gearbox at `frequency`
        [Hz], with the damping ratio `damping`."""
        omega = 2.0 * np.pi * frequency
        return cls(inertia * omega**2, 2.0 * damping * omega * inertia, inertia)


@dataclass(frozen=True)
class OpenConverter:
    """Torque converter whose pump turns with an engine of `engine_inertia` [kg m^2].

    The model behind it has the turbine's inertia in its J1.
    """

    converter: Converter
    engine_inertia: float


LEAST_SPEED = 0.5
"""Speed of the vehicle at the wheel [rad/s] below which a tyre is a damper."""
_FAST_RIM = 2e-3
"""Lag [s] of a rim behind a linear tyre below which it is left out: the span of the central
differences by which jerk is computed."""


@dataclass(frozen=True)
class TyreSlip:
    """Torque at the wheel over slip [N m], and the inertia before the tyre [kg m^2], perhaps 0.

    With a `speed` of the vehicle at the wheel [rad/s] the tyre is linear about it: a damper.
    """

    slip_stiffness: float
    rim_inertia: float
    speed: float | None = None

    @classmethod
    def from_slip(cls, torque: float, slip: float, vehicle_inertia: float) -> TyreSlip:
        """Build the tyre that slips by `slip` under `torque` [N m] at the wheel."""
        return cls(torque / slip, RIM_SHARE * vehicle_inertia)

    def linearise(self, speed: float) -> TyreSlip:
        """Return the damper about a speed of the vehicle at the wheel [rad/s].

        A run passes it several times as fast as the exact law.
        """
        return replace(self, speed=max(abs(speed), LEAST_SPEED))

    def drop_fast_rim(self) -> TyreSlip:
        """Return the damper without its rim where that follows the wheel at once."""
        assert self.speed is not None, "the tyre is linear"
        lag = self.rim_inertia * self.speed / self.slip_stiffness
        return replace(self, rim_inertia=self.rim_inertia * (lag > _FAST_RIM))

    def share_form(self, other: TyreSlip | None) -> TyreSlip:
        """Return the tyre exact, or linear with or without a rim, as `other` is."""
        if other is None or other.speed is None:
            return self
        return replace(
            self, rim_inertia=self.rim_inertia * (other.rim_inertia > 0.0), speed=other.speed
        )


@dataclass(frozen=True, eq=False)
class ShaftTable:
    """Twists (n,) [rad] and torques (n,) [N m] of a progressive shaft."""

    twist: tuple[float, ...]
    torque: tuple[float, ...]

    @classmethod
    def from_factor(cls, stiffness: float, torque: float, factor: float) -> ShaftTable:
        """Build the shaft T = k·φ·(1 + f·((k·φ/T0)² - 1/2)) with f = `factor` and T0 = `torque`.

        `stiffness` k [N m/rad] is the ratio of torque to twist at T0/√2. The table reaches
        2.5 times T0 [N m] on both sides.
        """
        count = 2 * round(_TABLE_END / _TABLE_STEP) + 1
        share = np.linspace(-_TABLE_END, _TABLE_END, count)
        twist = torque / float(stiffness) * share
        linear = [stiffness * float(one) for one in twist]
        torques = (one * (1.0 + factor * ((one / torque) ** 2 - 0.5)) for one in linear)
        return cls(tuple(twist.tolist()), tuple(torques))

    def resample(self, twist: tuple[float, ...]) -> ShaftTable:
        """Return the shaft with its torques at other twists (n,) [rad], 0 among them."""
        return ShaftTable(twist, tuple(np.interp(twist, self.twist, self.torque).tolist()))


@dataclass(frozen=True, eq=False)
class AddedElements:
    """Elements beside the dual clutch; None, empty or 0 where one is absent.

    `front` couples the engine to the gearbox. `input_drag` and `brake_drag` [N m] oppose the motion
    of gearbox input and wheel. `efficiency` is the efficiency of the gear of a shift element over
    that of the model, by its name. `gap` [rad] is the play of the output shaft, `walk` [N m] the
    part of the load that varies slowly, against the motion.
    """

    front: InputShaft | OpenConverter | None = None
    input_drag: float = 0.0
    efficiency: Mapping[str, float] = field(default_factory=dict)
    gap: float = 0.0
    shaft_table: ShaftTable | None = None
    brake_drag: float = 0.0
    tyre: TyreSlip | None = None
    walk: Signal | None = None

    def share_form(self, other: AddedElements) -> AddedElements:
        """Return the elements as those of `other` are: tables over its axes, linear tyre."""
        tyre, table = self.tyre, self.shaft_table
        if tyre is not None:
            tyre = tyre.share_form(other.tyre)
        if table is not None and other.shaft_table is not None:
            table = table.resample(other.shaft_table.twist)
        return replace(self, tyre=tyre, shaft_table=table)


NO_ADDED_ELEMENTS = AddedElements()


MODE_FREQUENCY, MODE_SHARE, MODE_DAMPING = "mode_frequency", "mode_share", "mode_damping"
BACKLASH, TYRE_SLIP = "backlash", "tyre_slip"
PROGRESSION, REFERENCE = "shaft_progression", "shaft_reference"
"""Parameter ids, see `drivetwin.parameters`."""
ADDED_ELEMENTS: Mapping[str, tuple[str, ...]] = {
    "an input shaft": (MODE_FREQUENCY, MODE_SHARE, MODE_DAMPING),
    "backlash in the output shaft": (BACKLASH,),
    "slip of the tyres": (TYRE_SLIP, REFERENCE),
    "a progressive output shaft": (PROGRESSION, REFERENCE),
}
"""Parameters of each element by its name, that of the size first."""
ADDED_ELEMENT_IDS = tuple(dict.fromkeys(name for ids in ADDED_ELEMENTS.values() for name in ids))
"""All ids of added elements, in reporting order."""


def select_added_elements(values: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters by id of the elements all of whose parameters are in `values`."""
    complete = [ids for ids in ADDED_ELEMENTS.values() if values.keys() >= set(ids)]
    chosen = set().union(*complete)
    return {name: values[name] for name in ADDED_ELEMENT_IDS if name in chosen}


def build_added_elements(values: Mapping[str, float], model: DualClutch) -> AddedElements:
    """Build the elements that parameters describe.

    Parameters
    ----------
    values
        Parameters by id; ids of no added element, and of incomplete ones, are ignored.
    model
        Dual clutch of a shift.

    Returns
    -------
    AddedElements
        `NO_ADDED_ELEMENTS` where the parameters describe none.
    """
    values = select_added_elements(values)
    if not values:
        return NO_ADDED_ELEMENTS
    front = tyre = table = None
    if MODE_FREQUENCY in values:
        inertia = values[MODE_SHARE] * model.J1
        front = InputShaft.from_mode(inertia, values[MODE_FREQUENCY], values[MODE_DAMPING])
    if TYRE_SLIP in values:
        tyre = TyreSlip.from_slip(values[REFERENCE] * model.i_f, values[TYRE_SLIP], model.J_v)
    if PROGRESSION in values:
        table = ShaftTable.from_factor(model.k_o, values[REFERENCE], values[PROGRESSION])
    return AddedElements(
        front=front,
        gap=values.get(BACKLASH, 0.0),
        shaft_table=table,
        tyre=tyre,
    )


def describe_added_elements(values: Mapping[str, float]) -> str:
    """Describe in words the elements that parameters by id describe."""
    return " and ".join(name for name, (size, *_) in ADDED_ELEMENTS.items() if size in values)
