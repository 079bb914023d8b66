# SPDX-License-Identifier: MIT
"""The restated examples of the Modelica Standard Library against their published trajectories.

The publications are themselves exact to 1e-6 relative only. The tolerance is the one that their
description suggests, else what an independent solution of the same equations deviates by.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from drivetwin.simulation.network import Output
from reference.problem import load, run
from tests.support.arrays import FloatArray

PUBLISHED = Path(__file__).resolve().parents[3] / "shared" / "msl"


class Signal(NamedTuple):
    """A published signal as sum of outputs with factors, and its tolerance."""

    terms: tuple[tuple[float, Output], ...]
    tolerance: float


def single(output: Output, tolerance: float) -> Signal:
    return Signal(((1.0, output),), tolerance)


def relative(b: str, a: str, tolerance: float) -> Signal:
    """Speed of b relative to a."""
    return Signal(((1.0, ("speed", b)), (-1.0, ("speed", a))), tolerance)


CASES: dict[tuple[str, str], dict[str, Signal]] = {
    ("coupled_clutches", "CoupledClutches"): {
        "J1.w": single(("speed", "w1"), 2e-4),
        "J1.phi": single(("angle", "w1"), 1e-4),
        "clutch1.w_rel": relative("w2", "w1", 2e-4),
        "clutch2.w_rel": relative("w3", "w2", 2e-4),
        "clutch3.w_rel": relative("w4", "w3", 2e-4),
    },
    ("first", "First"): {
        "inertia3.w": single(("speed", "end"), 2.2e-4),
        "inertia3.phi": single(("angle", "end"), 3.0e-6),
    },
    ("friction", "Friction"): {
        "inertia3.w": single(("speed", "motor"), 1e-3),
        "clutch.w_rel": relative("middle", "motor", 1e-3),
        "spring.w_rel": relative("end", "middle", 1e-3),
    },
    ("one_way_clutch", "OneWayClutch"): {
        "inertiaIn.w": single(("speed", "in"), 2.4e-5),
        "oneWayClutch.w_rel": relative("out", "in", 1.4e-5),
        "oneWayClutch.phi_rel": Signal(((1.0, ("angle", "out")), (-1.0, ("angle", "in"))), 1.4e-6),
    },
    ("lossy_gear", "LossyGearDemo1"): {
        "Inertia2.w": single(("speed", "b"), 2.1e-8),
        "Inertia2.phi": single(("angle", "b"), 3.7e-9),
    },
    ("lossy_gear_with_bearing", "LossyGearDemo2"): {
        "Inertia2.w": single(("speed", "b"), 1.3e-8),
        "Inertia2.phi": single(("angle", "b"), 2.5e-9),
    },
    ("backlash", "Backlash"): {
        "elastoBacklash.w_rel": single(("speed", "loose"), 1.4e-3),
        "elastoBacklash.phi_rel": single(("twist", "play"), 2.2e-5),
        "springDamper.w_rel": single(("speed", "tight"), 1.0e-3),
        "springDamper.phi_rel": single(("twist", "shaft"), 2.2e-5),
    },
    ("simple_gear_shift", "SimpleGearShift"): {
        "engine.w": single(("speed", "sun"), 5e-5),
        "load.w": single(("speed", "carrier"), 5e-5),
        "clutch.w_rel": relative("ring", "sun", 5e-5),
        "engine.phi": single(("angle", "sun"), 5e-5),
    },
}


def published(name: str) -> Mapping[str, FloatArray]:
    """Signals of one example, at repeated instants the last."""
    path = PUBLISHED / name / f"{name}.csv"
    if not path.is_file():
        pytest.skip("the published trajectories are not beside this checkout")
    header = path.read_text(encoding="utf-8").splitlines()[0].replace('"', "").split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    last = np.append(np.diff(rows[:, 0]) > 0.0, True)
    return dict(zip(header, rows[last].T, strict=True))


@pytest.mark.parametrize(("name", "example"), CASES, ids=[name for name, _ in CASES])
def test_a_run_agrees_with_the_published_trajectory(name: str, example: str) -> None:
    rows = published(example)
    result = run(load(name), rows["time"])
    for column, signal in CASES[name, example].items():
        value = sum(factor * result.columns[output] for factor, output in signal.terms)
        assert np.abs(value - rows[column]).max() < signal.tolerance, column
