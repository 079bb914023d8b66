# SPDX-License-Identifier: MIT
"""Plant from the log of a gearbox control: values, bands, files, refusals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit

from drivetwin.calibration.objective import CalibrationSettings
from drivetwin.cli import main
from drivetwin.files.twin_file import load_twin
from drivetwin.likelihood.point import ParameterVector
from drivetwin.tcu.card import load_controller_card
from drivetwin.tcu.log import read_controller_log
from drivetwin.tcu.plant import build_term
from drivetwin.tcu.problem import build_problem
from drivetwin.tcu.synthesize import make_log
from drivetwin.tcu.unknowns import Stated, list_common
from drivetwin.twin.twin import build_nominal_shift
from tests.calibration.cases import QUICK

SHIFTS = 9
BESIDE = {"torque_delay": ("torque_dead_time", "torque_lag")}
"""Quantities that are sums of numbers of the truth."""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a log, its card, its truth, and in `out` the results of `identify`."""
    folder = tmp_path_factory.mktemp("tcu")
    texts = make_log(3, SHIFTS)
    (folder / "log.csv").write_text(texts.log, encoding="utf-8")
    (folder / "card.toml").write_text(texts.card, encoding="utf-8")
    (folder / "truth.json").write_text(texts.truth, encoding="utf-8")
    card = str(folder / "card.toml")
    command = ["identify", str(folder / "log.csv"), "--vehicle", card, "-o", str(folder / "out")]
    assert main([*command, "--strict"]) == 0
    return folder


def read_result(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "tcu.json").read_text(encoding="utf-8"))
    return found


def read_truth(folder: Path) -> dict[str, float]:
    found: dict[str, float] = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    return found


def test_stated_values_contain_the_truth(made: Path) -> None:
    found = read_result(made / "out")["parameters"]
    truth = read_truth(made)
    names = {name: BESIDE.get(name, (name,)) for name in found}
    known = {
        name: sum(truth[one] for one in of) * (1e5 if name.endswith(".P0") else 1.0)
        for name, of in names.items()
        if set(of) <= set(truth)
    }
    stated = [one for one in known if found[one]["verdict"] in ("identified", "weak")]
    apart = [(found[one]["value"] - known[one]) / found[one]["std_noise"] for one in stated]
    assert len(stated) > 12
    assert np.mean(np.abs(apart) < 1.96) > 0.9
    assert np.max(np.abs(apart)) < 3.0
    known_scale = truth["torque_scale"] / truth["J_vehicle"]
    assert found["torque_scale/J_vehicle"]["value"] == pytest.approx(known_scale, rel=0.1)
    assert found["torque_scale/J_vehicle"]["verdict"] == "identified"


