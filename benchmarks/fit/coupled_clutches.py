# SPDX-License-Identifier: MIT
"""Fit of CoupledClutches of the Modelica Standard Library to its published trajectory with noise.

The published speeds are not part of the project; they stand beside the checkout.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from pathlib import Path

import numpy as np

from benchmarks.fit.problem import SPREAD
from benchmarks.fit.report import format_header, format_row
from benchmarks.fit.study import HALF
from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.unknown import Unknown
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Plates
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Output

PUBLISHED = (
    Path(__file__).resolve().parents[3]
    / "shared"
    / "msl"
    / "CoupledClutches"
    / "CoupledClutches.csv"
)
COUNT = 20
"""Noise realisations."""
SIGMA = 0.02
"""Noise of a speed [rad/s]."""
END, RATE = 1.5, 500.0
"""End of the recording [s], and its rate [Hz]."""
PEAK, FORCE = 1.1, 20.0
"""Static over kinetic capacity, and largest normal force [N]."""
TRUTH = {
    **{f"J{k}": 1.0 for k in (1, 2, 3, 4)},
    **{f"mu{k}": 0.5 for k in (1, 2, 3)},
}
"""Inertias [kg·m²] and friction coefficients."""
PATHS = {
    **{f"J{k}": (f"J{k}.inertia",) for k in (1, 2, 3, 4)},
    **{f"mu{k}": (f"clutch{k}.friction.mu.0",) for k in (1, 2, 3)},
}


def run(seed: int) -> str:
    """Fit all realisations and count the estimates inside their 95 % intervals.

    Parameters
    ----------
    seed
        Seed of the first realisation.

    Returns
    -------
    str
        Table by unknown, and the total. Raises InputError without the published trajectory.
    """
    time = np.linspace(0.0, END, round(END * RATE) + 1)
    speeds = read_published(time)
    inside = dict.fromkeys(TRUTH, 0)
    errors: dict[str, list[float]] = {name: [] for name in TRUTH}
    stds: dict[str, list[float]] = {name: [] for name in TRUTH}
    for at in range(seed, seed + COUNT):
        for name, (value, std) in _fit_noisy(time, speeds, at).items():
            errors[name].append(np.log(value / TRUTH[name]))
            stds[name].append(std / value)
            inside[name] += abs(errors[name][-1]) < HALF * stds[name][-1]
    lines = [
        "## CoupledClutches of the Modelica Standard Library",
        "",
        format_header("unknown", "truth", "RMSE", "median stated std", "inside"),
    ]
    for name, truth in TRUTH.items():
        error = np.sqrt(np.mean(np.square(errors[name])))
        cells = (f"{100 * error:.3f} %", f"{100 * np.median(stds[name]):.3f} %")
        lines.append(format_row(name, f"{truth:g}", *cells, f"{inside[name]} of {COUNT}"))
    total = sum(inside.values())
    lines += ["", f"Inside their 95 % intervals: {total} of {COUNT * len(TRUTH)}.", ""]
    return "\n".join(lines)


def read_published(time: FloatArray) -> dict[str, FloatArray]:
    """Return the published speeds (n,) [rad/s] of the four inertias on `time` (n,) [s].

    Of instants that stand twice the last row counts. Raises InputError where the file is absent.
    """
    if not PUBLISHED.is_file():
        raise InputError(
            "the published trajectory of CoupledClutches is not beside this checkout",
            "put it into shared/msl next to the project",
        )
    header = PUBLISHED.read_text(encoding="utf-8").partition("\n")[0].replace('"', "").split(",")
    table = np.genfromtxt(PUBLISHED, delimiter=",", skip_header=1)
    last = np.append(np.diff(table[:, 0]) > 0.0, True)
    columns = dict(zip(header, table[last].T, strict=True))
    speeds = [columns["J1.w"]]
    speeds += [columns[f"clutch{k}.w_rel"] for k in (1, 2, 3)]
    sums = np.cumsum(speeds, axis=0)
    return {f"w{k + 1}": np.interp(time, columns["time"], sums[k]) for k in range(4)}


def build_model(values: Mapping[str, float], inputs: Mapping[str, Signal]) -> Model:
    """Return the model by inertias and friction coefficients."""
    model = Model("CoupledClutches")
    model.torque("drive", "J1", inputs["drive"])
    for k in (1, 2, 3, 4):
        model.inertia(f"J{k}", values[f"J{k}"], f"J{k}")
    for k in (1, 2, 3):
        plates = Plates(values[f"mu{k}"], peak=PEAK)
        force = inputs[f"clutch{k}"]
        model.clutch(f"clutch{k}", f"J{k}", f"J{k + 1}", pressure=force, plates=plates)
    model.start({"J1": 10.0, "J2": 0.0, "J3": 0.0, "J4": 0.0})
    return model


def make_inputs() -> dict[str, Signal]:
    """Return the torque [N·m] and the normal forces [N] as stated by the example."""
    dense = np.linspace(0.0, END, round(END * 2000.0) + 1)
    return {
        "drive": Signal(dense, 10.0 * np.sin(2.0 * pi * 5.0 * dense)),
        "clutch1": Signal(dense, FORCE * np.cos(2.0 * pi * 0.2 * dense)),
        "clutch2": _make_step(0.4),
        "clutch3": _make_step(0.9),
    }


def _make_step(at: float) -> Signal:
    return Signal(np.array([0.0, at, at, END]), np.array([0.0, 0.0, FORCE, FORCE]))


def _fit_noisy(
    time: FloatArray, speeds: Mapping[str, FloatArray], seed: int
) -> dict[str, tuple[float, float]]:
    """Return value and standard deviation by unknown for the noise of a seed."""
    rng = np.random.default_rng([seed, 7])
    outputs = {
        name: Measured(time, values + SIGMA * rng.standard_normal(time.size), SIGMA)
        for name, values in speeds.items()
    }
    means = {
        name: float(value * np.exp(SPREAD * rng.standard_normal())) for name, value in TRUTH.items()
    }
    inputs = make_inputs()
    known = {"J1": 10.0, "J2": 0.0, "J3": 0.0, "J4": 0.0}
    unknowns = {
        name: Unknown(mean, SPREAD * mean, paths=PATHS[name]) for name, mean in means.items()
    }
    wanted: dict[str, Output] = {f"w{k}": ("speed", f"J{k}") for k in (1, 2, 3, 4)}
    model = build_model(means, inputs)
    drive = {"drive": inputs["drive"]}  # the forces are exact: as inputs of the model they stay so
    named = ("gain", *(one.name for one in model.components))
    exact = dict.fromkeys(named, Tolerance(exact=True))
    recording = Recording(drive, outputs, known)
    found = model.fit([recording], unknowns, wanted, tolerances=exact, seed=0)
    return {name: (found.values[name], found.std[name]) for name in TRUTH}
