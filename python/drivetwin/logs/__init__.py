# SPDX-License-Identifier: MIT
"""Logs: files -> ShiftLog of channels, each on its own time base, units checked, SI inside.

In reading order: `shiftlog` (the result), `raw` (what a reader delivers), `csv` and `cells` (the
text reader), `units`, `roles`, `mapping` and `profile` (which column is what), `validate` and
`agreement` (what data must satisfy), `held`, and `read`, which joins them.
"""
