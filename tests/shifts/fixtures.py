# SPDX-License-Identifier: MIT
"""Logs made from prescribed kinematics, with known phase boundaries, and logs given with truth."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.logs.read import read_log
from drivetwin.vehicle.card import VehicleCard, load_card
from drivetwin.vehicle.spec import ElementSpec, Gear, PriorValue

FloatArray = NDArray[np.float64]

ROOT = Path(__file__).parents[2]
SHARED = ROOT.parent / "shared"
P0_MADE = 0.8e5
_P0 = PriorValue(P0_MADE)


def shared(name: str) -> Path:
    """Path of a given data file; skips the test where it is absent."""
    path = SHARED / name
    if not path.exists():
        pytest.skip(f"{name} is not here: data beside the repository, not part of it")
    return path


def make_card(ratios: Mapping[str, float], P0: PriorValue = _P0) -> VehicleCard:
    """Card whose gears are each made by a brake B<gear>, except direct drive by a clutch."""
    elements = {}
    for name, ratio in ratios.items():
        direct = abs(ratio - 1.0) < 1e-9
        elements[f"B{name}"] = ElementSpec(
            name=f"B{name}",
            kind="clutch" if direct else "brake",
            gain=PriorValue(0.03),
            P0=P0,
            i_c=PriorValue(0.7) if direct else None,
            i_out=PriorValue(1.0 / 0.7) if direct else None,
        )
    return VehicleCard(
        name="made",
        loss_law="paper",
        i_in=PriorValue(1.0),
        final_drive=PriorValue(5.38),
        gears=tuple(Gear(name, PriorValue(ratio), (f"B{name}",)) for name, ratio in ratios.items()),
        elements=elements,
        J_prime_range=(5.0, 40.0),
        J_vehicle_range=(5000.0, 9000.0),
    )


def make_log(channels: Mapping[str, tuple[FloatArray, FloatArray]]) -> ShiftLog:
    """Log from (time, values) by role."""
    made = {}
    for role, (time, values) in channels.items():
        quantity = Quantity.PRESSURE if role.startswith("pressure.") else Quantity.SPEED
        if role.endswith("torque"):
            quantity = Quantity.TORQUE
        made[role] = Channel(role, quantity, time, values, role, "SI")
    return ShiftLog(made, "made", "")


@dataclass(frozen=True)
class Plan:
    """A drive through `gears` (name, ratio), shifting at `break_aways` [s].

    The slip goes from zero at break-away to the ratio of the next gear after `duration` [s],
    starting with zero slip acceleration and ending with a finite rate, as friction makes it.
    """

    gears: tuple[tuple[str, float], ...]
    break_aways: tuple[float, ...]
    duration: float = 0.35
    end: float = 4.0
    step: float = 1e-3
    noise: float = 0.0
    seed: int = 0
    torque_phase: float = 0.15
    engine_torque: float = 1500.0

    @property
    def time(self) -> FloatArray:
        return np.arange(0.0, self.end, self.step)

    def log(self) -> ShiftLog:
        """Speeds with white noise of `noise` [rad/s]; pressures, engine and output torque."""
        rng = np.random.default_rng(self.seed)
        time = self.time
        output = 90.0 + 4.0 * time
        ratio = np.full_like(time, self.gears[0][1])
        pressures = {f"pressure.B{name}": np.full_like(time, 0.02e5) for name, _ in self.gears}
        pressures[f"pressure.B{self.gears[0][0]}"][:] = 14e5
        output_torque = self.engine_torque * ratio
        for index, start in enumerate(self.break_aways):
            old, new = self.gears[index], self.gears[index + 1]
            x = np.clip((time - start) / self.duration, 0.0, 1.0)
            ratio = ratio + (new[1] - old[1]) * (3.0 * x**2 - x**3) / 2.0
            hand = np.clip((time - start) / self.torque_phase + 1.0, 0.0, None)
            fill = np.where(time > start - self.torque_phase - 0.1, 0.5 * P0_MADE, 0.02e5)
            ramp = P0_MADE + 4e5 * (time - start + self.torque_phase) / self.torque_phase
            taken = np.clip(ramp, fill, P0_MADE + 4e5)
            pressures[f"pressure.B{new[0]}"] = np.maximum(pressures[f"pressure.B{new[0]}"], taken)
            pressures[f"pressure.B{old[0]}"] *= np.clip(1.0 - hand, 0.0, 1.0)
            dip = np.where(time < start, np.clip(hand, 0.0, 1.0), 0.0)
            output_torque = output_torque - dip * self.engine_torque * (old[1] - new[1])
            output_torque = np.where(time >= start, self.engine_torque * new[1], output_torque)
        channels = {
            "input_speed": (time, ratio * output + self.noise * rng.normal(size=len(time))),
            "output_speed": (time, output + 0.3 * self.noise * rng.normal(size=len(time))),
            "engine_torque": (time, np.full_like(time, self.engine_torque)),
            "output_torque": (time, output_torque + 10.0 * rng.normal(size=len(time))),
        }
        for role, values in pressures.items():
            channels[role] = (time, values + 8e3 * rng.normal(size=len(time)))
        return make_log(channels)

    def card(self) -> VehicleCard:
        return make_card(dict(self.gears))


@dataclass(frozen=True)
class Reference:
    """A shift of the given reference solutions, with its true events [s]."""

    log: ShiftLog
    columns: Mapping[str, FloatArray]
    break_away: float
    lock_up: float


def load_reference(name: str, noise: tuple[float, float] = (0.0, 0.0), seed: int = 0) -> Reference:
    """Reference solution as a log; `noise` is white, on input and output speed [rad/s]."""
    path = shared(f"reference/dual_clutch_{name}.csv")
    names = path.read_text().split("\n", 1)[0].split(",")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    columns = {column: table[:, index] for index, column in enumerate(names)}
    events = json.loads(path.with_suffix(".json").read_text())["events"]
    rng = np.random.default_rng(seed)
    time = columns["time_s"]
    roles = {
        "engine_torque": columns["T_e_Nm"],
        "pressure.B2": columns["P_2_Pa"],
        "pressure.B3": columns["P_3_Pa"],
        "output_torque": columns["T_o_Nm"],
        "input_speed": columns["omega_e_rad_s"] + noise[0] * rng.normal(size=len(time)),
        "output_speed": columns["omega_out_rad_s"] + noise[1] * rng.normal(size=len(time)),
    }
    log = make_log({role: (time, values) for role, values in roles.items()})
    return Reference(log, columns, events[0]["time"], events[-1]["time"])


def load_measured(name: str) -> tuple[ShiftLog, VehicleCard]:
    """One of the given CSV logs with its vehicle card, as the program reads them."""
    card = load_card(ROOT / "examples" / "vehicles" / f"{name}.toml")
    return read_log(shared(f"logs/{name}.csv"), card), card
