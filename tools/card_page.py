# SPDX-License-Identifier: MIT
"""Write the table of keys in docs/reference/vehicle-card.md from the fields of a card.

`python -m tools.card_page` writes the page.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from drivetwin.vehicle.card_fields import CardField, read_card_fields

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "vehicle-card.md"
_START, _END = "<!-- written by `python -m tools.card_page` -->\n", "<!-- end -->\n"
_SECTIONS = {
    "gears": "`[[gears]]`",
    "elements": "`[elements.<name>]`",
    "inertia": "`[inertia]`",
    "sensors": "`[sensors.<role>]`",
}
"""Tables by the first part of the key of their fields."""
_TABLES = {
    ("converter",): "`[converter]`",
    ("effects",): "`[effects]`",
    ("channels",): "`[channels.<role>]`",
    ("elements", "actuator"): "`[elements.<name>.actuator]`",
}
"""Fields that are tables."""


def fill_page(page: str) -> str:
    """Return the page with the table of keys as the fields have it."""
    start, end = page.index(_START) + len(_START), page.index(_END)
    return f"{page[:start]}{''.join(_write_table())}{page[end:]}"


def _write_table() -> Iterator[str]:
    yield "| key | meaning | default |\n|---|---|---|\n"
    for field in read_card_fields().values():
        if field.entry:
            yield f"| {_name_key(field)} | {field.reference} | {field.default} |\n"


def _name_key(field: CardField) -> str:
    if field.key in _TABLES:
        return _TABLES[field.key]
    section = f"{_SECTIONS[field.key[0]]} " if len(field.key) > 1 else ""
    return f"{section}`{field.entry}`"


if __name__ == "__main__":
    PAGE.write_text(fill_page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
