# SPDX-License-Identifier: MIT
"""JSON Schema of a network, a list of elements, from the schema of the core."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drivetwin.simulation.element_schema import ELEMENT_TYPES, ElementType, Field, FieldKind, Limit

_NAME = {"type": "string", "minLength": 1}


def build_network_schema() -> dict[str, Any]:
    """Return the schema of a list of elements; a field with a unit has it as annotation `unit`."""
    elements = {kind: _describe_element(kind, one) for kind, one in ELEMENT_TYPES.items()}
    choices = [{"$ref": f"#/$defs/{kind}"} for kind in elements]
    return {"type": "array", "minItems": 1, "items": {"oneOf": choices}, "$defs": elements}


def _describe_element(kind: str, element: ElementType) -> dict[str, Any]:
    schema = _describe_fields(element.fields)
    unique = {**_NAME, "description": "Unique name."}
    schema["properties"] = {"type": {"const": kind}, "name": unique, **schema["properties"]}
    schema["required"] = ["type", "name", *schema["required"]]
    return {"title": element.help, "description": element.law or element.help, **schema}


def _describe_fields(fields: Mapping[str, Field]) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": {key: _describe_field(one) for key, one in fields.items()},
        "required": [key for key, one in fields.items() if one.required],
        "additionalProperties": False,
    }


def _describe_field(field: Field) -> dict[str, Any]:
    content = _describe_content(field)
    schema = content if field.required else {"anyOf": [content, {"type": "null"}]}
    absent = f" Default: {field.absent}." if field.absent else ""
    unit = {"unit": field.unit} if field.unit else {}
    default = {} if field.default is None else {"default": field.default}
    return {**schema, "description": field.help + absent, **unit, **default}


def _describe_content(field: Field) -> dict[str, Any]:
    match field.kind:
        case FieldKind.NODE | FieldKind.INPUT:
            return _NAME
        case FieldKind.TEXT:
            return {"enum": list(field.choices)}
        case FieldKind.FLAG:
            return {"type": "boolean"}
        case FieldKind.GROUP:
            return {"anyOf": [_describe_fields(fields) for fields in field.group]}
    number = {"type": "number", **_describe_limit(field.limit)}
    if field.kind is FieldKind.NUMBER:
        return number
    numbers = {"type": "array", "items": number, "minItems": 1}
    if field.kind is FieldKind.NUMBERS:
        return numbers
    return {"type": "array", "items": numbers, "minItems": 1}


def _describe_limit(limit: Limit | None) -> dict[str, Any]:
    if limit is None:
        return {}
    bounds = {
        "minimum": limit.least,
        "exclusiveMinimum": limit.above,
        "maximum": limit.most,
        "not": {"enum": list(limit.excluded)} if limit.excluded else None,
    }
    return {key: value for key, value in bounds.items() if value is not None}
