# SPDX-License-Identifier: MIT
"""`drivetwin calibrate`: its files, what it refuses, and an interrupt."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.calibration.metrics import list_outputs
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.cli import main
from drivetwin.export.parameters.files import read_parameters
from drivetwin.files.calibration_file import read_calibration_file
from drivetwin.files.twin_file import save_twin
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import simulate
from tests.calibration.twins import (
    ADDED_ELEMENTS,
    assemble,
    extend_twin,
    make_hydraulic_twin,
    make_twin,
)

FILES = {
    "calibration.toml",
    "certificate.json",
    "report.html",
    "calibration.csv",
    "calibration.dcm",
    "calibration.cdfx",
}
SHORT = ("--draws", "60", "--engine-torque", "1400")


pytestmark = pytest.mark.usefixtures("quick_search")


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("twin") / "twin.toml"
    save_twin(path, make_twin())
    return path


@pytest.fixture(scope="module")
def folder(twin: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a short calibration."""
    out = tmp_path_factory.mktemp("calibration") / "out"
    limits = out.with_name("limits.toml")
    limits.write_text("[limits]\nshift_time_s = 1.1\nmean_friction_energy_J = 90000\n")
    given = ["calibrate", str(twin), "--limits", str(limits), "-o", str(out)]  # its one shift
    assert main([*given, *SHORT]) == 0
    return out


def test_writes_all_files_with_equal_values(folder: Path) -> None:
    assert {one.name for one in folder.iterdir()} == FILES
    content = read_calibration_file(folder / "calibration.toml")
    assert content.shift == "2-3"
    assert content.limits == {
        "shift_time_s": 1.1,
        "mean_friction_energy_J": 90000.0,
        "torque_reduction_Nm": 560.0,
        "torque_rate_Nm_s": 5000.0,
        "pressure_rate_Pa_s": 15e6,
    }
    assert list(content.inputs) == ["twin.toml"]
    options = content.settings["options"]
    assert (options["draws"], options["engine torque"], options["policy"]) == (
        "60", "1400.0", "controller"
    )  # fmt: skip
    for suffix in ("csv", "dcm", "cdfx"):
        read = read_parameters(folder / f"calibration.{suffix}")
        bar = 1.0 if suffix == "csv" else 1e5
        values = {one.name: one.value * (bar if one.unit == "bar" else 1.0) for one in read.scalars}
        fine = 1e-9 if suffix == "csv" else 1e-4
        for name, one in content.parameters.items():
            assert values[name] == pytest.approx(one.value, abs=fine * (one.high - one.low))
        if suffix != "csv":  # few digits, bounds for people
            assert all(len(repr(one.value)) < 10 for one in read.scalars)
            assert read["kiss_pressure"].text.endswith(", 0.4 to 1.04")
        assert len(read.curves) == 3
        assert all(curve.axis.unit == "s" for curve in read.curves)


def test_certificate_says_draws_and_confidence(folder: Path) -> None:
    content = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
    after, before = content["after"], content["before"]
    assert (after["draws"], after["confidence"]) == (60, 0.95)
    jerk = [one["quantiles"]["peak_jerk"] for one in (before, after)]
    assert jerk[1]["share_95"] < jerk[0]["share_95"]
    assert jerk[1]["upper_99"] is None  # 60 draws do not support it
    sources = {one["metric"]: one["source"] for one in after["limits"]}
    assert sources.pop("shift_time") == sources.pop("friction_energy") == "as stated"
    assert set(sources) == {"torque_reduction", "torque_rate", "pressure_rate"}
    assert all(one.startswith("usual: ") for one in sources.values())
    assert content["metrics"]["peak_jerk"]["unit"] == "m/s^3"


