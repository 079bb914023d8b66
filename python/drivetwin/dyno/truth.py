# SPDX-License-Identifier: MIT
"""The truth behind a synthetic log, under the ids that identification uses."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import pi, sqrt
from typing import Any

from drivetwin.driveline import DualClutch, FrictionTable, Stribeck, Trajectory
from drivetwin.dyno.scenario import Scenario
from drivetwin.parameters import spec_of

SCHEMA = "drivetwin-truth/1"


@dataclass(frozen=True)
class Truth:
    """Parameters by id (SI), friction law by element, and the instants of the shift [s].

    `torque_start` is where the on-coming element fills, `inertia_start` where the off-going one
    breaks away, `lockup` where the on-coming one locks; None where that did not happen.
    """

    parameters: dict[str, float]
    friction: dict[str, Stribeck | FrictionTable]
    torque_start: float | None
    inertia_start: float | None
    lockup: float | None

    def as_dict(self) -> dict[str, Any]:
        """For the side file: `parameters` as id -> {value, unit}, curves as id -> coefficients."""
        return {
            "schema": SCHEMA,
            "parameters": {
                key: {"value": value, "unit": spec_of(key).unit}
                for key, value in self.parameters.items()
            },
            "friction": {name: asdict(law) for name, law in self.friction.items()},
            "shift": {
                "torque_start": self.torque_start,
                "inertia_start": self.inertia_start,
                "lockup": self.lockup,
            },
        }


def lockup_oscillation(model: DualClutch, ratio: float) -> tuple[float, float]:
    """Damped frequency [Hz] and damping ratio of the gearbox side against the vehicle (eq. 14).

    `ratio` is the overall ratio of the gear that is held; eqs. 12-14 of the paper in the output
    shaft's frame.
    """
    J4 = (model.J1 * model.eta + model.J2e) * ratio**2 + model.J_out
    J5 = model.J_v / model.i_f**2
    J = J4 * J5 / (J4 + J5)
    zeta = model.c_o / (2.0 * sqrt(J * model.k_o))
    return sqrt(model.k_o / J * (1.0 - zeta**2)) / (2.0 * pi), zeta


def truth_of(scenario: Scenario, trajectory: Trajectory) -> Truth:
    """What an identification of this run should return."""
    model = scenario.model
    start, end = scenario.start_gear, scenario.end_gear
    start_ratio, end_ratio = scenario.ratio(scenario.offgoing), scenario.ratio(scenario.oncoming)
    engine_side = model.J1 * model.eta + model.J2e
    f_d, zeta = lockup_oscillation(model, end_ratio)
    delays = {sensor.role: sensor.delay for sensor in scenario.sensors}
    parameters = {
        "eta": model.eta,
        f"J_prime_{start}": engine_side + model.J_out / start_ratio**2,
        f"J_prime_{end}": engine_side + model.J_out / end_ratio**2,
        "J_out": model.J_out,
        "J_vehicle": model.J_v,
        "Tv_over_if": (model.load.constant + model.load.rolling) / model.i_f,
        "k_o": model.k_o,
        "c_o": model.c_o,
        f"f_d_{end}": f_d,
        f"zeta_{end}": zeta,
        **{f"P0.{element.name}": element.P0 for element in model.elements},
        "te_delay": delays["engine_torque"],
    }
    return Truth(
        parameters,
        {element.name: element.friction for element in model.elements},
        torque_start=_first(trajectory, scenario.oncoming, "fill"),
        inertia_start=_first(trajectory, scenario.offgoing, "break_away"),
        lockup=_first(trajectory, scenario.oncoming, "lock"),
    )


def _first(trajectory: Trajectory, element: str, kind: str) -> float | None:
    """Time of the first such event [s], or None."""
    times = (
        event.time for event in trajectory.events if (event.element, event.kind) == (element, kind)
    )
    return next(times, None)