def test_the_twin_of_a_kind_of_shift_is_exported_and_calibrated(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(CalibrationSettings, "scale_effort", lambda *_: QUICK)
    source, truth = made / "out" / "shift_2-3.toml", read_truth(made)
    twin = load_twin(source)
    model = twin.build_dual_clutch(build_nominal_shift(twin, ("2", "3")))
    card = load_controller_card(made / "card.toml")
    held = [model.get_overall_ratio(one.name) for one in model.elements]
    assert held == pytest.approx([card.ratios["2"], card.ratios["3"]])
    oncoming = model.elements[1]
    lever = card.levers[frozenset(("2", "3"))][oncoming.name]
    assert oncoming.i_c == pytest.approx(1.0 / lever)
    kiss = 1e5 * truth[f"{oncoming.name}.P0"]
    assert pytest.approx(kiss, rel=0.1) == oncoming.P0
    torque = oncoming.gain * oncoming.friction.evaluate(np.array([50.0]))[0] * 1e5
    friction = 1.0 + 50.0 * truth[f"{oncoming.name}.slope"]
    assert torque == pytest.approx(truth[f"{oncoming.name}.gain"] * friction, rel=0.1)
    assert twin.covariance is not None
    assert np.linalg.eigvalsh(twin.covariance)[0] > -1e-6 * np.trace(twin.covariance)
    assert main(["export", str(source), "--to", "c", "-o", str(tmp_path / "c")]) == 0
    command = ["calibrate", str(source), "--shift", "2-3", "-o", str(tmp_path / "cal")]
    assert main([*command, "--draws", "60"]) == 0


@pytest.mark.parametrize("number", ["drop", "dead_time", "fill_time"])
def test_what_other_numbers_take_up_has_no_value(made: Path, number: str) -> None:
    found = read_result(made / "out")["parameters"]
    assert found["J_drum"]["value"] is None
    assert [one["value"] for name, one in found.items() if name.endswith(f".{number}")] == [
        None
    ] * len({name.partition(".")[0] for name in found if name.endswith(".P0")})


def test_the_saved_twin_predicts_the_shift_that_was_held_out(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (held,) = read_result(made / "out")["held_out"]
    table = made / "rows.csv"
    command = ["simulate", str(made / "out"), str(made / "log.csv"), "-o", str(table)]
    assert main([*command, "--json"]) == 0
    shifts = {one["shift"]: one for one in json.loads(capsys.readouterr().out)["shifts"]}
    assert len(shifts) == SHIFTS
    again = shifts[held["shift"]]
    assert again["rms"] == pytest.approx(held["rms"], rel=1e-6)
    assert held["rms"]["input_speed"] < 3.0
    assert held["inside"]["input_speed"] > 0.9
    assert held["duration"] == pytest.approx(held["measured_duration"], abs=held["duration_band"])
    rows = np.genfromtxt(table, delimiter=",", names=True)
    there = rows[rows["shift"] == held["shift"]]
    error = there["input_speed"] - there["input_speedpredicted"]
    assert np.sqrt(np.mean(error**2)) < 3.0


def test_no_row_depends_on_the_common_factor_of_torques_and_inertias(made: Path) -> None:
    card = load_controller_card(made / "card.toml")
    shifts = read_controller_log(made / "log.csv", card).shifts[:2]
    problem, point, coordinates = build_problem(card, shifts)
    normal = problem.normal(point)
    assert normal is not None
    assert not np.any(normal.data[coordinates.scale])
    step = np.zeros(len(point.names))
    step[coordinates.scale] = np.log(1.1)
    before, after = (coordinates.to_values(point.values + one) for one in (0.0 * step, step))
    for name in ("J_vehicle", "J_engine", "torque_scale", "torque_offset", "K1.gain"):
        assert after[name] == pytest.approx(1.1 * before[name])
    for name in ("K1.P0", "K1.lag", "converter_ratio"):
        assert after[name] == before[name]
    moved = problem.prior.compute_prior_cost(point.values + step)
    grown = [one for one in coordinates.names if coordinates.stated[one].scaled]
    assert moved == pytest.approx(
        sum(
            (np.log(1.1) / coordinates.stated[one].std) ** 2
            for one in (*grown, "J_vehicle")
            if coordinates.stated[one].is_positive
        )
    )


def test_derivatives_are_those_of_the_run(made: Path) -> None:
    card = load_controller_card(made / "card.toml")
    shift = read_controller_log(made / "log.csv", card).shifts[1]
    term, _ = build_term(card, shift)
    names = tuple(one.name for one in term.plant.sought)
    point = ParameterVector(names, np.array([one.start for one in term.plant.sought]))
    found = term.linearise(point)
    assert found is not None
    residual, slopes = found
    assert residual == pytest.approx(term.evaluate(point), abs=1e-6)
    for k, one in enumerate(term.plant.sought):
        step = np.zeros(len(names))
        step[k] = 0.02 * (one.spread or 1.0)
        ends = [term.evaluate(point.replace_values(point.values + side)) for side in (step, -step)]
        assert ends[0] is not None
        assert ends[1] is not None
        expected = (ends[1] - ends[0]) / (2.0 * step[k])
        size = float(np.linalg.norm(expected))
        error = float(np.linalg.norm(slopes[:, k] - expected))
        assert error < 0.06 * size + 1e-2 / (one.spread or 1.0), one.name


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("capacity_Nms2 = [0.0043, 0.0044,", "capacity_Nms2 = [0.0043, -0.0044,"),
        ('gears = ["1", "2"]', 'gears = ["1", "3"]'),
    ],
)
def test_an_impossible_card_is_refused(
    made: Path, tmp_path: Path, old: str, new: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (made / "card.toml").read_text(encoding="utf-8")
    assert old in text
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace(old, new), encoding="utf-8")
    assert main(["identify", str(made / "log.csv"), "--vehicle", str(wrong)]) == 2
    assert "changes" in (shown := capsys.readouterr().err) or "converter" in shown


