# SPDX-License-Identifier: MIT
"""The dual-clutch reference problems on a 1 ms grid, as an exported model gets them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from drivetwin.export.c import write_c
from drivetwin.export.compiler import detect_platform
from drivetwin.export.entries import InputDelays, Subject, compute_steady_start, run_fixed_step
from drivetwin.export.fmu.build import Experiment
from drivetwin.export.modelica.model import write_modelica
from drivetwin.export.targets import InputKind
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
    Trajectory,
)
from reference.dual_clutch_upshift.problem import DAMPING, FINAL_DRIVE, START, STIFFNESS, WET
from reference.problem import ROOT, load
from reference.tables import read
from tests.support.arrays import FloatArray

SHARED = Path(__file__).resolve().parents[3] / "shared" / "reference"
STEP = 1e-3
HAS_PLATFORM_OF_FMI = detect_platform() is not None
ON_A_PLATFORM_OF_FMI = pytest.mark.skipif(
    not HAS_PLATFORM_OF_FMI, reason="FMI names no platform like this one"
)


def run_core(
    model: DualClutch,
    start: State,
    time: FloatArray,
    inputs: FloatArray,
    kind: InputKind = InputKind.LINEAR,
    delays: InputDelays | None = None,
) -> Trajectory:
    """Run the core as importers with fixed steps do; `inputs` (n, 3)."""
    return run_fixed_step(model, start, time, inputs, kind, delays or InputDelays())


def write_model(subject: Subject, experiment: Experiment | None = None) -> str:
    """Write the Modelica package of a subject and return its text."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.mo"
        write_modelica(subject, experiment, path)
        return path.read_text("utf-8")


def write_source(subject: Subject) -> str:
    """Write the C sources and return the text of the file of the twin."""
    with TemporaryDirectory() as folder:
        write_c(subject, Path(folder))
        return (Path(folder) / "dt_twin.c").read_text("utf-8")


@dataclass(frozen=True)
class Case:
    """A model with its inputs (n, 3) at `time` (n,), and the tight reference of the shaft torque.

    `reference` (m,) [N m] holds at `reference_time` (m,), which are points of `time`.
    """

    subject: Subject
    time: FloatArray
    inputs: FloatArray
    reference_time: FloatArray
    reference: FloatArray

    def deviation(self, output_torque: FloatArray) -> float:
        """Largest difference of a shaft torque (n,) on `time` from the reference [N m]."""
        rows = np.round((self.reference_time - self.time[0]) / STEP).astype(int)
        return float(np.abs(output_torque[rows] - self.reference).max())


def paper_model() -> DualClutch:
    """The driveline of the paper."""
    elements = tuple(
        ShiftElement(name, i - 1.0, i / (i - 1.0), gain, 80e3, Stribeck(**WET))
        for name, i, gain in (("B2", 1.91, 0.0378), ("B3", 1.43, 0.027))
    )
    load_torque = RoadLoad(2300.0 * FINAL_DRIVE)
    return DualClutch(
        20.3, 0.0, 0.85, "paper", 1.0, 0.9, FINAL_DRIVE, 6056.0, STIFFNESS, DAMPING, load_torque,
        elements,
    )  # fmt: skip


def paper_subject() -> Subject:
    """The driveline of the paper, steady in its lower gear."""
    model = paper_model()
    return Subject("paper 2-3", model, compute_steady_start(model, "B2", 178.0), "published values")


def own(name: str) -> Case:
    """A dual-clutch problem of the folder `reference`."""
    problem = load(name)
    (phase,) = problem.phases
    time = np.linspace(0.0, phase.end, round(phase.end / STEP) + 1)
    signals = [phase.inputs[key] for key in ("torque", "B2", "B3")]
    columns = [np.interp(time, s.time, s.values) for s in signals if isinstance(s, Signal)]
    speeds = START.speeds
    start = State(
        speeds["engine"], speeds["output"], speeds["wheel"], START.twists["shaft"], ("B2",)
    )
    table = read(ROOT / name).table
    return Case(
        Subject(name, paper_model(), start),
        time,
        np.column_stack(columns),
        table.time,
        table.columns["shaft_torque", "shaft"],
    )


def given(name: str) -> Case:
    """A problem that stands beside the checkout; the test is skipped where it does not."""
    if not SHARED.is_dir():
        pytest.skip("the solver references are not beside this checkout")
    case = json.loads((SHARED / f"{name}.json").read_text())
    rows = np.genfromtxt(SHARED / f"{name}.csv", delimiter=",", names=True)
    d, start = case["driveline"], case["initial"]
    elements = tuple(
        ShiftElement(
            f"B{k}",
            c["i_c"],
            c["i_out"],
            c["gain_m3"],
            c["P0_Pa"],
            Stribeck(c["mu_c"], c["mu_s"], c["v_s"], c["mu_v"]),
            drum_inertia=c["drum_inertia"],
        )
        for k, c in zip((2, 3), case["clutches"], strict=True)
    )
    model = replace(
        paper_model(),
        J1=d["J1"],
        J2e=d["J2_at_engine"],
        eta=d["eta"],
        i_in=d["i_in"],
        J_out=d["J_out"],
        i_f=d["i_f"],
        J_v=d["J_v"],
        k_o=d["k_o"],
        c_o=d["c_o"],
        load=RoadLoad(d["T_v_over_i_f"] * d["i_f"]),
        elements=elements,
    )
    speeds = (start["omega_e"], start["omega_out"], start["omega_w"])
    return Case(
        Subject(name, model, State(*speeds, start["twist"], ("B2",))),
        rows["time_s"],
        np.column_stack([rows[key] for key in ("T_e_Nm", "P_2_Pa", "P_3_Pa")]),
        rows["time_s"],
        rows["T_o_Nm"],
    )


_OWN = ("dual_clutch_upshift", "tie_up")
_GIVEN = ("dual_clutch_upshift", "dual_clutch_drum_inertia", "dual_clutch_weak_then_catch")
CASES: dict[str, Callable[[], Case]] = {
    **{name: partial(own, name) for name in _OWN},
    **{f"given_{name}": partial(given, name) for name in _GIVEN},
}
