# SPDX-License-Identifier: MIT
"""Write the tables of keys of cards on the pages of the documentation from their fields.

`python -m tools.card_page` writes the pages.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from drivetwin.files.schemas import FileKind, read_key_fields
from drivetwin.vehicle.card_fields import CardField

_TOP = Path(__file__).resolve().parents[1]
PAGES = {
    _TOP / "docs" / "reference" / "vehicle-card.md": FileKind.VEHICLE_CARD,
    _TOP / "docs" / "reference" / "gearbox-card.md": FileKind.GEARBOX_CARD,
    _TOP / "docs" / "howto" / "drive.md": FileKind.POWERTRAIN,
}
"""File that each page describes."""
_START, _END = "<!-- written by `python -m tools.card_page` -->\n", "<!-- end -->\n"
_SECTIONS = {
    "gears": "`[[gears]]`",
    "elements": "`[elements.<name>]`",
    "sets": "`[sets.<name>]`",
    "pairs": "`[pairs.<name>]`",
    "sensors": "`[sensors.<role>]`",
}
"""Tables by the first part of the key of their fields, where their heads have more than it."""
_TABLES = {
    ("converter",): "`[converter]`",
    ("inertia_kgm2",): "`[inertia_kgm2]` `<member>`",
    ("effects",): "`[effects]`",
    ("channels",): "`[channels.<role>]`",
    ("elements", "actuator"): "`[elements.<name>.actuator]`",
}
"""Fields that are tables."""


def fill_page(page: str, kind: FileKind) -> str:
    """Return the page with the table of keys as the fields of the file have it."""
    start, end = page.index(_START) + len(_START), page.index(_END)
    return f"{page[:start]}{''.join(_write_table(kind))}{page[end:]}"


def _write_table(kind: FileKind) -> Iterator[str]:
    yield "| key | meaning | default |\n|---|---|---|\n"
    for field in read_key_fields(kind).values():
        if field.entry:
            meaning = field.reference.replace("|", "\\|")
            yield f"| {_name_key(field)} | {meaning} | {field.default} |\n"


def _name_key(field: CardField) -> str:
    if field.key in _TABLES:
        return _TABLES[field.key]
    first = field.key[0]
    section = f"{_SECTIONS.get(first, f'`[{first}]`')} " if len(field.key) > 1 else ""
    return f"{section}`{field.entry}`"


if __name__ == "__main__":
    for path, kind in PAGES.items():
        path.write_text(fill_page(path.read_text(encoding="utf-8"), kind), encoding="utf-8")
