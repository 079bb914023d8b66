# SPDX-License-Identifier: MIT
"""Machine, compilers and versions of a measurement, and tables of Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Raw = Mapping[str, Any]
"""A file of raw results."""


def write_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def read_rows(raw: Raw, name: str) -> list[dict[str, Any]]:
    """Read a table of raw results as rows by column."""
    table = raw[name]
    return [dict(zip(table["columns"], one, strict=True)) for one in table["rows"]]


def write_origin(raw: Raw) -> str:
    """Write machine, compilers with their flags, versions, seeds and how times were taken."""
    origin = raw["origin"]
    machine, compilers = origin["machine"], origin["compilers"]
    load = f", load {machine['load'][1]:g}" if machine["load"] else ""
    seeds = ", ".join(str(seed) for seed in origin["seeds"]) or "none"
    flags = [f"{name} `{text}`" for name, text in origin["flags"].items() if name != "core"]
    rows = [
        ("commit", f"{origin['commit']}, measured on {origin['date']}"),
        ("machine", f"{machine['cores']} × {machine['cpu']}; {machine['system']}{load}"),
        ("core", f"{compilers['rustc']}, {origin['flags']['core']}"),
        ("C", "; ".join([f"gcc {compilers['gcc']}", *flags])),
        ("versions", ", ".join(f"{name} {one}" for name, one in origin["versions"].items())),
        ("times", origin["clock"]),
        ("rounds; seeds", f"{origin['rounds']}; {seeds}"),
    ]
    return write_table(("", ""), rows)
