# SPDX-License-Identifier: MIT
"""From a German log without units to a simulation of another one, with one mapping."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from drivetwin.cli import main
from tests.support.synth import synthesize

GERMAN = {
    "time": "Zeit",
    "EngTrq": "M_ist",
    "PrsBrk2": "p_B2",
    "PrsBrk3": "Druck B3",
    "TrqOut": "M_Abtrieb",
    "SpdIn": "Drehzahl Getriebeeingang",
    "SpdOut": "Drehzahl Abtrieb",
    "SpdWhl": "nRäder",
}


def write_german(folder: Path, name: str, seed: int) -> tuple[Path, Path]:
    """Write a log with German names and without units, and its card."""
    log, card, _ = synthesize(folder / "made.csv", "paper_steps", seed)
    head, _, *rows = log.read_text().splitlines()
    names = ",".join(GERMAN[one] for one in head.split(","))
    log.unlink()
    path = folder / name
    path.write_text("\n".join([names, *rows]) + "\n", encoding="utf-8")
    return path, card


def test_from_a_log_without_units_to_a_simulation_of_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir()
    second.mkdir()
    log, card = write_german(first, "log.csv", seed=1)
    mapping = first / "channels.toml"
    inspected = ["inspect", str(log), "--vehicle", str(card), "--write-mapping", str(mapping)]
    assert main(inspected) == 0
    assert main(["identify", str(log), "--vehicle", str(card), "-o", str(first / "out")]) == 2
    text = mapping.read_text(encoding="utf-8")
    mapping.write_text(re.sub(r"(?m)^# (unit = )", r"\1", text), encoding="utf-8")
    identified = ["identify", str(log), "--vehicle", str(card), "--quick"]
    assert main([*identified, "-o", str(first / "out")]) == 0

    other, _ = write_german(second, "log.csv", seed=5)
    twin = str(first / "out" / "twin.toml")
    capsys.readouterr()
    assert main(["simulate", twin, str(other), "--json"]) == 0
    captured = capsys.readouterr()
    (shift,) = json.loads(captured.out)["shifts"]
    assert shift["fit"]["output_torque"]["all"]["fit_percent"] > 85.0
    assert "M_ist in 'Nm'" in captured.err
    assert main(["observe", twin, str(other)]) == 0

    without = second / "without.csv"
    without.write_text(other.read_text(encoding="utf-8").replace("M_ist", "X", 1), encoding="utf-8")
    assert main(["simulate", twin, str(without)]) == 2
    assert "'M_ist' for 'engine_torque'" in capsys.readouterr().err
    optional = second / "optional.csv"
    optional.write_text(
        other.read_text(encoding="utf-8").replace("nRäder", "X", 1).replace("M_Abtrieb", "Y", 1),
        encoding="utf-8",
    )
    assert main(["simulate", twin, str(optional)]) == 0