def test_report_shows_limits_profiles_and_definitions(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    for text in ("Limits; the upper bound", "vibration dose value", "ISO 2631-1", "kiss_pressure"):
        assert text in page
    numbers = page.partition("Metrics over the fresh draws")[2].partition("</table>")[0]
    assert numbers
    assert not re.search(r"\de-\d\d", numbers)  # a round-off of 1e-11 rpm is no flare


def test_starts_from_a_calibration(
    folder: Path, twin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start = folder / "calibration.toml"
    given = ["calibrate", str(twin), "--shift", "2-3", "--start", str(start), "-o", str(tmp_path)]
    limits = tmp_path / "limits.toml"
    limits.write_text("[limits]\nshift_time_s = 1.2\n")
    assert main([*given, *SHORT, "--limits", str(limits), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["folder"] == str(tmp_path)
    before = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))["after"]
    assert found["certificate"]["before"]["quantiles"]["peak_jerk"]["median"] == pytest.approx(
        before["quantiles"]["peak_jerk"]["median"], rel=1e-9
    )
    assert main([*given, *SHORT, "--policy", "knots"]) == 2
    assert "policy 'controller', not 'knots'" in capsys.readouterr().err


def test_a_slip_loop_is_calibrated_behind_actuators(
    twin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, limits, out = (tmp_path / name for name in ("twin.toml", "limits.toml", "out"))
    save_twin(source, make_hydraulic_twin())
    limits.write_text("[limits]\nshift_time_s = 1.4\n[spread]\ndead_time_s = 0.002\n")
    given = ["--shift", "2-3", "--policy", "slip", "--limits", str(limits), "-o", str(out)]
    assert main(["calibrate", str(source), *given, *SHORT]) == 0
    content = read_calibration_file(out / "calibration.toml")
    assert content.policy == "slip"
    assert content.spread.dead_time == 0.002
    assert "integral_gain" in content.parameters
    assert "are commands of the controller" in (out / "calibration.toml").read_text()
    assert "of the nominal unit" in (out / "report.html").read_text(encoding="utf-8")
    notes = (out / "calibration.csv").read_text(encoding="utf-8")
    assert "commands of the controller" in notes
    assert main(["calibrate", str(twin), *given, *SHORT]) == 2
    assert "no actuator of B2 and B3" in capsys.readouterr().err


@pytest.mark.parametrize("part", ["input shaft", "backlash"])
def test_a_twin_with_a_part_is_calibrated_with_it(part: str, tmp_path: Path) -> None:
    """Without spread all draws are the nominal network, here put together by hand."""
    source, limits, out = (tmp_path / name for name in ("twin.toml", "limits.toml", "out"))
    friction = {
        name: replace(one, mu_lo=one.mu, mu_hi=one.mu) for name, one in make_twin().friction.items()
    }
    exact = replace(make_twin(), covariance_ids=(), covariance=None, friction=friction)
    twin = replace(exact, parameters=extend_twin(make_twin(), ADDED_ELEMENTS[part]).parameters)
    save_twin(source, twin)
    names = ("gain", "engine_torque", "contact_pressure_Pa", "oil_temperature_K")
    spread = "".join(f"{name} = 0.0\n" for name in names)
    limits.write_text(f"[limits]\nshift_time_s = 1.4\n[spread]\n{spread}")
    given = ["--shift", "2-3", "--limits", str(limits), "-o", str(out)]
    assert main(["calibrate", str(source), *given, *SHORT]) == 0
    curves = read_parameters(out / "calibration.csv").curves
    request = Request(gears=("2", "3"), engine_torque=1400.0, limits=())
    shift = build_task(twin, request).maneuver
    after = shift.time - shift.request
    inputs = {
        name: Signal(shift.time, np.interp(after, one.axis.points, one.values))
        for name, one in zip(("engine torque", "B2", "B3"), curves, strict=True)
    }
    start, outputs = shift.start, list_outputs(shift)
    run = simulate(assemble(shift, ADDED_ELEMENTS[part]), inputs, start, shift.time, outputs)
    torque, old, old_slip, new, new_slip = run.columns.values()
    jerk = np.gradient(0.5 * shift.model.i_f / shift.model.J_v * torque, shift.step)
    lock = [one.time for one in run.events if one.kind == "lock"][-1] - shift.request
    energy = shift.step * np.sum(np.abs(old * old_slip) + np.abs(new * new_slip))
    certificate = json.loads((out / "certificate.json").read_text(encoding="utf-8"))["after"]
    expected = {"peak_jerk": np.abs(jerk).max(), "shift_time": lock, "friction_energy": energy}
    for metric, value in expected.items():
        assert certificate["quantiles"][metric]["median"] == pytest.approx(value, rel=1e-3)
        assert certificate["quantiles"][metric]["worst"] == pytest.approx(value, rel=1e-3)


def test_with_limits_out_of_reach_the_best_calibration_is_written(
    twin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    limits = tmp_path / "limits.toml"
    limits.write_text("[limits]\nshift_time_s = 0.05\n")
    out = tmp_path / "out"
    given = ["calibrate", str(twin), "--shift", "2-3", "--limits", str(limits), "-o", str(out)]
    assert main([*given, *SHORT]) == 2
    error = capsys.readouterr().err
    assert "limit 0.05" in error
    assert "raise the limit of the shift time" in error
    assert {one.name for one in out.iterdir()} == FILES
    assert "exceeded, binds" in (out / "report.html").read_text(encoding="utf-8")
    assert main([*given, *SHORT, "--json"]) == 2
    found = json.loads(capsys.readouterr().out)
    assert found["error"]["type"] == "InfeasibleError"
    assert found["certificate"]["after"]["limits"][0]["state"] == "exceeded"


def test_front_and_map_are_in_the_files(
    twin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    limits = tmp_path / "limits.toml"
    limits.write_text("[limits]\nshift_time_s = 1.2\n")
    out = tmp_path / "out"
    given = ["calibrate", str(twin), "--shift", "2-3", "--limits", str(limits), "-o", str(out)]
    grid = "torque=1200:1400:2,speed=1600:1800:2"
    assert main([*given, "--draws", "60", "--front", "--map", grid, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    content = read_calibration_file(out / "calibration.toml")
    assert [one.model_dump(mode="json") for one in content.front] == found["front"]
    assert [one.model_dump(mode="json") for one in content.map] == found["map"]
    assert len(content.map) == 4
    assert {one.engine_torque_Nm for one in content.map} == {1200.0, 1400.0}
    assert content.point.engine_torque_Nm == 1400.0
    (main_point,) = [
        one
        for one in content.map
        if one.engine_torque_Nm == 1400.0 and one.engine_speed_rad_s > 180.0
    ]
    assert main_point.parameters == {n: one.value for n, one in content.parameters.items()}
    for suffix in ("csv", "dcm", "cdfx"):
        curves = {one.name: one for one in read_parameters(out / f"calibration.{suffix}").curves}
        assert len(curves) == 3 + 2 * len(content.parameters)
        (kiss,) = (one for name, one in curves.items() if "kiss_pressure.1200" in name)
        rpm, bar = (math.pi / 30, 1.0) if suffix == "csv" else (1.0, 1e-5)
        assert kiss.axis.points == pytest.approx((1600 * rpm, 1800 * rpm))
        expected = [one.parameters["kiss_pressure"] * bar for one in content.map[:2]]
        rounding = 0.0 if suffix == "csv" else 5e-6  # of labels, 1e-5 bar
        assert kiss.values == pytest.approx(expected, abs=rounding)
    times = [one.shift_time_s for one in content.front]
    assert times == sorted(times)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Comfort, energy and time" in page
    assert "Map over the operating points" in page


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--shift", "2-3", "--map", "torque=1:2,speed=3"), "no grid of operating points"),
        (("--shift", "2-3", "--map", "torque=nan:2:3,speed=1:2:2"), "no grid of operating points"),
        (("--shift", "2-3", "--map", "torque=1:2:1,speed=1:2:2"), "at least two that increase"),
        (
            ("--shift", "2-3", "--map", "torque=1:2:2,speed=1:2:2", "--engine-speed", "900"),
            "leave out --engine-torque and --engine-speed",
        ),
        (("--shift", "2"), "does not name two gears"),
        (("--shift", "2-7"), "has no gear '7'"),
        (("--shift", "2-3", "--system-pressure", "2"), "system pressure is 2.00 bar"),
        (("--shift", "2-3", "--system-pressure", "1400"), "less than or equal to 100"),
        (("--shift", "2-3", "--wheel-radius", "318"), "less than or equal to 2"),
    ],
)
def test_refusals(
    twin: Path,
    tmp_path: Path,
    options: tuple[str, ...],
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["calibrate", str(twin), "-o", str(tmp_path / "out"), *options]) == 2
    assert said in capsys.readouterr().err


def _exceeds_usual(folder: Path) -> bool:
    """Return whether a result lies beyond the usual torque or pressure rate."""
    metrics = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))["after"][
        "quantiles"
    ]
    rates = (("torque_rate", 5e3), ("pressure_rate", 15e6), ("torque_reduction", 560.0))
    return any(metrics[name]["share_95"] > usual for name, usual in rates)


def test_own_bounds_limits_and_labels_are_kept(twin: Path, tmp_path: Path) -> None:
    limits, template, out = (tmp_path / name for name in ("limits.toml", "own.toml", "out"))
    limits.write_text(
        "[limits]\ntorque_reduction_Nm = 400\npressure_rate_Pa_s = 3e7\n"
        "[hardware]\ntorque_rate_Nm_s = inf\n"
        "[bounds]\nreduction_depth = [0, 300]\nfill_time = 0.1\n"
    )
    template.write_text(
        '[parameters.kiss_pressure]\nlabel = "Clt_pKiss_C"\nunit = "bar"\n'
        '[parameters."profile.engine_torque"]\nlabel = "Eng_tq_CUR"\n'
        'axis = { name = "Shf_ti", unit = "ms", points = [0, 400, 800], beyond = "hold" }\n'
    )
    given = ["--shift", "2-3", "--limits", str(limits), "--template", str(template)]
    assert main(["calibrate", str(twin), *given, *SHORT, "-o", str(out)]) == 0
    result = read_calibration_file(out / "calibration.toml")
    assert set(result.limits) == {"torque_reduction_Nm", "pressure_rate_Pa_s"}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert ("Outside usual hardware: " in page) == _exceeds_usual(out)
    found = result.parameters
    assert found["reduction_depth"].value <= 300.0
    assert found["fill_time"].value == 0.1
    after = json.loads((out / "certificate.json").read_text(encoding="utf-8"))["after"]
    metrics = after["quantiles"]
    assert metrics["torque_reduction"]["worst"] == pytest.approx(found["reduction_depth"].value)
    assert 0.0 < metrics["pressure_rate"]["worst"] <= 3e7
    for ending in ("csv", "dcm", "cdfx"):
        content = read_parameters(out / f"calibration.{ending}")
        assert {one.name for one in content.entries} == {"Clt_pKiss_C", "Eng_tq_CUR"}
        (curve,) = content.curves
        assert curve.axis.points == (0.0, 400.0, 800.0)
        (kiss,) = content.scalars
        assert kiss.value == pytest.approx(found["kiss_pressure"].value / 1e5, abs=5e-6)
