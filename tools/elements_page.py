# SPDX-License-Identifier: MIT
"""Help, law and fields of the elements on their reference page."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from textwrap import fill

from drivetwin.simulation.element_schema import ELEMENT_TYPES, ElementType, Field, FieldKind

_UNBREAKABLE = "\N{NO-BREAK SPACE}"
_START, _END = "<!-- written by `python -m tools.elements` -->\n", "<!-- end -->\n"


def fill_page(page: str) -> str:
    """Write the generated part of every section; a type without one gets it behind the others."""
    known: dict[str, str] = {}
    before = ""
    for kind, element in ELEMENT_TYPES.items():
        text = f"{_START}{''.join(_write_section(kind, element, known))}{_END}"
        heading = f"\n## {kind}\n\n"
        if heading not in page:
            after = page.index("\n## ", page.index(before) + 1)
            page = f"{page[:after]}{heading}{text}{page[after:]}"
        start = page.index(heading) + len(heading)
        written = page.startswith(_START, start)
        end = page.index(_END, start) + len(_END) if written else start
        gap = "" if page.startswith("\n", end) else "\n"
        page = f"{page[:start]}{text}{gap}{page[end:]}"
        before = heading
    return page


def _write_section(kind: str, element: ElementType, known: dict[str, str]) -> Iterator[str]:
    for text in filter(None, (element.help, element.law)):
        # Code must not be divided: a line that begins with a minus sign is a list.
        whole = re.sub(r"`[^`]*`", lambda code: code[0].replace(" ", _UNBREAKABLE), text)
        yield f"{fill(whole, 100).replace(_UNBREAKABLE, ' ')}\n\n"
    yield from _write_table(kind, "field", element.fields, known)


def _write_table(
    kind: str, head: str, fields: Mapping[str, Field], known: dict[str, str]
) -> Iterator[str]:
    """Write the table of an element or group, then those of its groups that are new."""
    rows = []
    groups: list[str] = []
    for key, field in fields.items():
        text = field.help
        if field.kind is FieldKind.GROUP:
            source = known.setdefault(repr(field.group), kind)
            if source == kind:
                if len(field.group) > 1:
                    groups.append(f"`{key}` has the fields of one of these tables.\n\n")
                for alternative in field.group:
                    groups += _write_table(kind, f"field of `{key}`", alternative, known)
            else:
                text += f" Fields as of a [{source}](#{source})."
        rows.append(_write_row(key, field, text))
    yield f"| {head} | unit | range | meaning | default |\n|---|---|---|---|---|\n"
    yield "".join(rows) + "\n"
    yield from groups


def _write_row(key: str, field: Field, text: str) -> str:
    limit = field.limit.describe() if field.limit else " or ".join(f"`{c}`" for c in field.choices)
    builder = "" if field.default is None else f"; `Model`: {field.default}".removesuffix(".0")
    text = text.replace("|", "\\|").removesuffix(".")
    return (
        f"| `{key}` | {field.unit} | {limit} | {text} | {field.absent or 'required'}{builder} |\n"
    )
