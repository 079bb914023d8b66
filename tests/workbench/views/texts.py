# SPDX-License-Identifier: MIT
"""Texts of the components of a view."""

from __future__ import annotations

from collections.abc import Iterator

from dash.development.base_component import Component


def iterate_texts(content: object) -> Iterator[str]:
    """Yield the texts in reading order."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, list | tuple):
        for one in content:
            yield from iterate_texts(one)
    elif isinstance(content, Component):
        yield from iterate_texts(getattr(content, "children", None))
