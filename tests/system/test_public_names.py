# SPDX-License-Identifier: MIT
"""The public names: complete, what they say, and free until used."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import drivetwin
from drivetwin.files.result_file import load_result
from tests.logs import fixtures
from tests.report import sample


def test_a_wrong_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'find_shift'"):
        getattr(drivetwin, "find_shift")  # noqa: B009


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import sys, drivetwin; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert not {"numpy", "scipy", "plotly", "pydantic"} & set(run.stdout.split())


def test_files_may_be_named_by_text(tmp_path: Path) -> None:
    fixtures.card(tmp_path)
    fixtures.write(tmp_path)
    (tmp_path / "map.toml").write_text("", encoding="utf-8")
    place = str(tmp_path)
    card = drivetwin.load_card(f"{place}/card.toml")
    log = drivetwin.read_log(f"{place}/log.csv", card, f"{place}/map.toml")
    assert log.source == f"{place}/log.csv"
    found = sample.identification()
    drivetwin.save_result(f"{place}/result.json", found)
    assert load_result(f"{place}/result.json").parameters.keys() == found.estimates.keys()
    drivetwin.save_twin(f"{place}/twin.toml", drivetwin.build_twin(found, sample.card()))
    assert drivetwin.load_twin(f"{place}/twin.toml").parameters.keys() == found.estimates.keys()
    drivetwin.save_report(f"{place}/report.html", found, sample.log())
    assert (tmp_path / "report.html").stat().st_size > 0
