# SPDX-License-Identifier: MIT
"""`result.json`: content as documented, strict JSON, written whole, newer schemas refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from pydantic import ValidationError

from drivetwin.errors import ResultFileError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.files.result_file import ResultFile, load_result, save_result
from drivetwin.likelihood.output import SignalFit
from tests.report.sample import identification


def _saved(folder: Path) -> dict[str, object]:
    save_result(folder / "result.json", identification())
    tree = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert isinstance(tree, dict)
    return tree


def test_keys_are_those_of_the_design(tmp_path: Path) -> None:
    tree = _saved(tmp_path)
    assert tree["schema"] == "drivetwin/result-5"
    parameters = tree["parameters"]
    assert isinstance(parameters, dict)
    assert set(parameters["eta"]) == {
        "value",
        "unit",
        "std_noise",
        "ci95",
        "std_total",
        "ci95_total",
        "verdict",
        "method",
        "reason",
    }
    assert parameters["te_delay"]["value"] is None
    shifts = tree["shifts"]
    assert isinstance(shifts, list)
    assert (shifts[0]["from"], shifts[0]["to"]) == ("2", "3")
    assert shifts[0]["torque_phase"] == [1.0, 1.2]
    friction = tree["friction"]
    assert isinstance(friction, dict)
    assert set(friction["B3"]) >= {"slip", "mu", "mu_lo", "mu_hi"}


def test_total_interval_holds_the_noise_interval(tmp_path: Path) -> None:
    parameters = _saved(tmp_path)["parameters"]
    assert isinstance(parameters, dict)
    for one in parameters.values():
        if one["value"] is not None:
            assert one["ci95_total"][0] <= one["ci95"][0] <= one["value"]
            assert one["value"] <= one["ci95"][1] <= one["ci95_total"][1]


def test_not_a_number_never_reaches_json() -> None:
    empty_phase = SignalFit(float("nan"), float("nan"))
    found = replace(identification(), fit={"output_torque": {"torque": empty_phase}})
    text = ResultFile.from_result(found).to_json()
    assert "NaN" not in text
    tree = json.loads(text)
    assert tree["fit"]["output_torque"]["torque"] == {"rmse": None, "fit_percent": None}
    assert tree["settings"]["limit"] is None


def test_a_value_that_cannot_be_told_is_never_a_bare_number() -> None:
    found = identification()
    bare = replace(found.estimates["eta"], verdict=Verdict.NOT_IDENTIFIABLE)
    with pytest.raises(ValidationError, match="not identifiable"):
        ResultFile.from_result(replace(found, estimates={"eta": bare}))


def test_round_trip(tmp_path: Path) -> None:
    found = identification()
    save_result(tmp_path / "result.json", found)
    back = load_result(tmp_path / "result.json")
    assert back == ResultFile.from_result(found)
    assert back.parameters["k_o"].to_estimate("k_o").std_total == pytest.approx(
        found.estimates["k_o"].std_total
    )


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "cannot be read"),
        ("[1, 2]", "cannot be read"),
        ("{}", "schema is None"),
        ('{"schema": "drivetwin/result-5"}', "newer"),
        (f'{{"schema": "drivetwin/result-{5_000 * "9"}"}}', "schema is 'drivetwin/result-9"),
        ('{"schema": "drivetwin/twin-1"}', "expected 'drivetwin/result-5'"),
        ('{"schema": "drivetwin/result-1"}', "shifts: this key is required and missing"),
    ],
)
def test_damaged_or_newer_files_are_refused(tmp_path: Path, content: str, says: str) -> None:
    path = tmp_path / "result.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ResultFileError, match=says):
        load_result(path)
