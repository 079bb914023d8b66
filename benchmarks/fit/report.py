# SPDX-License-Identifier: MIT
"""Rows of tables as Markdown."""

from __future__ import annotations


def format_row(*cells: str) -> str:
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def format_header(*cells: str) -> str:
    """Return the head of a table with its rule."""
    return f"{format_row(*cells)}\n|{'---|' * len(cells)}"
