# SPDX-License-Identifier: MIT
"""Inputs that cannot be used: a typed error that says what to do, exit code 2, nothing written."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from drivetwin.cli import main
from tests.support.synth import synthesize

Rows = list[list[str]]
NAMES = ["time", "EngTrq", "PrsBrk2", "PrsBrk3", "TrqOut", "SpdIn", "SpdOut", "SpdWhl"]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """Text of a usable log, thinned to 250 Hz for speed, and of its card."""
    log, card, _ = synthesize(tmp_path_factory.mktemp("good") / "log.csv", "paper_steps", 1)
    head, units, *rows = log.read_text().splitlines()
    return "\n".join([head, units, *rows[::4]]) + "\n", card.read_text()


def _edit(change: Callable[[Rows], Rows]) -> Callable[[str], bytes]:
    """A change of the table as one of the file."""

    def changed(text: str) -> bytes:
        rows = change([line.split(",") for line in text.splitlines()])
        return ("\n".join(",".join(row) for row in rows) + "\n").encode()

    return changed


def _column(name: str, change: Callable[[int, str], str]) -> Callable[[Rows], Rows]:
    """Change every sample of one column, given its row number and text."""
    place = NAMES.index(name)

    def changed(rows: Rows) -> Rows:
        for number, row in enumerate(rows[2:]):
            row[place] = change(number, row[place])
        return rows

    return changed


def _unit(name: str, unit: str) -> Callable[[Rows], Rows]:
    def changed(rows: Rows) -> Rows:
        rows[1][NAMES.index(name)] = unit
        return rows

    return changed


def _without(name: str) -> Callable[[Rows], Rows]:
    place = NAMES.index(name)
    return lambda rows: [row[:place] + row[place + 1 :] for row in rows]


def _swapped_times(rows: Rows) -> Rows:
    rows[500][0], rows[501][0] = rows[501][0], rows[500][0]
    return rows


def _before_the_shift(rows: Rows) -> Rows:
    return [row for row in rows if row[0] in ("time", "s") or float(row[0]) < 1.9]


def _same(data: str) -> bytes:
    return data.encode()


@dataclass(frozen=True)
class Case:
    """How log and card are spoilt, the error's type, and what its text must speak of."""

    error: str
    says: str
    log: Callable[[str], bytes] = _same
    card: Callable[[str], str] = str


CASES = {
    "missing channel": Case(
        "MissingChannelError", "input_speed.*--channels", _edit(_without("SpdIn"))
    ),
    "missing pressure": Case(
        "MissingChannelError", r"pressure\.B3.*--channels", _edit(_without("PrsBrk3"))
    ),
    "unknown unit": Case("UnitError", "TrqOut.*Nx.*unit =", _edit(_unit("TrqOut", "Nx"))),
    "missing unit": Case("UnitError", "SpdIn.*no unit.*unit =", _edit(_unit("SpdIn", ""))),
    "unit of another quantity": Case(
        "UnitError", "PrsBrk2.*torque.*pressure", _edit(_unit("PrsBrk2", "Nm"))
    ),
    "time not increasing": Case("TimeError", "increas.*->", _edit(_swapped_times)),
    "time constant": Case("TimeError", "repeat.*->", _edit(_column("time", lambda *_: "1.5"))),
    "time beyond all clocks": Case(
        "TimeError", "apart.*->", _edit(_column("time", lambda n, _: f"{n}e300"))
    ),
    "NaN run": Case(
        "DamagedChannelError",
        "SpdOut.*->",
        _edit(_column("SpdOut", lambda n, text: "NaN" if n > 300 else text)),
    ),
    "constant channel": Case(
        "DamagedChannelError", "TrqOut.*constant", _edit(_column("TrqOut", lambda *_: "2400"))
    ),
    "no shift": Case("NoShiftError", "shift.*->", _edit(_before_the_shift)),
    "pressure 1e5 too large": Case("PlausibilityError", "PrsBrk2.*Pa", _edit(
        lambda rows: _column("PrsBrk2", lambda _, t: f"{1e5 * float(t):g}")(
            _column("PrsBrk3", lambda _, t: f"{1e5 * float(t):g}")(rows)
        )
    )),
    "pressure 1e5 too small": Case(
        "PlausibilityError", "PrsBrk2.*bar", _edit(lambda rows: _unit("PrsBrk2", "Pa")(rows))
    ),
    "unknown card key": Case(
        "CardError", "final_driv.*final_drive",
        card=lambda text: text.replace("final_drive", "final_driv"),
    ),
    "impossible ratio": Case(
        "CardError", "ratio", card=lambda text: text.replace("ratio = 1.91", "ratio = -1.91")
    ),
    "ratio that no brake makes": Case(
        "CardError", "brake.*ratio", card=lambda text: text.replace("ratio = 1.43", "ratio = 1.0")
    ),
    "card is not TOML": Case("CardError", "line 1", card=lambda text: "= " + text),
    "empty log": Case("FileFormatError", "empty", lambda _: b""),
    "binary log": Case("FileFormatError", "->", lambda _: bytes(range(256)) * 40),
    "names but no samples": Case(
        "FileFormatError", "sample", lambda text: "\n".join(text.splitlines()[:2]).encode()
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_error_is_typed_says_what_to_do_and_leaves_nothing(
    case: Case, good: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, card, out = tmp_path / "log.csv", tmp_path / "card.toml", tmp_path / "out"
    log.write_bytes(case.log(good[0]))
    card.write_text(case.card(good[1]))
    command = ["identify", str(log), "--vehicle", str(card), "-o", str(out)]

    assert main([*command, "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    text = f"{error['where']} {error['what']} -> {error['remedy']}"
    assert error["type"] == case.error
    assert error["remedy"]
    assert re.search(case.says, text, re.DOTALL | re.IGNORECASE), text
    assert {path.name for path in tmp_path.iterdir()} == {"log.csv", "card.toml"}


def test_missing_files_are_named(
    good: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "card.toml").write_text(good[1])
    for log, card in (("log.csv", "nothing.toml"), ("nothing.csv", "card.toml")):
        arguments = ["identify", str(tmp_path / log), "--vehicle", str(tmp_path / card)]
        assert main(arguments) == 2
        assert "nothing" in capsys.readouterr().err