def fix(card: str, key: str, apart: float) -> str:
    """Return the card with an exact value, so many standard deviations off."""
    table = tomlkit.parse(card)
    value, std = table[key]["value"], table[key]["std"]
    table[key] = {"value": value + apart * std, "std": 0.0}
    return tomlkit.dumps(table)


@pytest.mark.statistical
@pytest.mark.timeout(300)
@pytest.mark.parametrize("wrong", ["tyre", pytest.param("J_engine_kgm2", marks=pytest.mark.short)])
def test_a_plant_that_is_not_that_of_the_log_is_not_valid_with_wrong_numbers(
    wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    texts = make_log(3, 6)
    card = texts.card if wrong == "tyre" else fix(texts.card, wrong, 2.0)
    for name, text in (("log.csv", texts.log), ("card.toml", card)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    if wrong == "tyre":
        stiff = Stated(2e5, 0.01, "N*m", scaled=True)
        usual = {**list_common(load_controller_card(tmp_path / "card.toml"))}
        usual["tyre_slip_stiffness"] = stiff
        monkeypatch.setattr("drivetwin.tcu.plant.list_common", lambda _: usual)
    vehicle = str(tmp_path / "card.toml")
    main(["identify", str(tmp_path / "log.csv"), "--vehicle", vehicle, "-o", str(tmp_path / "out")])
    found, truth = read_result(tmp_path / "out"), json.loads(texts.truth)
    names = set(truth).intersection(found["parameters"])
    stated = {one: found["parameters"][one] for one in names}
    units = {one: 1e5 if one.endswith(".P0") else 1.0 for one in names}
    far = {
        name: (one["value"] - truth[name] * units[name]) / one["std_noise"]
        for name, one in stated.items()
        if one["verdict"] == "identified"
    }
    assert found["status"] != "valid" or max(map(abs, far.values()), default=0.0) < 3.0, far
    # The number that is wrong is named, among all that it moves.
    assert (wrong == "tyre") or "contradicts the stated J_engine" in str(found)


def test_a_wrong_ratio_gives_no_value(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (made / "card.toml").read_text(encoding="utf-8")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace("ratio = 3.595", "ratio = 3.55"), encoding="utf-8")
    command = ["identify", str(made / "log.csv"), "--vehicle", str(wrong), "--strict", "--json"]
    assert main(command) == 3
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "not valid"
    stated = {one["verdict"] for one in found["parameters"].values()}
    assert stated <= {"not identifiable", "design value"}


@pytest.mark.parametrize(
    "command",
    [
        ("identify", "log.csv", "--vehicle", "card.toml", "--quick"),
        ("identify", "log.csv", "--vehicle", "card.toml", "--hold-out", "99"),
        ("simulate", "out", "log.csv", "--from-command"),
        ("calibrate", "out", "--shift", "1-2", "-o", "calibrated"),
        ("export", "out", "--to", "c", "-o", "exported"),
    ],
)
def test_what_such_a_log_or_twin_cannot_do_is_refused(
    made: Path,
    command: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(made)
    assert main(list(command)) == 2
    assert "->" in capsys.readouterr().err


def test_commands_that_ramp_are_rows_not_filling(made: Path) -> None:
    card = load_controller_card(made / "card.toml")
    log = read_controller_log(made / "log.csv", card)
    assert [one.kind for one in log.shifts] == ["1-2", "2-3", "3-4"] * (SHIFTS // 3)
    assert not log.left_out
    assert all(np.allclose(np.diff(one.time), 0.02) for one in log.shifts)


def test_the_same_seed_gives_the_same_log(tmp_path: Path) -> None:
    for name in ("a", "b"):
        path = str(tmp_path / name / "x.csv")
        assert main(["synth", "--scenario", "controller_log", "--seed", "2", "-o", path]) == 0
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()
