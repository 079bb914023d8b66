# SPDX-License-Identifier: MIT
"""Exported models, fed with written inputs or with a log as it is, are as good as `simulate`."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import fmpy
import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli import main
from drivetwin.export.compiler import detect_platform
from drivetwin.export.entries import run_fixed_step
from drivetwin.export.fmu.build import Experiment, build_measured_subject
from drivetwin.export.modelica.model import write_modelica
from drivetwin.export.targets import InputKind
from drivetwin.files.twin_file import load_twin
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.simulation.dual_clutch import State
from tests.export.modelica import compiled
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
GIVEN = {
    "paper_like": (SHARED / "logs/paper_like.csv", ROOT / "examples/vehicles/paper_like.toml"),
    "truck_a": (SHARED / "logs/truck_a.csv", ROOT / "examples/vehicles/truck_a.toml"),
    "ctl_1": (SHARED / "cases/mismatch/ctl_1.csv", SHARED / "cases/mismatch/ctl_1.toml"),
}
LOGS = ["synthetic", *(pytest.param(name, marks=pytest.mark.howto) for name in GIVEN)]
INPUTS = ("engine_torque", "B2.pressure", "B3.pressure")
WORSE = 1.05
"""Largest rms error of the output torque, relative to that of `drivetwin simulate`."""


@dataclass(frozen=True, eq=False)
class Known:
    """A log with its twin, and the table of `drivetwin simulate` (time, measured, simulated)."""

    log: Path
    twin: Path
    table: FloatArray

    def read_log(self) -> ShiftLog:
        """The log, read with the twin's card."""
        return read_log(self.log, load_twin(self.twin).build_card())

    def compare(self, time: FloatArray, torque: FloatArray, lag: float) -> float:
        """Rms error of `torque` (late by `lag` [s]) at `time`, relative to that of `simulate`."""
        at, measured, simulated = self.table
        inside = (at >= time[0] - lag) & (at <= time[-1] - lag)
        assert np.count_nonzero(inside) > 500
        exported = np.interp(at, time - lag, torque)
        errors = (exported - measured)[inside], (simulated - measured)[inside]
        ours, theirs = (float(np.sqrt(np.mean(one**2))) for one in errors)
        print(f"{self.log.name}: {ours:.3f} N·m, simulate {theirs:.3f} N·m, lag {lag:.5f} s")
        return ours / theirs


@cache
def identify(name: str) -> Known:
    """Identify a log and simulate it."""
    folder = Path(mkdtemp(prefix="logged-inputs-"))
    if name == "synthetic":
        log, card = folder / "shift.csv", folder / "shift.card.toml"
        assert main(["synth", "-o", str(log)]) == 0
    else:
        log, card = GIVEN[name]
        if not log.exists():
            pytest.skip("the shared logs are not beside this checkout")
    arguments = ["--vehicle", str(card), "--quick", "-o", str(folder / "out")]
    assert main(["identify", str(log), *arguments]) == 0
    twin, to = folder / "out/twin.toml", folder / "simulated.csv"
    assert main(["simulate", str(twin), str(log), "-o", str(to)]) == 0
    head = to.read_text("utf-8").splitlines()[0].split(",")
    table = np.genfromtxt(to, delimiter=",", skip_header=2).T
    names = ("time", "output_torque_measured", "output_torque_simulated")
    return Known(log, twin, table[[head.index(one) for one in names]])


def export(known: Known, to: str, path: Path, *options: str) -> FloatArray:
    """Run `drivetwin export`; return the written inputs, columns time and INPUTS."""
    written = path.with_name("in.csv")
    arguments = ["--to", to, "--log", str(known.log), "--inputs", str(written), *options]
    assert main(["export", str(known.twin), *arguments, "-o", str(path)]) == 0
    return np.genfromtxt(written, delimiter=",", skip_header=1)


def list_logged(known: Known, time: FloatArray) -> FloatArray:
    """The log's own samples within `time`, columns time and INPUTS."""
    log = known.read_log()
    channels = [log["engine_torque"], *(log.get_pressure(name) for name in ("B2", "B3"))]
    own = channels[0].time
    own = own[(own > time[0]) & (own < time[-1])]
    stamps = np.concatenate((time[:1], own, time[-1:]))
    return np.column_stack((stamps, *(np.interp(stamps, one.time, one.values) for one in channels)))


def get_lag(known: Known) -> float:
    """Lag [s] of the model: age of the engine torque message and half its interval of 10 ms."""
    return load_twin(known.twin).get_value("te_delay", 0.0) + 0.005


