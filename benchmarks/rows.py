# SPDX-License-Identifier: MIT
"""Files of outcomes that a study continues: one line of JSON for each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def read_rows(path: Path | None) -> list[dict[str, Any]]:
    """Read the outcomes of a file; none without one. A line that was cut off is left out."""
    if path is None or not path.exists():
        return []
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return rows


def append_row(path: Path | None, row: Mapping[str, Any]) -> None:
    """Append an outcome to a file, behind a line that was cut off; nothing without a file."""
    if path is None:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+b") as file:
        is_cut = False
        if file.tell():
            file.seek(-1, 2)
            is_cut = file.read(1) != b"\n"
        file.write(("\n" if is_cut else "").encode() + json.dumps(row).encode() + b"\n")
