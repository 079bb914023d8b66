# SPDX-License-Identifier: MIT
"""Logs of an independent simulator of gearbox controls: card in the product's form, and truth."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from drivetwin._util.toml import read_toml
from drivetwin.errors import CardError
from drivetwin.tcu.log import ControllerShift

_STDS = {"mass_kg": 0.025, "wheel_radius_m": 0.01}
"""Relative deviations from which the simulator draws what the card states [ratio]."""
_GAIN_STD = 0.14
_SETTLED = 3.0
"""Speed that the simulator adds to that of the vehicle in the slip of its tyre [rad/s]."""


@dataclass(frozen=True, eq=False)
class Generator:
    """Compiled simulator in a `folder` with its `module`."""

    folder: Path
    module: Any
    rough: bool

    @classmethod
    def compile(cls, source: Path, folder: Path, *, rough: bool) -> Generator:
        """Compile the simulator into a folder."""
        for name in ("gen.py", "gen.c"):
            shutil.copy(source / name, folder / name)
        command = ["gcc", "-O2", "-shared", "-fPIC", "-o", "libgen.so", "gen.c", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        spec = importlib.util.spec_from_file_location("gen", folder / "gen.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return cls(folder, module, rough)

    def make(self, seed: int) -> tuple[Path, Path, dict[str, Any]]:
        """Make the log of a vehicle; return log, card and truth."""
        self.module.write(seed, 20, str(self.folder), self.rough)
        stem = self.folder / f"tcu_{seed}"
        truth = json.loads(stem.with_suffix(".truth.json").read_text(encoding="utf-8"))
        card = stem.with_suffix(".made.toml")
        made = read_toml(stem.with_suffix(".card.toml"), CardError)
        card.write_text(tomlkit.dumps(self._convert_card(made)), encoding="utf-8")
        return stem.with_suffix(".csv"), card, truth

    def _convert_card(self, made: Mapping[str, Any]) -> dict[str, Any]:
        """Convert the simulator's card: names of keys, levers from tooth counts."""
        entries = {
            name: {"value": float(made[name]), "std": share * float(made[name])}
            for name, share in _STDS.items()
        }
        return {
            "final_drive": float(made["final_drive"]),
            **entries,
            "J_engine_kgm2": float(made["J_engine_kgm2"]),
            "J_turbine_kgm2": float(made["J_turbine_kgm2"]),
            "converter": {name: [*map(float, one)] for name, one in made["converter"].items()},
            "elements": {
                name: {"gain_Nm_per_bar": {"value": float(one), "std": _GAIN_STD * float(one)}}
                for name, one in made["design_gain_Nm_per_bar"].items()
            },
            "gears": [
                {"name": one["name"], "ratio": float(one["ratio"]), "elements": one["elements"]}
                for one in made["gears"]
            ],
            "changes": [
                {"gears": [str(one) for one in gears], "levers": dict(levers)}
                for gears, levers in self.module.LEVER.items()
            ],
        }

    def find_onset(self, truth: Mapping[str, Any], shift: ControllerShift) -> float:
        """Find the instant [s] after the change of the commanded gear at which the applying element
        of a shift begins to transmit."""
        event = truth["events"][shift.number - 1]
        made = {**truth, "converter": {k: np.array(v) for k, v in truth["converter"].items()}}
        run = self.module.run(made, event)
        kiss = truth["clutches"][shift.on]["P0"] * (1.0 - 0.003 * (event["temp"] - 60.0))
        change = int(np.argmax(run[:, 14] > 0.0))
        above = np.flatnonzero(run[change:, 10] > kiss)
        return float(above[0]) / 1e3 if above.size else float("nan")


def list_truth(
    generator: Generator,
    truth: Mapping[str, Any],
    shifts: Sequence[ControllerShift],
    pressures: Mapping[str, float],
) -> dict[str, float]:
    """List the true values of the stated quantities; capacities at `pressures` [bar]."""
    vehicle, drive = truth["vehicle"], truth["vehicle"]["final_drive"]
    inertia = vehicle["mass"] * (vehicle["radius"] / drive) ** 2
    speed = float(np.mean([np.mean(one.speeds[:, 2]) for one in shifts]))
    tyre = vehicle["Ctyre"] * vehicle["radius"] ** 2 / drive
    found = {
        "torque_scale": vehicle["torque_scale"],
        "torque_offset": vehicle["torque_offset"],
        "J_engine": vehicle["Je"],
        "J_turbine": vehicle["Jt"],
        "J_vehicle": inertia,
        "converter_scale": float("nan"),
        "converter_overrun": 0.75,
        "shaft_stiffness": vehicle["k"],
        "tyre_slip_stiffness": tyre * speed / (speed + _SETTLED * drive),
        "torque_scale/J_vehicle": vehicle["torque_scale"] / inertia,
        "J_engine/J_vehicle": vehicle["Je"] / inertia,
        "torque_delay": vehicle["torque_lag"] + truth["log"]["torque_age"],
    }
    for name, at in pressures.items():
        one = truth["clutches"][name]
        over = at - one["P0"]
        torque = one["gain"] * over * (1.0 + one["nl"] * over)
        found |= {
            f"{name}.P0": 1e5 * one["P0"],
            f"{name}.delay": one["dead"] + 2.0 * one["zeta"] / one["wn"],
            f"{name}.slope": one["slope"],
            f"{name}.capacity": torque,
            f"{name}.capacity/J_vehicle": torque / inertia,
        }
        onsets = [generator.find_onset(truth, shift) for shift in shifts if shift.on == name]
        if onsets:
            found[f"{name}.onset"] = float(np.mean(onsets))
    return found
