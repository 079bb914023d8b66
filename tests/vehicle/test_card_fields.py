# SPDX-License-Identifier: MIT
"""One contract for all entries of cards: one of another type is refused by its key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import drivetwin
from drivetwin.drive import load_powertrain
from drivetwin.errors import CardError
from drivetwin.gearbox import load_gearbox

ROOT = Path(__file__).resolve().parents[2]
KINDS: dict[str, tuple[Callable[[Path], object], Path]] = {
    "vehicle-card": (drivetwin.load_card, ROOT / "examples/vehicles"),
    "gearbox-card": (load_gearbox, ROOT / "python/drivetwin/gearbox/cards"),
    "powertrain": (load_powertrain, ROOT / "python/drivetwin/drive/powertrains"),
}


def list_entries() -> Iterator[Any]:
    """Yield kind, text of an example and line for the first use of each key."""
    for kind, (_, folder) in KINDS.items():
        known = set()
        for path in sorted(folder.glob("*.toml")):
            text = path.read_text(encoding="utf-8")
            for line in re.findall(r"^\w+ = .*$", text, re.MULTILINE):
                key = line.split(" ")[0]
                try:
                    tomllib.loads(line)
                except tomllib.TOMLDecodeError:  # goes on in the next line
                    continue
                if key not in known:
                    known.add(key)
                    yield pytest.param(kind, text, line, id=f"{kind} {key}")


ENTRIES = list(list_entries())


@pytest.mark.parametrize(("kind", "text", "line"), ENTRIES)
def test_an_entry_of_another_type_is_refused_by_its_key(
    kind: str, text: str, line: str, tmp_path: Path
) -> None:
    path, key = tmp_path / "card.toml", line.split(" ")[0]
    path.write_text(text.replace(line, f"{key} = {{ wrong = [] }}", 1), encoding="utf-8")
    with pytest.raises(CardError) as caught:
        KINDS[kind][0](path)
    assert key in str(caught.value)
    assert caught.value.where.file == str(path)
    assert caught.value.remedy
