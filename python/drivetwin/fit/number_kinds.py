# SPDX-License-Identifier: MIT
"""Usual standard deviations of the numbers of elements, by type and field, as on vehicle cards."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin.channels.roles import Quantity
from drivetwin.vehicle import spec


@dataclass(frozen=True)
class UsualDeviation:
    """Usual standard deviation of a kind of number: `relative`, or `absolute` in SI.

    `level` is the relative deviation of a factor that all numbers of one element with the same
    `shared` name have in common. `unit` is True where one is exact, `digits` where the written
    digits state the deviation.
    """

    relative: float = 0.0
    absolute: float = 0.0
    level: float = 0.0
    shared: str = ""
    unit: bool = False
    digits: bool = False


_EXACT = UsualDeviation()
_RATIO = UsualDeviation(digits=True)
_INERTIA = UsualDeviation(spec.INERTIA_STD)
_STIFFNESS, _DAMPING = UsualDeviation(spec.STIFFNESS_STD), UsualDeviation(spec.DAMPING_STD)
_DRAG = UsualDeviation(spec.DRAG_STD)
_PEAK = UsualDeviation(absolute=spec.PEAK_STD, unit=True)
_EFFICIENCY = UsualDeviation(absolute=spec.EFFICIENCY_STD, unit=True)
_LOSSES = {
    "losses.speed": _EXACT,
    "losses.torque": _EXACT,
    "losses.loss": UsualDeviation(level=spec.DRAG_STD, shared="losses"),
}
_FRICTION = {
    "friction.mu_c": UsualDeviation(level=spec.FRICTION_LEVEL_STD, shared="friction", unit=True),
    "friction.mu_s": UsualDeviation(
        absolute=spec.PARTNER_REST_STD, level=spec.FRICTION_LEVEL_STD, shared="friction", unit=True
    ),
    "friction.v_s": UsualDeviation(spec.STRIBECK_SPEED_STD),
    "friction.mu_v": UsualDeviation(spec.VISCOUS_SLOPE_STD),
    "friction.slip": _EXACT,
    "friction.mu": UsualDeviation(level=spec.FRICTION_LEVEL_STD, shared="friction", unit=True),
    "gain": UsualDeviation(spec.GAIN_STD, unit=True),
    "p0": UsualDeviation(absolute=spec.FILL_PRESSURE_STD),
    "peak": _PEAK,
}
USUAL: Mapping[str, Mapping[str, UsualDeviation]] = {
    "inertia": {"inertia": _INERTIA},
    "gear": {
        "ratio": _RATIO,
        "loss.eta": _EFFICIENCY,
        "loss.eta_backward": _EFFICIENCY,
        "loss.drag": _DRAG,
        "loss.drag_backward": _DRAG,
        **_LOSSES,
    },
    "planetary": {"z": _RATIO, "planet_inertia": _INERTIA, **_LOSSES},
    "clutch": {
        **_FRICTION,
        "drum_inertia": _INERTIA,
        "drag.slip": _EXACT,
        "drag.torque": UsualDeviation(level=spec.DRAG_STD, shared="drag"),
    },
    "one_way_clutch": {f"clutch.{key}": one for key, one in _FRICTION.items()},
    "bearing": {
        "speed": _EXACT,
        "torque": UsualDeviation(level=spec.DRAG_STD, shared="torque"),
        "peak": _PEAK,
    },
    "viscous_coupling": {
        "slip": _EXACT,
        "torque": UsualDeviation(level=spec.DRAG_STD, shared="torque"),
    },
    "spring_damper": {"stiffness": _STIFFNESS, "damping": _DAMPING},
    "spring_table": {
        "twist": _EXACT,
        "torque": UsualDeviation(level=spec.STIFFNESS_STD, shared="torque"),
        "damping": _DAMPING,
    },
    "backlash": {
        "stiffness": _STIFFNESS,
        "damping": _DAMPING,
        "gap": UsualDeviation(spec.PLAY_STD),
    },
    "torque_converter": {
        "map.speed_ratio": _EXACT,
        "map.capacity": UsualDeviation(
            spec.CONVERTER_POINT_STD, level=spec.CONVERTER_SCALE_STD, shared="map.capacity"
        ),
        "map.torque_ratio": UsualDeviation(spec.CONVERTER_POINT_STD, unit=True),
    },
    "tyre": {"slip_stiffness": UsualDeviation(spec.TYRE_STD), "least_speed": _EXACT},
    "road_load": {
        "constant": UsualDeviation(spec.LOAD_STD),
        "rolling": UsualDeviation(spec.ROLLING_STD),
        "aero": UsualDeviation(spec.AERO_STD),
    },
    "torque": {},
    "engine_map": {
        "map.throttle": _EXACT,
        "map.speed": _EXACT,
        "map.torque": UsualDeviation(level=spec.TORQUE_MAP_STD, shared="map.torque"),
        "lag": UsualDeviation(spec.LAG_STD),
    },
    "prescribed_speed": {},
}
"""Usual deviations by type of element and field. The points at which a table is given are exact:
the values there have the distribution."""

_GAINS = {
    "inputs": UsualDeviation(spec.ENGINE_TORQUE_STD),
    "outputs": UsualDeviation(spec.TORQUE_METER_STD),
}


def get_usual_beside(head: str, table: str, quantity: Quantity | None = None) -> UsualDeviation:
    """Return the usual deviation of a number beside the elements.

    Parameters
    ----------
    head
        First name of its path: `gain`, `offset` or `delay` of a channel, `input` or `start`.
    table
        `inputs` or `outputs` of a channel.
    quantity
        Quantity of the channel.

    Returns
    -------
    UsualDeviation
        Exact but for the gain of a torque.
    """
    return _GAINS[table] if head == "gain" and quantity is Quantity.TORQUE else _EXACT
