# SPDX-License-Identifier: MIT
"""JSON Schemas of the files that drivetwin reads and writes, for editors and other programs."""

from __future__ import annotations

from enum import StrEnum
from importlib import import_module
from typing import TYPE_CHECKING, Any

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
    PARAMETERS = "parameters"
    ELEMENTS = "elements"
    MODEL = "model"
    FIT = "fit"


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
    FileKind.PARAMETERS: ("export.parameters.json_file", "ParameterFile"),
}
"""Module below the package, and the model there, by which the program itself checks the file; each
is imported when it is asked for."""


def build_json_schema(kind: FileKind | str) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a file, e.g. of `vehicle-card`.

    The schema contains the keys, their types and the limits of single values. Constraints across
    several keys are checked by the reader only. Raises ValueError for a kind that does not exist.
    """
    kind = FileKind(kind)
    head = {"$schema": _DIALECT, "title": f"drivetwin {kind}"}
    if kind is FileKind.ELEMENTS:
        from drivetwin.files.element_json_schema import build_network_schema  # it loads NumPy

        return {**head, **build_network_schema()}
    module, name = _MODELS[kind]
    model: type[BaseModel] = getattr(import_module(f"drivetwin.{module}"), name)
    schema = {**model.model_json_schema(), **head}
    return _insert_elements(schema) if kind is FileKind.MODEL else schema


def _insert_elements(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a model file with that of its elements."""
    from drivetwin.files.element_json_schema import build_network_schema  # it loads NumPy

    network = build_network_schema()
    definitions = {**schema["$defs"], **network.pop("$defs")}
    properties = {**schema["properties"], "elements": network}
    return {**schema, "properties": properties, "$defs": definitions}
