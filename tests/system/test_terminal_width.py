# SPDX-License-Identifier: MIT
"""One contract of the output of all commands: 80 columns, and no word is cut."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO

import pytest

from drivetwin.cli import main
from tests.support.bus_logs import write_bus_logs

WIDTH = 80
PREPARED = (
    "synth -o @shift.csv --seed 1",
    "synth --model engine_start -o @k0.csv",
    "identify @shift.csv --vehicle @shift.card.toml -o @result",
    "fit @k0.model.toml @k0.csv --hold-out @k0.csv -o @k0",
)
CALLS = (
    *PREPARED[2:],
    "identify @run0.csv @run1.csv @run2.csv --hold-out run2",
    "examine @k0.csv --model @k0.model.toml",
    "inspect @shift.csv",
    "inspect @run0.csv",
    "shifts @shift.csv --vehicle @shift.card.toml",
    "shifts @run0.csv --vehicle @ratios.toml",
    "simulate @result @shift.csv",
    "simulate @k0 @k0.csv",
    "observe @result @shift.csv",
    "report @result",
    "report @k0",
    "export @result --to csv -o @twin.csv",
    "card check @shift.card.toml @shift.csv",
    "gearbox",
    "gearbox zf-8hp70 --gear 3",
    "reduce zf-8hp70 --shift 2-3",
    "drive",
)
Run = Callable[[str], str]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Run a call in a folder with logs and results, and return what it printed."""
    folder = tmp_path_factory.mktemp("run")

    def call(text: str) -> str:
        with redirect_stdout(StringIO()) as printed:
            assert main(text.replace("@", f"{folder}/").split()) == 0
        return printed.getvalue().replace(f"{folder}/", "")

    write_bus_logs(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", str(WIDTH))
        for each in PREPARED:
            call(each)
    return call


@pytest.mark.parametrize("call", CALLS)
def test_output_fits_80_columns(call: str, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    shown = run(call)
    assert max(len(line.rstrip()) for line in shown.splitlines()) <= WIDTH, shown
    assert "…" not in shown
