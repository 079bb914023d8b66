# SPDX-License-Identifier: MIT
"""Mistakes of an edit by hand in `twin.toml`, each told by its key."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import tomlkit

from drivetwin.errors import ResultFileError
from drivetwin.files.twin_conversion import load_twin, save_twin
from drivetwin.twin.build import build_twin
from tests.report.sample import card, identification


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("transmission.gears.2.element", "B9", "no element 'B9'"),
        ("transmission.gears.2.ratio", 2.9, "i_in·i_c·i_out of B2 is 1.91"),
        ("transmission.gears.2.ratio", 0.0, "greater than 0"),
        ("transmission.elements.B2.i_c", 0.0, "must not be 0"),
        ("parameters.k_o.value", 0.0, "it must be above zero"),
        ("parameters.k_o.unit", "kN*m/rad", "read in 'N*m/rad'"),
        ("friction.B3.stribeck.v_s", 0.0, "it must be above zero"),
        ("friction.B3.slip", None, "the slips do not increase"),
    ],
)
def test_a_wrong_entry_is_told_by_its_key(tmp_path: Path, key: str, value: Any, says: str) -> None:
    path = tmp_path / "twin.toml"
    save_twin(path, build_twin(identification(), card()))
    document = tomlkit.parse(path.read_text(encoding="utf-8"))
    table: Any = document
    *parents, last = key.split(".")
    for part in parents:
        table = table[part]
    table[last] = list(reversed(table[last])) if value is None else value
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    with pytest.raises(ResultFileError) as refused:
        load_twin(path)
    assert key in str(refused.value)
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("table", "old", "new", "says"),
    [
        ("parameters", "k_o", "k_oo", "unknown parameter id 'k_oo'"),
        ("friction", "B3", "B7", "no element 'B7'"),
    ],
)
def test_a_misspelt_name_is_told(tmp_path: Path, table: str, old: str, new: str, says: str) -> None:
    path = tmp_path / "twin.toml"
    save_twin(path, build_twin(identification(), card()))
    document: Any = tomlkit.parse(path.read_text(encoding="utf-8"))
    document[table][new] = document[table].pop(old)
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    with pytest.raises(ResultFileError, match=says):
        load_twin(path)
