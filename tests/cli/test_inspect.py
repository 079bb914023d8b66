# SPDX-License-Identifier: MIT
"""`drivetwin inspect`."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from tests.cli.conftest import Files


def _inspect(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["inspect", *arguments, "--json"]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


def _load(path: Path) -> dict[str, Any]:
    """Load a written mapping; pressures are named as roles."""
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    channels = document.get("channels", {})
    pressures = channels.pop("pressure", {})
    channels |= {f"pressure.{element}": one for element, one in pressures.items()}
    return document


def test_columns_rates_and_roles(bench_files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    found = _inspect(capsys, str(bench_files.log), "--vehicle", str(bench_files.card))
    columns = {column["name"]: column for column in found["columns"]}
    assert columns["EngTrq"]["roles"] == ["engine_torque"]
    assert columns["EngTrq"]["rate"] == pytest.approx(100.0)
    assert columns["PrsBrk3"]["roles"] == ["pressure.B3"]
    assert columns["PrsBrk3"]["unit"] == "bar"
    assert columns["SpdIn"]["rate"] == pytest.approx(1000.0)
    assert found["notes"] == []


def test_the_log_of_a_gearbox_control_is_read_as_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    log, card = tmp_path / "control.csv", tmp_path / "control.card.toml"
    assert main(["synth", "--scenario", "controller_log", "-o", str(log)]) == 0
    capsys.readouterr()
    found = _inspect(capsys, str(log), "--vehicle", str(card))
    columns = {column["name"]: column for column in found["columns"]}
    assert columns["p_K3_cmd"]["roles"] == ["pressure_command.K3"]
    assert columns["p_K3_cmd"]["rate"] == pytest.approx(50.0)  # a ramp that it computed itself
    assert (found["notes"], found["findings"], found["refusal"]) == ([], [], None)
    log.write_text(log.read_text("utf-8").replace("gear_target", "Soll"), "utf-8")
    found = _inspect(capsys, str(log), "--vehicle", str(card))
    assert "requested_gear" in found["refusal"]["what"]
    # Other commands name the kind of the card in place of its keys.
    monkeypatch.setenv("COLUMNS", "200")
    assert main(["card", "check", str(card)]) == 2
    assert "this is the card of a gearbox control" in capsys.readouterr().err


def test_a_log_without_units_names_or_all_samples_is_described_not_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [f"{k / 100 + (1.0 if k > 50 else 0.0):.2f},{k % 7},NaN" for k in range(100)]
    log = tmp_path / "log.csv"
    log.write_text("\n".join(["time,what,n_in", "s,,rpm", *rows]) + "\n")
    found = _inspect(capsys, str(log))
    columns = {column["name"]: column for column in found["columns"]}
    assert columns["what"]["unit"] is None
    assert columns["what"]["gaps"] == 1
    assert columns["n_in"]["gaps"] == 101
    assert columns["n_in"]["range"] is None
    notes = " ".join(found["notes"])
    assert "output_torque" in notes
    assert "--vehicle" in notes


def test_the_written_mapping_is_read_back(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "new" / "map.toml"
    arguments = [str(bench_files.log), "--vehicle", str(bench_files.card)]
    _inspect(capsys, *arguments, "--write-mapping", str(path))
    assert list(path.parent.iterdir()) == [path]
    assert _load(path)["channels"]["pressure.B2"]["source"] == "PrsBrk2"
    assert main(["shifts", *arguments, "--channels", str(path)]) == 0


def _damaged(log: Path, path: Path, factor: float) -> Path:
    """A copy of the log whose output torque is `factor` times as large, -9999 for a while."""
    head, units, *rows = log.read_text().splitlines()
    place = head.split(",").index("TrqOut")
    cells = [row.split(",") for row in rows]
    for number, row in enumerate(cells):
        row[place] = "-9999" if 500 <= number < 510 else f"{factor * float(row[place]):.6g}"
    path.write_text("\n".join([head, units, *(",".join(row) for row in cells)]) + "\n")
    return path


def test_what_shifts_warns_of_is_told_in_the_same_words(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = _damaged(bench_files.log, tmp_path / "log.csv", factor=0.1)
    arguments = [str(log), "--vehicle", str(bench_files.card)]
    found = _inspect(capsys, *arguments)
    assert main(["shifts", *arguments, "--json"]) == 0
    assert found["findings"] == json.loads(capsys.readouterr().out)["findings"]
    texts = [one["text"] for one in found["findings"]]
    assert any("'TrqOut': Far beyond" in text for text in texts)
    assert any("Check scale and unit" in text for text in texts)
    assert found["refusal"] is None
    assert main(["inspect", *arguments]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "Warnings" in shown
    assert all(" ".join(text.split()) in shown for text in texts)


def test_without_a_card_channels_are_looked_at_by_themselves(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = _damaged(bench_files.log, tmp_path / "log.csv", factor=0.1)
    (one,) = _inspect(capsys, str(log))["findings"]
    assert "'TrqOut'" in one["text"]
    assert "left out" in one["text"]


def test_a_log_in_which_nothing_is_recognised_is_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log.csv"
    rows = "".join(f"{0.01 * k:.2f},{k % 7},{k}\n" for k in range(100))
    log.write_text(f"time,Foo,Bar\ns,Nm,rpm\n{rows}")
    found = _inspect(capsys, str(log))
    assert [column["name"] for column in found["columns"]] == ["Foo", "Bar"]
    assert (found["findings"], found["refusal"]) == ([], None)


def test_why_a_log_is_refused_is_told_and_the_columns_all_the_same(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log.csv"
    log.write_text(bench_files.log.read_text().replace("\ns,", "\nms,", 1))
    arguments = [str(log), "--vehicle", str(bench_files.card)]
    found = _inspect(capsys, *arguments)
    assert len(found["columns"]) == 7
    assert found["refusal"]["type"] == "TimeError"
    assert main(["shifts", *arguments, "--json"]) == 2
    refusal = json.loads(capsys.readouterr().out)["error"]
    assert (refusal["type"], refusal["what"]) == ("TimeError", found["refusal"]["what"])
    assert main(["inspect", *arguments]) == 0
    assert "shifts and identify refuse this log" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("column", "words"),
    [("SpdIn", "shifts and identify refuse this log"), ("TrqOut", "identify refuses this log")],
)
def test_the_commands_that_refuse_a_log_are_named(
    bench_files: Files,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    column: str,
    words: str,
) -> None:
    log = tmp_path / "log.csv"
    names, units, *rows = bench_files.log.read_text().splitlines()
    place = names.split(",").index(column)
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[place] = "0.0"
    log.write_text("\n".join([names, units, *(",".join(row) for row in cells)]) + "\n")
    arguments = [str(log), "--vehicle", str(bench_files.card)]
    assert main(["inspect", *arguments]) == 0
    assert words in " ".join(capsys.readouterr().out.split())
    assert main(["shifts", *arguments]) == (2 if column == "SpdIn" else 0)


def _unnamed(log: Path, path: Path) -> Path:
    """A copy of the log without the row of units, as MATLAB's `writetable` makes it."""
    head, _, *rows = log.read_text().splitlines()
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


