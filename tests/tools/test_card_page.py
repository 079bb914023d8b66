# SPDX-License-Identifier: MIT
"""The table of keys on the page of the vehicle card is that of the card's fields."""

from __future__ import annotations

from typing import Any

from drivetwin.files.schemas import FileKind, build_json_schema
from drivetwin.vehicle.card_fields import read_card_fields
from tools.card_page import PAGE, fill_page


def test_the_table_of_the_page_is_that_of_the_fields() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == fill_page(page), "write it anew: python -m tools.card_page"


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
