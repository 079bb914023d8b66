# SPDX-License-Identifier: MIT
"""A twin, exported by the program with a measured shift, does what `drivetwin simulate` does."""

from __future__ import annotations

import json
import zipfile
from itertools import pairwise
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from drivetwin.cli import main
from drivetwin.export.compiler import detect_platform
from drivetwin.files.twin_file import load_twin
from drivetwin.logs.read import read_log
from drivetwin.vehicle.card import load_card

ROOT = Path(__file__).resolve().parents[2]
STIMULUS = "extra/org.fmi-standard.fmi-ls-ref/measured_shift-in.csv"
INPUTS = ["engine_torque", "B2.pressure", "B3.pressure"]


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A log with noise, and the twin that an identification of it gives."""
    folder = tmp_path_factory.mktemp("identified")
    log = folder / "shift.csv"
    assert main(["synth", "-o", str(log)]) == 0
    card, out = str(log.with_suffix(".card.toml")), str(folder / "out")
    assert main(["identify", str(log), "--vehicle", card, "--quick", "-o", out]) == 0
    return log, folder / "out" / "twin.toml"


def simulated(log: Path, twin: Path, path: Path, kind: str) -> np.ndarray:
    """Time and simulated columns of `drivetwin simulate` at 1 ms steps."""
    return traces([str(twin), str(log), "--step", "0.001", "--input", kind], path)


def stimulus_of(path: Path) -> np.ndarray:
    with zipfile.ZipFile(path) as archive:
        text = archive.read(STIMULUS).decode().splitlines()
    return np.genfromtxt(text, delimiter=",", skip_header=1)


def same(reported: np.ndarray, expected: np.ndarray) -> bool:
    """Within 1e-9 of the largest value of every column."""
    largest = np.abs(expected).max(axis=0)
    return bool((np.abs(reported - expected).max(axis=0) < 1e-9 * largest).all())


@pytest.mark.skipif(detect_platform() is None, reason="FMI names no platform like this one")
def test_fmu_3_with_the_log_as_input_is_simulate_with_held_inputs(
    identified: tuple[Path, Path], tmp_path: Path
) -> None:
    log, twin = identified
    path = tmp_path / "shift.fmu"
    assert main(["export", str(twin), "--to", "fmu", "--fmi", "3.0", "--log", str(log),
                 "-o", str(path)]) == 0  # fmt: skip
    stimulus = stimulus_of(path)
    signals = np.array(
        [tuple(row) for row in stimulus], [(name, float) for name in ("time", *INPUTS)]
    )
    reported = fmpy.simulate_fmu(
        str(path),
        output_interval=1e-3,
        input=signals,
        output=["output_torque", "engine_speed", "output_speed"],
    )
    expected = simulated(log, twin, tmp_path / "hold.csv", "hold")
    columns = np.column_stack(
        [
            reported["time"],
            reported["output_torque"],
            reported["engine_speed"],
            reported["output_speed"],
        ]
    )
    assert same(columns, expected)


@pytest.mark.skipif(detect_platform() is None, reason="FMI names no platform like this one")
def test_fmu_2_with_input_rates_is_simulate_with_linear_inputs(
    identified: tuple[Path, Path], tmp_path: Path
) -> None:
    log, twin = identified
    path = tmp_path / "shift.fmu"
    assert main(["export", str(twin), "--to", "fmu", "--log", str(log), "-o", str(path)]) == 0
    stimulus = stimulus_of(path)
    description = fmpy.read_model_description(str(path))
    fmu = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="shift",
    )
    number = {one.name: one.valueReference for one in description.modelVariables}
    inputs = [number[name] for name in INPUTS]
    outputs = [number[name] for name in ("output_torque", "engine_speed", "output_speed")]
    fmu.instantiate()
    fmu.setupExperiment(startTime=stimulus[0, 0])
    fmu.enterInitializationMode()
    fmu.setReal(inputs, stimulus[0, 1:].tolist())
    fmu.exitInitializationMode()
    rows = [fmu.getReal(outputs)]
    for now, after in pairwise(stimulus):
        h = after[0] - now[0]
        fmu.setReal(inputs, now[1:].tolist())
        fmu.setRealInputDerivatives(inputs, [1, 1, 1], ((after - now)[1:] / h).tolist())
        fmu.doStep(now[0], h)
        rows.append(fmu.getReal(outputs))
    fmu.freeInstance()
    expected = simulated(log, twin, tmp_path / "linear.csv", "linear")
    assert same(np.column_stack([stimulus[:, 0], np.array(rows)]), expected)


def test_c_sources_and_what_is_refused(
    identified: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, twin = identified
    folder = tmp_path / "c"
    capsys.readouterr()
    assert main(["export", str(twin), "--to", "c", "--log", str(log), "-o", str(folder),
                 "--json"]) == 0  # fmt: skip
    assert json.loads(capsys.readouterr().out)["file"] == str(folder)
    assert "dt_twin_params" in (folder / "dt_twin.c").read_text("utf-8")
    for bad, reported in (("2", "does not name two gears"), ("2-7", "no gear '7'")):
        target = str(tmp_path / "other")
        assert main(["export", str(twin), "--to", "c", "--shift", bad, "-o", target]) == 2
        assert reported in capsys.readouterr().err
    assert not (tmp_path / "other").exists()
    arguments = ["export", str(twin), "--to", "c", "--shift", "3-2", "--log", str(log)]
    assert main([*arguments, "-o", str(tmp_path / "other")]) == 2
    assert "no shift 3-2" in capsys.readouterr().err


def traces(arguments: list[str], path: Path) -> np.ndarray:
    """Time and simulated columns of `drivetwin simulate`: torque, speeds of input and output."""
    assert main(["simulate", *arguments, "-o", str(path)]) == 0
    head = path.read_text().splitlines()[0].split(",")
    signals = ("output_torque", "input_speed", "output_speed")
    places = [0, *(head.index(f"{name}_simulated") for name in signals)]
    return np.genfromtxt(path, delimiter=",", skip_header=2)[:, places]


def test_an_edited_parameter_file_drives_the_simulation(
    identified: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, twin = identified
    exported = tmp_path / "twin.dcm"
    assert main(["export", str(twin), "--to", "dcm", "-o", str(exported)]) == 0
    given = [str(twin), str(log), "--parameters", str(exported)]
    plain = traces([str(twin), str(log)], tmp_path / "plain.csv")
    assert (traces(given, tmp_path / "same.csv") == plain).all()
    lines = exported.read_text("ascii").splitlines()
    for name, value in (("k_o", 9e4), ("f_d_3", 5.0)):
        place = lines.index(f"FESTWERT {name}") + 4
        assert lines[place].startswith("  WERT ")
        lines[place] = f"  WERT {value}"
    lines += ["TEXTSTRING remark", '  TEXT "softer shaft"', "END"]
    exported.write_text("\n".join(lines), "ascii")
    capsys.readouterr()
    softer = traces(given, tmp_path / "softer.csv")
    reported = capsys.readouterr().err
    assert "twin.dcm changes k_o\n" in reported
    assert "no simulation depends on f_d_3\n" in reported
    assert "neither number nor curve: TEXTSTRING remark\n" in reported
    assert np.abs(softer[:, 1] - plain[:, 1]).max() > 50.0


def test_a_parameter_file_under_other_labels_is_refused_without_its_template(
    identified: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, twin = identified
    template, exported = tmp_path / "labels.toml", tmp_path / "own.dcm"
    template.write_text('[parameters.k_o]\nlabel = "Drv_cShaft"\n')
    options = ["--template", str(template)]
    assert main(["export", str(twin), "--to", "dcm", *options, "-o", str(exported)]) == 0
    given = ["simulate", str(twin), str(log), "--parameters", str(exported)]
    assert main([*given, *options]) == 0
    capsys.readouterr()
    assert main(given) == 2
    reported = capsys.readouterr().err
    assert "no entry is a parameter of the twin: Drv_cShaft" in reported
    assert "give the --template" in reported


def test_a_modelica_package_holds_the_shift_of_the_log(
    identified: tuple[Path, Path], tmp_path: Path
) -> None:
    log, twin = identified
    path = tmp_path / "shift.mo"
    arguments = ["--to", "modelica", "--log", str(log), "-o", str(path)]
    assert main(["export", str(twin), *arguments]) == 0
    text = path.read_text("utf-8")
    assert "model Shift" in text
    assert "w_rel = 0;" in text
    assert text.count(";\n      ") > 1000


def test_written_inputs_are_those_of_the_log_at_the_instants_they_act(
    identified: tuple[Path, Path], tmp_path: Path
) -> None:
    log, twin = identified
    to, path = tmp_path / "tcu", tmp_path / "in.csv"
    assert main(["export", str(twin), "--to", "c", "--log", str(log), "--inputs", str(path),
                 "-o", str(to)]) == 0  # fmt: skip
    table = np.genfromtxt(path, delimiter=",", names=True, deletechars="")
    assert list(table.dtype.names or ()) == ["time", *INPUTS]
    known = load_twin(twin)
    delay, card = known.parameters["te_delay"].value, load_card(log.with_suffix(".card.toml"))
    assert delay is not None
    torque = read_log(log, card)["engine_torque"].updates
    acting = np.interp(table["time"], torque.time - delay, torque.values)
    assert table["engine_torque"] == pytest.approx(acting, abs=1e-6 * np.abs(acting).max())
    assert f"advance the logged signal by {delay:.5g} s" in (to / "dt_twin.c").read_text()


def test_inputs_without_a_log_are_refused(identified: tuple[Path, Path], tmp_path: Path) -> None:
    arguments = ["export", str(identified[1]), "--to", "c", "-o", str(tmp_path / "tcu")]
    assert main([*arguments, "--inputs", str(tmp_path / "in.csv")]) == 2
