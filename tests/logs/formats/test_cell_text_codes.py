# SPDX-License-Identifier: MIT
"""Texts of codes: numbers, states and faults, alone and in databases with known samples."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest

from drivetwin.channels.roles import BusOptions, ReadOptions
from drivetwin.logs.formats.cell_text import CodeMeaning, classify_code_text
from drivetwin.logs.read import read_raw

FAULTS = (
    "Fehler", "error", "SNA", "Init", "not available", "NotAvailable", "Not_Available", "invalid",
    "ungültig", "Signal ungültig", "nicht verfügbar", "Initialisierung", "not initialised", "N/A",
    "reserved", "reserviert", "nicht belegt", "Fault detected", "Sensor failure", "kein Signal",
    "unbekannt", "erreur", "non disponible", "no válido", "indisponível", "ogiltig",
    "niet beschikbaar", "błąd", "chyba", "ошибка", "故障", "无效", "Err", "error / not available",
    "Überlauf", "Not yet available", "Fehler: nicht verfügbar", "Don't care",
)  # fmt: skip
STATES = (
    "No error", "kein Fehler", "fehlerfrei", "error free", "off", "Neutral", "N", "1st gear",
    "shift in process", "Shift is not in process", "not engaged", "valid", "None", "Default",
    "Initialization complete", "Fehler nicht vorhanden", "null", "kein Gang", "Reserve", "无故障",
)  # fmt: skip

KINDS = ("fault", "state", "number")


@pytest.mark.parametrize(
    ("meaning", "texts"),
    [
        (CodeMeaning.FAULT, FAULTS),
        (CodeMeaning.STATE, STATES),
        (CodeMeaning.NUMBER, ("3", " -2.5 ", "1e3")),
    ],
)
def test_a_text_has_one_meaning(meaning: CodeMeaning, texts: tuple[str, ...]) -> None:
    assert [text for text in texts if classify_code_text(text) is not meaning] == []


@dataclass(frozen=True, eq=False)
class Case:
    """A signal: line and texts of a database, and the sample that a code means (None: none)."""

    line: str
    texts: str
    meaning: dict[int, float | None]
    codes: list[int]


def draw_case(random: np.random.Generator, name: str, start: int, encoding: str) -> Case:
    length, signed = int(random.integers(4, 17)), bool(random.random() < 0.4)
    scale, offset = float(random.choice((1.0, 0.1, 4.0, 0.125))), float(random.choice((0.0, -40.0)))
    low, high = (-(1 << length - 1), 1 << length - 1) if signed else (0, 1 << length)
    count = min(200, 1 << length)
    codes = random.choice(np.arange(low, high), count, replace=False).tolist()
    named = codes[: int(random.integers(1, 6))]
    has_numbers = bool(random.random() < 0.4)
    meaning: dict[int, float | None] = {code: scale * code + offset for code in codes}
    pairs = []
    for place, code in enumerate(named):
        kind = (
            "number" if has_numbers and not place else random.choice(("fault", "state", "number"))
        )
        text = f"{scale * code + offset + 0.5:.4f}"
        if kind == "fault" or (kind == "number" and not has_numbers):
            meaning[code], text = None, str(random.choice(FAULTS))
        elif kind == "state":
            meaning[code] = None if has_numbers else meaning[code]
            text = str(random.choice(STATES))
        else:
            meaning[code] = float(text)
        text = text.encode(encoding, "replace").decode(encoding)
        if classify_code_text(text) is CodeMeaning.STATE:  # a fault that the encoding cannot write
            meaning[code] = None if has_numbers else scale * code + offset
        written = code + (1 << length) if code < 0 and random.random() < 0.5 else code
        pairs.append(f'{written} "{text}"')
    order = 1 if random.random() < 0.5 else 0
    first = start if order else start + 7
    sign = "-" if signed else "+"
    line = f' SG_ {name} : {first}|{length}@{order}{sign} ({scale},{offset}) [0|0] "N·m" A\n'
    drawn = [named, codes]
    samples = [int(random.choice(drawn[int(random.random() < 0.6)])) for _ in range(60)]
    return Case(line, f"VAL_ 291 {name} {' '.join(pairs)} ;\n", meaning, samples)


def check_database(folder: Path, seed: int) -> None:
    """Write a database and a log of known samples; compare what is read."""
    random = np.random.default_rng(seed)
    encoding = str(random.choice(("utf-8", "utf-8-sig", "cp1252")))
    cases = {f"s{k}": draw_case(random, f"s{k}", 16 * k, encoding) for k in range(4)}
    head = 'VERSION ""\n\nBU_: A\n\nBO_ 291 M: 8 A\n'
    lines, texts = (
        "".join(one.line for one in cases.values()),
        [one.texts for one in cases.values()],
    )
    text = head + lines + "\n" + "".join(texts)
    dbc, log = folder / "bus.dbc", folder / "bus.log"
    dbc.write_bytes(text.encode(encoding, "replace"))
    database: Any = cantools.database.load_string(head + lines, "dbc", strict=False)
    message = database.messages[0]
    rows = [
        message.encode({name: one.codes[k] for name, one in cases.items()}, scaling=False).hex()
        for k in range(60)
    ]
    log.write_text("".join(f"({0.01 * k:.6f}) can0 123#{row}\n" for k, row in enumerate(rows)))
    raw = read_raw(log, ReadOptions(bus=BusOptions((dbc,))))
    for name, one in cases.items():
        expected = [one.meaning[code] for code in one.codes]
        kept = [k for k, value in enumerate(expected) if value is not None]
        found = raw.get_channels(name)
        assert bool(found) == bool(kept), (seed, name)
        if found:
            (channel,) = found
            assert channel.unit == "N·m"
            assert channel.time == pytest.approx(0.01 * np.array(kept)), (seed, name)
            assert channel.values == pytest.approx(
                np.array([expected[k] for k in kept], np.float64), abs=1e-9
            ), (seed, name, one.texts)
            assert (len(kept) < 60) == any("left out" in note for note in channel.notes)


def test_databases_with_texts(tmp_path: Path) -> None:
    for seed in range(10):
        check_database(tmp_path, seed)


@pytest.mark.exhaustive
def test_many_databases_with_texts(tmp_path: Path) -> None:
    for seed in range(10, 200):
        check_database(tmp_path, seed)
