# SPDX-License-Identifier: MIT
"""JSON Schemas of the files that drivetwin reads and writes, for editors and other programs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin.vehicle.card_fields import CardField, read_card_fields

if TYPE_CHECKING:
    from pydantic import BaseModel


_DIALECT = "https://json-schema.org/draft/2020-12/schema"


class FileKind(StrEnum):
    """Kind of file, or the elements of a network, whose keys are checked."""

    VEHICLE_CARD = "vehicle-card"
    GEARBOX_CARD = "gearbox-card"
    POWERTRAIN = "powertrain"
    CHANNEL_MAPPING = "channel-mapping"
    FLEET_RULES = "fleet-rules"
    RESULT = "result"
    TWIN = "twin"
    ELEMENTS = "elements"
    MODEL = "model"
    FIT = "fit"
    RATIO_CARD = "ratio-card"
    BUS = "bus"
    TCU_CARD = "tcu-card"
    TCU = "tcu"
    TCU_TWIN = "tcu-twin"


_MODELS = {
    FileKind.VEHICLE_CARD: ("vehicle.schema", "CardFile"),
    FileKind.GEARBOX_CARD: ("gearbox.card", "GearboxFile"),
    FileKind.POWERTRAIN: ("drive.powertrain", "PowertrainFile"),
    FileKind.CHANNEL_MAPPING: ("channels.mapping_file", "MappingFile"),
    FileKind.FLEET_RULES: ("fleet.rules", "RulesFile"),
    FileKind.RESULT: ("files.result_file", "ResultFile"),
    FileKind.TWIN: ("files.twin_file", "TwinFile"),
    FileKind.MODEL: ("fit.model_file", "NetworkFile"),
    FileKind.FIT: ("files.fit_file", "FitFile"),
    FileKind.RATIO_CARD: ("vehicle.card", "RatioCardFile"),
    FileKind.BUS: ("files.bus_file", "BusFile"),
    FileKind.TCU_CARD: ("tcu.card", "ControllerCardFile"),
    FileKind.TCU: ("files.bus_file", "TcuFile"),
    FileKind.TCU_TWIN: ("files.bus_file", "TcuTwinFile"),
}
"""Module below the package, and the model there, by which the program itself checks the file; each
is imported when it is asked for."""

_FIELDS = {
    FileKind.VEHICLE_CARD: "vehicle/card_fields.toml",
    FileKind.GEARBOX_CARD: "gearbox/card_fields.toml",
    FileKind.POWERTRAIN: "drive/powertrain_fields.toml",
}
"""Meanings of the keys by file below the package."""


def build_json_schema(kind: FileKind | str) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a file, e.g. of `vehicle-card`.

    The schema contains the keys, their types and the limits of single values. Constraints across
    several keys are checked by the reader only. Raises ValueError for a kind that does not exist.
    """
    kind = FileKind(kind)
    head = {"$schema": _DIALECT, "title": f"drivetwin {kind}"}
    if kind is FileKind.ELEMENTS:
        from drivetwin.simulation.element_schema import build_network_schema  # it loads NumPy

        return {**head, **build_network_schema()}
    module, name = _MODELS[kind]
    model: type[BaseModel] = getattr(import_module(f"drivetwin.{module}"), name)
    schema = {**model.model_json_schema(), **head}
    if kind in _FIELDS:
        _describe_keys(schema, kind)
    return _insert_elements(schema) if kind is FileKind.MODEL else schema


def read_key_fields(kind: FileKind) -> Mapping[str, CardField]:
    """Read the meanings of the keys of a card by name."""
    return read_card_fields(Path(__file__).parents[1] / _FIELDS[kind])


def _describe_keys(schema: dict[str, Any], kind: FileKind) -> None:
    """Add the meaning of each key to the schema of a card."""
    for field in read_key_fields(kind).values():
        if field.entry:
            keys = schema["properties"]
            tables = _iterate_tables(schema, keys[field.key[0]]) if field.key[1:] else [keys]
            for entries in tables:
                entries.get(field.entry, {})["description"] = field.reference


def _iterate_tables(schema: dict[str, Any], node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the entries of the tables at and below a node of a schema."""
    node = schema["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node
    entries = node.get("properties", {})
    yield entries
    below = (*entries.values(), *node.get("anyOf", ()), node.get("items"))
    for one in (*below, node.get("additionalProperties")):
        if isinstance(one, dict):
            yield from _iterate_tables(schema, one)


def _insert_elements(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a model file with that of its elements."""
    from drivetwin.simulation.element_schema import build_network_schema  # it loads NumPy

    network = build_network_schema()
    definitions = {**schema["$defs"], **network.pop("$defs")}
    properties = {**schema["properties"], "elements": network}
    return {**schema, "properties": properties, "$defs": definitions}
