# SPDX-License-Identifier: MIT
"""First hour: from an empty folder and a German bench export to a report, nothing written by hand.

The gains, P0 and the mass are what a user knows of the vehicle. Four commands take less than 60 s
of CPU time.
"""

from __future__ import annotations

import csv
import json
import time
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from tests.support.synth import synthesize

NAMES = {
    "time": "Zeit",
    "EngTrq": "M_Motor",
    "PrsBrk2": "p_B2",
    "PrsBrk3": "p_B3",
    "TrqOut": "M_Abtrieb",
    "SpdIn": "n_Eingang",
    "SpdOut": "n_Abtrieb",
    "SpdWhl": "n_Rad",
}
CARD = (
    *("--element", "B2:gain_m3=0.0378,P0_bar=0.8", "--element", "B3:gain_m3=0.027,P0_bar=0.8"),
    *("--mass", "20000..36000", "--wheel-radius", "0.5"),
)
"""Data that the log does not show."""


def run_command(folder: Path, *arguments: str) -> str:
    """Run the program in `folder`; return what it printed."""
    with chdir(folder), redirect_stdout(StringIO()) as printed:
        assert main(arguments) == 0, arguments
    return printed.getvalue()


def write_bench_export(path: Path) -> dict[str, float]:
    """Write a shift as a German bench does; return the truth by parameter.

    Semicolons, decimal commas, Latin-1, a line of remarks above the names.
    """
    made, _, truth = synthesize(path.with_name("made.csv"), "paper", 3)
    parameters = json.loads(truth.read_text())["parameters"]
    with made.open(newline="") as file:
        names, units, *rows = list(csv.reader(file))
    for one in path.parent.glob("made.*"):
        one.unlink()
    german = ["1/min" if unit == "rpm" else unit for unit in units]
    lines = [["Prüfstand 3", "Fahrzeug 12"], [NAMES[name] for name in names], german]
    lines += [[cell.replace(".", ",") for cell in row] for row in rows]
    path.write_text("".join(";".join(line) + "\r\n" for line in lines), encoding="latin-1")
    return {name: one["value"] for name, one in parameters.items()}


MOST_CPU = 60.0
"""CPU time of the four commands [s]."""


@pytest.fixture(scope="module")
def first_hour(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    folder = tmp_path_factory.mktemp("first")
    truth = write_bench_export(folder / "messung.csv")
    begun = time.process_time()
    run_command(folder, "card", "new", "-o", "wagen.toml", "--from", "messung.csv", *CARD)
    assert "nothing implausible" in run_command(
        folder, "card", "check", "wagen.toml", "messung.csv"
    )
    run_command(folder, "identify", "messung.csv", "--vehicle", "wagen.toml", "-o", "out")
    run_command(folder, "simulate", "out", "messung.csv", "-o", "vergleich.html")
    assert time.process_time() - begun < MOST_CPU
    return folder, truth


def test_the_report_opens_with_the_verdict(first_hour: tuple[Path, dict[str, float]]) -> None:
    folder, _ = first_hour
    page = (folder / "out" / "report.html").read_text()
    assert page.index("Model: valid") < page.index("Efficiency")
    assert (folder / "vergleich.html").stat().st_size > 10_000


def test_the_identified_values_hold_the_truth(first_hour: tuple[Path, dict[str, float]]) -> None:
    """Intervals of three standard deviations: chance alone fails this in one run of forty."""
    folder, truth = first_hour
    result: dict[str, Any] = json.loads((folder / "out" / "result.json").read_text())
    found = {
        name: one
        for name, one in result["parameters"].items()
        if one["verdict"] == "identified" and name in truth
    }
    assert {"J_vehicle", "k_o", "f_d_3"} <= found.keys()
    for name, one in found.items():
        assert one["value"] == pytest.approx(truth[name], abs=3.0 * one["std_total"]), name
