# SPDX-License-Identifier: MIT
"""Files of an earlier version, written before ratios and gains had distributions, are read."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.errors import ResultFileError
from drivetwin.files.result_file import load_result
from drivetwin.files.twin_file import load_twin
from drivetwin.report.model_verdict import explain_result
from drivetwin.vehicle.card import load_card
from drivetwin.vehicle.spec import PriorValue
from tests.cli.conftest import Files, bench_files

__all__ = ["bench_files"]

OLDER = Path(__file__).parents[1] / "golden" / "older"


def test_an_older_card_has_the_distributions_of_its_digits() -> None:
    card = load_card(OLDER / "vehicle.toml")
    assert card.final_drive.std > 0.0
    assert card.elements["B3"].gain == PriorValue(0.027, 0.05 * 0.027)


def test_an_older_result_is_explained_with_all_its_findings() -> None:
    content = load_result(OLDER / "result.json")
    findings = [one.to_finding() for one in content.findings]
    assert all(one.text for one in findings)
    correlated = next(one for one in findings if one.code == "residual_correlated")
    assert "up to 7 standard deviations" in correlated.text
    assert "not recorded by the older version" in correlated.text
    assert "Residuals are correlated" in explain_result(content).reason
    assert content.friction["B3"].to_curve().gain is None


def test_commands_take_older_files(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    twin = load_twin(OLDER / "twin.toml")
    assert twin.elements["B3"].gain == 0.027
    log = str(bench_files.log)
    assert main(["simulate", str(OLDER / "twin.toml"), log]) == 0
    assert "output torque" in capsys.readouterr().out
    assert main(["observe", str(OLDER / "twin.toml"), log, "-o", str(tmp_path / "o.csv")]) == 0
    assert main(["export", str(OLDER / "twin.toml"), "--to", "c", "-o", str(tmp_path / "c")]) == 0
    assert main(["card", "check", str(OLDER / "vehicle.toml"), log, "--strict"]) == 0


def test_a_file_that_lacks_entries_is_refused_with_the_command_that_writes_it(
    tmp_path: Path,
) -> None:
    document = json.loads((OLDER / "result.json").read_text(encoding="utf-8"))
    document["schema"] = "drivetwin/result-1"
    del document["parameters"]
    path = tmp_path / "result.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(ResultFileError, match=r"write it again with 'drivetwin.identify'"):
        load_result(path)


@pytest.mark.parametrize(("name", "load"), [("result.json", load_result), ("twin.toml", load_twin)])
def test_a_result_of_the_integral_method_is_refused_by_name(
    name: str, load: Callable[[Path], object], tmp_path: Path
) -> None:
    text = (OLDER / name).read_text(encoding="utf-8")
    changed = re.sub(r'("?method"?\s*[:=]\s*)"likelihood"', r'\1"integral"', text, count=1)
    assert changed != text
    (tmp_path / name).write_text(changed, encoding="utf-8")
    with pytest.raises(ResultFileError, match=r"'method': .* 'paper' or 'likelihood'"):
        load(tmp_path / name)
