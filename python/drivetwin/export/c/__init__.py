# SPDX-License-Identifier: MIT
"""C99 export: the sources in `source/` and one generated file with the twin's parameters."""

from __future__ import annotations

from drivetwin.export.c.write import model_sources, twin_source, write_c

__all__ = ["model_sources", "twin_source", "write_c"]
