# SPDX-License-Identifier: MIT
"""Logs: files -> ShiftLog of channels, each on its own time base, units checked, SI inside.

In reading order: `raw` (interface of all readers), `formats` (one reader for each file format),
`origin` (common time origin), `quality` (checks of channels), `read` (from file to ShiftLog),
`summary` and `survey` (contents of a file), `write` (export).
"""
