# SPDX-License-Identifier: MIT
"""Small XML documents: build, write, parse."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from drivetwin._util.visible_text import escape_line, escape_text
from drivetwin.errors import FileFormatError, Where


def add_child(parent: ET.Element, tag: str, text: str = "", **attributes: str) -> ET.Element:
    """Append an element with a text and return it."""
    element = ET.SubElement(parent, tag, attributes)
    element.text = text or None
    return element


def format_comment(lines: Iterable[str]) -> str:
    """The lines as one XML comment, which may not hold two hyphens; nothing without lines."""
    text = "\n".join(f"  {escape_line(line)}" for line in lines)
    text = re.sub("-(?=-)", "- ", text)
    return f"<!--\n{text}\n-->" if text else ""


def format_document(root: ET.Element, *heads: str) -> str:
    """Return the tree as indented UTF-8 text, behind the declaration and further `heads`.

    Characters without a glyph, most of which XML cannot hold, are written as escapes.
    """
    for element in root.iter():
        element.text = element.text and escape_text(element.text)
        element.attrib.update({key: escape_line(text) for key, text in element.attrib.items()})
    ET.indent(root)
    body = ET.tostring(root, encoding="unicode")
    declaration = '<?xml version="1.0" encoding="UTF-8"?>'
    return "\n".join(part for part in (declaration, *heads, body) if part) + "\n"


def parse_xml(text: str, source: str) -> ET.Element:
    """Root of a document. Raises FileFormatError where it is no XML or declares entities."""
    if "<!ENTITY" in text:
        raise FileFormatError(
            "the document declares entities", "write them out", Where(file=source)
        )
    try:
        return ET.fromstring(text.encode("utf-8"), parser=ET.XMLParser(encoding="utf-8"))
    except ET.ParseError as fault:
        raise FileFormatError(
            f"no XML: {fault}", "hand in the file as it was written", Where(file=source)
        ) from None


def get_text(element: ET.Element, path: str) -> str:
    """Text of the first element at `path`, empty where there is none."""
    return (element.findtext(path) or "").strip()