@pytest.mark.parametrize("with_card", [True, False])
def test_a_log_without_units_is_described_and_its_mapping_proposes_them(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str], *, with_card: bool
) -> None:
    log, path = _unnamed(bench_files.log, tmp_path / "log.csv"), tmp_path / "map.toml"
    card = ["--vehicle", str(bench_files.card)] if with_card else []
    arguments = [str(log), *card, "--write-mapping", str(path)]
    found = _inspect(capsys, *arguments)
    assert len(found["columns"]) == 7
    assert "time column" in found["refusal"]["what"]
    mapping = _load(path)
    assert all("unit" not in one for one in mapping["channels"].values())
    assert "unit" not in mapping.get("time", {})
    assert main(["inspect", *arguments, "--accept-proposals"]) == 0
    accepted = _load(path)
    units = {role: one["unit"] for role, one in accepted["channels"].items()}
    assert units == {
        "engine_torque": "Nm", "output_torque": "Nm", "input_speed": "rpm", "output_speed": "rpm",
        "wheel_speed": "rpm", "pressure.B2": "bar", "pressure.B3": "bar",
    }  # fmt: skip
    assert accepted["time"]["unit"] == "s"
    assert {role: one for role, (one,) in found["proposals"].items()} == {"time": "s"} | units
    shown = " ".join(capsys.readouterr().out.split())
    assert "no unit" not in shown
    assert "refuse" not in shown
    checked = ["shifts", str(log), "--vehicle", str(bench_files.card), "--channels", str(path)]
    assert main(checked) == 0
    capsys.readouterr()
    again = _inspect(capsys, str(log), *card, "--channels", str(path))
    assert (again["refusal"], len(again["notes"])) == (None, 0 if with_card else 1)


