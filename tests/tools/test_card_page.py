# SPDX-License-Identifier: MIT
"""The tables of keys on the pages of cards are those of their fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from drivetwin.files.schemas import FileKind, build_json_schema, read_key_fields
from drivetwin.vehicle.card_fields import read_card_fields
from tools.card_page import PAGES, fill_page


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_the_table_of_the_page_is_that_of_the_fields(path: Path) -> None:
    page = path.read_text(encoding="utf-8")
    assert page == fill_page(page, PAGES[path]), "write it anew: python -m tools.card_page"


@pytest.mark.parametrize("kind", [FileKind.GEARBOX_CARD, FileKind.POWERTRAIN])
def test_every_key_has_a_field_and_every_field_a_key(kind: FileKind) -> None:
    schema = build_json_schema(kind)
    fields = read_key_fields(kind)
    sections = {field.key[0] for field in fields.values() if len(field.key) > 1}
    tables = schema["$defs"].values()
    entries = [item for table in tables for item in table["properties"].items()]
    entries += [(name, one) for name, one in schema["properties"].items() if name not in sections]
    assert all(one["description"] for _, one in entries)
    assert {name for name, _ in entries} == {field.entry for field in fields.values()}


def test_every_key_of_a_card_has_a_field() -> None:
    schema = build_json_schema(FileKind.VEHICLE_CARD)
    tables: list[dict[str, Any]] = [schema]
    tables += (schema["$defs"][name] for name in ("GearTable", "ElementTable", "InertiaTable"))
    sections = ("gears", "elements", "inertia", "sensors")
    stated = {name for table in tables for name in table["properties"] if name not in sections}
    assert stated <= {field.entry for field in read_card_fields().values()}


def test_every_key_of_a_table_is_described() -> None:
    schema = build_json_schema(FileKind.VEHICLE_CARD)
    for name in ("GearTable", "ElementTable", "InertiaTable", "TorqueSensor", "SpeedSensor"):
        entries = schema["$defs"][name]["properties"].values()
        assert all(entry["description"] for entry in entries)
