# SPDX-License-Identifier: MIT
"""One log of a fleet: the rows that it leaves beside those of its identification."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from drivetwin.errors import FileFormatError, StoreError
from drivetwin.fleet.identify import identify_log
from drivetwin.fleet.task import Task
from tests.fleet.toys import scan_files


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with a column `TOil` that says 80 and 90 degC in turn, and an empty one, `TGear`."""
    path = tmp_path_factory.mktemp("fleet") / "bench.csv"
    assert main(["synth", "--scenario", "paper_steps", "--seed", "1", "-o", str(path)]) == 0
    head, units, *lines = path.read_text().splitlines()
    filled = [f"{line},{80 + 10 * (k % 2)}," for k, line in enumerate(lines[: len(lines) // 2 * 2])]
    path.write_text("\n".join([f"{head},TOil,TGear", f"{units},degC,degC", *filled]) + "\n")
    return path


def _task(log: Path, *means: tuple[str, str], card: Path | None = None) -> Any:
    rules = log.with_name("rules.toml")
    fields = "".join(f'[fields.{name}]\nchannel = "{channel}"\n' for name, channel in means)
    vehicle = card or log.with_suffix(".card.toml")
    rules.write_text(f'[[rules]]\nvehicle = "{vehicle}"\n{fields}')
    (found,) = scan_files(rules, [str(log)])
    content = hashlib.sha256(log.read_bytes()).hexdigest()
    assert found.file.content == content
    return Task("0123", str(log), content, found.recipe, str(log.with_suffix(".parquet")))


def test_a_channel_without_values_leaves_no_field_and_says_so(log: Path) -> None:
    rows = identify_log(_task(log, ("oil_degC", "TOil"), ("gear_degC", "TGear"))).rows
    (oil,) = [row for row in rows if row.kind.value == "field"]
    assert (oil.name, oil.value, oil.si_unit) == ("oil_degC", 85.0, "degC")
    (reported,) = [row.reason for row in rows if "TGear" in row.reason]
    assert "no field 'gear_degC'" in reported
    assert any(row.kind.value == "parameter" for row in rows)


def test_what_cannot_be_written_besides_is_the_stores_fault(log: Path) -> None:
    with pytest.raises(StoreError, match="a worker cannot write"):
        identify_log(replace(_task(log), report=str(log / "x")))


def test_a_log_that_changed_meanwhile_is_refused(log: Path) -> None:
    """Its rows would stand under the key of the file as it was."""
    with pytest.raises(FileFormatError, match="changed while the fleet was at work"):
        identify_log(replace(_task(log), content="0" * 64))


def test_a_card_that_changed_meanwhile_stops_the_run(log: Path, tmp_path: Path) -> None:
    """The key of a log's rows stands for the card as it was: another one makes other rows."""
    card = tmp_path / "card.toml"
    card.write_bytes(log.with_suffix(".card.toml").read_bytes())
    ours = _task(log, card=card)
    assert identify_log(ours).rows
    for text in (card.read_text() + "# corrected\n", "no TOML"):
        card.write_text(text)
        with pytest.raises(StoreError, match="changed while the fleet was at work"):
            identify_log(ours)