def test_the_units_that_the_mapping_proposes_are_listed_until_they_are_stated(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, path = _unnamed(bench_files.log, tmp_path / "log.csv"), tmp_path / "map.toml"
    command = ["inspect", str(log), "--vehicle", str(bench_files.card)]
    assert main([*command, "--write-mapping", str(path)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "time (s), engine_torque (Nm), " in shown
    assert "pressure.B3 (bar); state it in a channel mapping" in shown
    assert '(or "ms"' not in shown
    proposed = re.findall(r'^# unit = "(\w+)"', path.read_text(), re.MULTILINE)
    assert sorted(proposed) == sorted(["s", *2 * ["Nm"], *3 * ["rpm"], *2 * ["bar"]])
    path.write_text(path.read_text().replace('# unit = "s"', 'unit = "s"'))
    assert main([*command, "--channels", str(path)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "proposed from the values: engine_torque (Nm)" in shown


def test_a_mapping_is_written_of_a_log_that_cannot_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, path = tmp_path / "log.csv", tmp_path / "map.toml"
    rows = "".join(f"{0.01 * k:.2f},{k % 7},{k}\n" for k in range(100))
    log.write_text(f"a,b,c\nV,Nm,rpm\n{rows}")
    assert main(["inspect", str(log), "--write-mapping", str(path)]) == 2
    assert "no time column" in capsys.readouterr().err
    text = path.read_text()
    assert "# [channels.engine_torque]" in text
    opened = text.replace('# [time]\n# source = "..."\n# unit = "s"', '[time]\nsource = "a"')
    path.write_text(opened.replace('source = "a"', 'source = "a"\nunit = "s"'))
    assert main(["inspect", str(log), "--channels", str(path)]) == 0


def test_proposals_need_a_file_to_be_written_to(
    bench_files: Files, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["inspect", str(bench_files.log), "--accept-proposals"]) == 2
    assert "--write-mapping" in capsys.readouterr().err


def test_an_ignored_column_is_listed_as_ignored_and_stays_so(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mapping, again = tmp_path / "map.toml", tmp_path / "again.toml"
    mapping.write_text('[columns]\nignored = ["SpdWhl"]\n')
    options = ["--channels", str(mapping), "--write-mapping", str(again)]
    found = _inspect(capsys, str(bench_files.log), "--vehicle", str(bench_files.card), *options)
    columns = {column["name"]: column for column in found["columns"]}
    assert (columns["SpdWhl"]["roles"], columns["SpdWhl"]["ignored"]) == ([], True)
    assert "wheel_speed" not in found["mapping"]
    assert _load(again)["columns"]["ignored"] == ["SpdWhl"]


def test_names_of_the_user_are_recognised_and_kept(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, path = tmp_path / "log.csv", tmp_path / "channels.toml"
    log.write_text(bench_files.log.read_text().replace("EngTrq", "Kanal 7", 1))
    path.write_text('[names]\nengine_torque = ["kanal_7"]\n')
    arguments = [str(log), "--vehicle", str(bench_files.card), "--write-mapping", str(path)]
    columns = {one["name"]: one for one in _inspect(capsys, *arguments)["columns"]}
    assert columns["Kanal 7"]["roles"] == ["engine_torque"]
    assert _load(path)["names"] == {"engine_torque": ["kanal_7"]}
    assert _load(path)["channels"]["engine_torque"]["source"] == "Kanal 7"
