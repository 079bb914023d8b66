# SPDX-License-Identifier: MIT
"""Write what follows from the schema of the elements in the core.

`python -m tools.elements` writes python/drivetwin/modeling/element_methods.py, the methods of the
builder, and the generated parts of docs/reference/elements.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields as list_fields
from pathlib import Path
from textwrap import fill

from drivetwin.modeling.model_components import FIELD_OF, Plates
from drivetwin.simulation.element_schema import ELEMENT_TYPES, ElementType, Field, FieldKind
from tools.elements_page import fill_page

ROOT = Path(__file__).resolve().parents[1]
METHODS = ROOT / "python" / "drivetwin" / "modeling" / "element_methods.py"
PAGE = ROOT / "docs" / "reference" / "elements.md"

_HEAD = '''\
# SPDX-License-Identifier: MIT
"""Elements of a model, one method per type; `python -m tools.elements` writes this file."""

# fmt: off
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from drivetwin.modeling.model_components import (
    Component,
    ModelComponents,
    Place,
    Plates,
    document_methods,
)
from drivetwin.simulation.added_elements import Converter
from drivetwin.simulation.network import InputValue


@document_methods
class ElementMethods(ModelComponents):
    """Methods that add elements; the class decorator adds law and parameters to their help."""
'''
_TYPES = {
    FieldKind.NODE: "Place",
    FieldKind.INPUT: "InputValue",
    FieldKind.TEXT: "str",
    FieldKind.FLAG: "bool",
    FieldKind.NUMBER: "float",
    FieldKind.NUMBERS: "Sequence[float]",
    FieldKind.ROWS: "Sequence[Sequence[float]]",
    FieldKind.GROUP: "Mapping[str, Any]",
}
_PLATES = frozenset(field.name for field in list_fields(Plates))
"""Fields of a clutch that its parameter `plates` contains."""
_PARAMETERS = {field: parameter for parameter, field in FIELD_OF.items()}
_UNBREAKABLE = "\N{NO-BREAK SPACE}"


def write_methods() -> str:
    """Return the source of the element methods."""
    return _HEAD + "".join(map(_write_method, ELEMENT_TYPES, ELEMENT_TYPES.values()))


def _write_method(kind: str, element: ElementType) -> str:
    plates = _PLATES if kind == "clutch" else frozenset()
    fields = {key: one for key, one in element.fields.items() if key not in plates}
    positional: list[str] = []
    keywords: list[str] = []
    arguments = [f'"{kind}"', "name"]
    for key, field in fields.items():
        chosen = positional if _is_positional(kind, key, field) else keywords
        chosen.append(_write_parameter(kind, key, field))
        arguments.append(f"{key}={_PARAMETERS.get(key, key)}")
    if plates:
        keywords.append("plates: Plates | None = None")
        arguments.append("**(plates or Plates()).describe()")
    positional.sort(key=lambda parameter: "=" in parameter)
    parameters = ["self", "name: str", *positional, *(["*", *keywords] if keywords else [])]
    indent = " " * 8
    lines = [
        *_wrap(f"    def {kind}(", parameters, ") -> Component:"),
        fill(f'"""{element.help}"""', 100, initial_indent=indent, subsequent_indent=indent),
        *_wrap(f"{indent}return self._add(", arguments, ")"),
    ]
    return "\n" + "\n".join(lines) + "\n"


def _is_positional(kind: str, key: str, field: Field) -> bool:
    """Return true for required places, the input of a source, and the number of an inertia."""
    is_place = field.kind is FieldKind.NODE and field.required
    return is_place or key == "input" or key == kind


def _write_parameter(kind: str, key: str, field: Field) -> str:
    text = _TYPES[field.kind]
    if (kind, key) == ("torque_converter", "map"):
        text = f"Converter | {text}"
    own_node = field.kind is FieldKind.NODE and (key != "node" or kind == "inertia")
    default = None if own_node else field.default
    if own_node or not field.required:
        text += " | None"
    is_optional = own_node or not field.required or default is not None
    return f"{_PARAMETERS.get(key, key)}: {text}{f' = {default!r}' if is_optional else ''}"


def _wrap(head: str, items: Sequence[str], tail: str) -> list[str]:
    """Lines of a call or definition with at most 100 columns; an item is not divided."""
    line = f"{head}{', '.join(items)}{tail}"
    if len(line) <= 100:
        return [line]
    indent = " " * (len(head) - len(head.lstrip()))
    text = ", ".join(item.replace(" ", _UNBREAKABLE) for item in items)
    body = fill(text, 100, initial_indent=f"{indent}    ", subsequent_indent=f"{indent}    ")
    return [head, *body.replace(_UNBREAKABLE, " ").splitlines(), f"{indent}{tail}"]


def main() -> None:
    """Write both files."""
    METHODS.write_text(write_methods(), encoding="utf-8")
    PAGE.write_text(fill_page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
