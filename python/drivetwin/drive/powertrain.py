# SPDX-License-Identifier: MIT
"""Engine, torque converter, lock-up clutch, road and control thresholds of a whole drive, in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.gearbox.spec import Capacity
from drivetwin.simulation.converter_map import Converter
from drivetwin.simulation.dual_clutch import FloatArray, RoadLoad


@dataclass(frozen=True)
class Engine:
    """Steady torque [N m] at closed and full pedal over `speed` (n,) [rad/s], linear between both.

    The closed-pedal line holds `idle` [rad/s] against a load. The torque follows with the time
    constant `lag` [s].
    """

    speed: tuple[float, ...]
    closed: tuple[float, ...]
    full: tuple[float, ...]
    lag: float
    idle: float

    def compute_steady_torque(
        self, pedal: FloatArray | float, speed: FloatArray | float
    ) -> FloatArray:
        """Torque [N m] that the map asks for at pedal positions and speeds of one shape."""
        low = np.interp(speed, self.speed, self.closed)
        high = np.interp(speed, self.speed, self.full)
        return np.asarray(low + pedal * (high - low), dtype=np.float64)


@dataclass(frozen=True)
class Control:
    """When the transmission acts.

    Speeds of the gearbox input [rad/s]: `upshift`, `downshift` with the lock-up clutch closed,
    `launch_upshift` from first gear with the converter, `release` of the lock-up clutch in
    coast-down. `lock_up_ratio` is the speed ratio at which the lock-up clutch closes, `main` the
    pressure of a closed element [Pa], `brake` the service brake of a coast-down [N m at the wheel].
    """

    upshift: float
    downshift: float
    launch_upshift: float
    release: float
    lock_up_ratio: float
    main: float
    brake: float


@dataclass(frozen=True)
class Powertrain:
    """Engine, converter, lock-up clutch, road and control of a drive; `source` is the data origin.

    `mass_inertia` is that of the mass behind the road's resistances, at the wheel: m·r² [kg m^2].
    """

    name: str
    source: str
    engine: Engine
    converter: Converter
    lock_up: Capacity
    road: RoadLoad
    mass_inertia: float
    control: Control
