# SPDX-License-Identifier: MIT
"""C99 export: the sources in `source/` and one generated file with the twin's parameters."""

from __future__ import annotations

from drivetwin.export.c.write import generate_twin_source, read_model_sources, write_c

__all__ = ["generate_twin_source", "read_model_sources", "write_c"]
