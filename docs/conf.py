# SPDX-License-Identifier: MIT
"""Settings of the documentation site; `make docs` builds it with warnings as errors.

The pages are plain Markdown that reads as well on a code host. `docs/README.md` is the only list of
pages: the navigation is made from its links.
"""

from __future__ import annotations

import re
from typing import Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

import drivetwin

project = "drivetwin"
author = "drivetwin contributors"
project_copyright = author
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "README"
html_theme = "furo"
html_title = "drivetwin"
html_show_sourcelink = False
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = {"math"}  # a code host draws these blocks too
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["site.css"]
default_role = "code"
smartquotes = False

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"  # the docstrings state shapes and units; the types repeat half of it
autodoc_preserve_defaults = True
napoleon_google_docstring = False
suppress_warnings = ["ref.python"]  # a class has two homes: the package and its own module

_LINK = re.compile(r"\]\(([\w./-]+)\.md\)")
_LITERAL = re.compile(r"(`[^`]*`)")
_GREEK_CAPITAL = re.compile("<mi>(&#x0039[1-9A-F];|&#x003A[0-9];)</mi>")
_TEX_FORMS = (  # brackets that grow, and bars without the spaces of an operator
    (r"\ln \lvert", r"\ln\,\left|"),
    (r"\lvert", r"\left|"),
    (r"\rvert", r"\right|"),
    (r"\lVert", r"\left\|"),
    (r"\rVert", r"\right\|"),
    (r"\begin{bmatrix}", r"\left[\begin{matrix}"),
    (r"\end{bmatrix}", r"\end{matrix}\right]"),
)

# Public names are imported on first use; autodoc lists what is there.
for _name in drivetwin.__all__:
    setattr(drivetwin, _name, getattr(drivetwin, _name))


def add_navigation(_app: Any, page: str, source: list[str]) -> None:
    """Append a hidden table of contents to the front page, one per list item with links."""
    if page != root_doc:
        return
    for item in re.split(r"^- ", source[0], flags=re.MULTILINE)[1:]:
        pages = "\n".join(_LINK.findall(item))
        caption = re.split(r"[:(\[]", item.lstrip("["))[0].rstrip("] ")
        if pages:
            source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{pages}\n```\n"


def escape_plain_text(
    _app: Any, what: str, _name: str, _obj: object, _options: Any, lines: list[str]
) -> None:
    """Escape characters of a plain docstring that are markup in reStructuredText."""
    for number, line in enumerate(lines):
        parts = _LITERAL.split(line)
        lines[number] = "".join(
            f"`{part}`" if index % 2 else re.sub(r"([*|\\]|(?<=\w)_(?!\w))", r"\\\1", part)
            for index, part in enumerate(parts)
        )
    if what in ("attribute", "property"):  # else napoleon takes text before a colon for a type
        lines.insert(0, "\\ ")


def convert_equation(text: str, display: str) -> str:
    """Convert an equation to MathML with upright Greek capitals, as TeX has them."""
    for pair in _TEX_FORMS:
        text = text.replace(*pair)
    return _GREEK_CAPITAL.sub(r'<mi mathvariant="normal">\1</mi>', convert(text, display=display))


def write_inline(page: Any, node: Any) -> None:
    """Write an equation in a line as MathML."""
    page.body.append(convert_equation(node.astext(), "inline"))
    raise SkipNode


def write_block(page: Any, node: Any) -> None:
    """Write an equation on lines of its own as MathML."""
    equation = convert_equation(node.astext(), "block")
    page.body.append(f'<div class="math">{equation}</div>\n')
    raise SkipNode


def setup(app: Any) -> None:
    """Connect the hooks; the escape comes before napoleon formats the sections."""
    app.add_html_math_renderer("mathml", (write_inline, None), (write_block, None))
    app.connect("source-read", add_navigation)
    app.connect("autodoc-process-docstring", escape_plain_text, priority=400)