def run_fmu(path: Path, inputs: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Time and output torque by FMPy, which holds inputs over a step."""
    dtype = [(name, float) for name in ("time", *INPUTS)]
    reported = fmpy.simulate_fmu(
        str(path),
        start_time=inputs[0, 0],
        stop_time=inputs[-1, 0],
        output_interval=step,
        use_event_mode=False,
        input=np.array([tuple(row) for row in inputs.tolist()], dtype),
        output=["output_torque"],
        fmi_type="CoSimulation",
    )
    return reported["time"], reported["output_torque"]


@pytest.mark.skipif(detect_platform() is None, reason="FMI names no platform like this one")
@pytest.mark.parametrize("version", mark_repeats(["2.0", "3.0"], ["3.0"]))
@pytest.mark.parametrize("name", LOGS)
def test_fmu(name: str, version: str, tmp_path: Path) -> None:
    """Held inputs act half a step late, so those that act are given every 0.25 ms."""
    known, path = identify(name), tmp_path / "shift.fmu"
    inputs = export(known, "fmu", path, "--fmi", version)
    assert known.compare(*run_fmu(path, inputs, 2.5e-4), 0.0) < WORSE
    inputs = export(known, "fmu", path, "--fmi", version, "--as-logged")
    logged = list_logged(known, inputs[:, 0])
    assert known.compare(*run_fmu(path, logged, 1e-3), get_lag(known)) < WORSE


def run_c(folder: Path, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Time and output torque by the runner of the C sources."""
    subprocess.run(["make", "--silent", "-C", folder], check=True)
    rows = "\n".join(",".join(map(repr, row)) for row in inputs.tolist())
    done = subprocess.run(
        [folder / "dt_run"], input=rows, capture_output=True, text=True, check=True
    )
    reported = np.genfromtxt(done.stdout.splitlines(), delimiter=",", names=True)
    return reported["time"], reported["output_torque"]


@pytest.mark.parametrize("name", LOGS)
def test_c(name: str, tmp_path: Path) -> None:
    known = identify(name)
    inputs = export(known, "c", tmp_path / "acting")
    assert known.compare(*run_c(tmp_path / "acting", inputs), 0.0) < WORSE
    inputs = export(known, "c", tmp_path / "logged", "--as-logged")
    logged = list_logged(known, inputs[:, 0])
    assert known.compare(*run_c(tmp_path / "logged", logged), get_lag(known)) < WORSE


@pytest.mark.parametrize("as_logged", mark_repeats([False, True], [True]))
@pytest.mark.parametrize("name", LOGS)
def test_modelica(name: str, as_logged: bool, tmp_path: Path) -> None:
    """From the torque phase until lock-up: the compiler takes minutes for a whole log.

    The run starts from the state of the core at that instant.
    """
    known = identify(name)
    twin, log = load_twin(known.twin), known.read_log()
    subject, whole = build_measured_subject(twin, log, as_logged=as_logged)
    shift = detect_shifts(log, twin.build_card()).shifts[0]
    span = (whole.time >= shift.torque_phase[0] - 0.1) & (whole.time <= shift.lockup_time + 0.2)
    model, lag = subject.model, subject.delays.lag
    core = run_fixed_step(
        model, subject.start, whole.time, whole.inputs, InputKind.LINEAR, subject.delays
    )
    first = int(np.argmax(span))
    start = State(
        engine_speed=float(core.engine_speed[first]),
        output_speed=float(core.output_speed[first]),
        wheel_speed=float(core.wheel_speed[first]),
        twist=float(core.twist[first]),
        locked=subject.start.locked,
    )
    part = Experiment(whole.name, whole.time[span], whole.inputs[span], whole.step)
    path = tmp_path / "shift.mo"
    write_modelica(replace(subject, start=start), part, path)
    text = path.read_text("utf-8")
    path.unlink()
    reported = compiled.run(text, part.time, ("output_shaft.tau",), tmp_path, tolerance=1e-5)
    assert lag == (pytest.approx(get_lag(known)) if as_logged else 0.0)
    assert known.compare(part.time, -reported["output_shaft.tau"], lag) < WORSE


def test_a_log_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    known = identify("synthetic")
    arguments = ["--to", "c", "--as-logged", "-o", str(tmp_path / "c")]
    assert main(["export", str(known.twin), *arguments]) == 2
    assert "--as-logged has no effect without --log" in capsys.readouterr().err
