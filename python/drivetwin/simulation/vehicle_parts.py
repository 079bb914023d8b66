# SPDX-License-Identifier: MIT
"""Parts that a vehicle may have beside the dual clutch, by their physical values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin.simulation.converter_map import Converter
from drivetwin.simulation.dual_clutch import Signal

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


@dataclass(frozen=True)
class TyreSlip:
    """Torque at the wheel over slip [N m], and the inertia before the tyre [kg m^2]."""

    slip_stiffness: float
    rim_inertia: float

    @classmethod
    def from_slip(cls, torque: float, slip: float, vehicle_inertia: float) -> TyreSlip:
        """Build the tyre that slips by `slip` under `torque` [N m] at the wheel."""
        return cls(torque / slip, RIM_SHARE * vehicle_inertia)


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
class VehicleParts:
    """Parts beside the dual clutch; None, empty or 0 where a part is absent.

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

    def share_axes(self, other: VehicleParts) -> VehicleParts:
        """Return the parts with tables over the axes of those of `other`."""
        if self.shaft_table is None or other.shaft_table is None:
            return self
        return replace(self, shaft_table=self.shaft_table.resample(other.shaft_table.twist))


NO_PARTS = VehicleParts()
