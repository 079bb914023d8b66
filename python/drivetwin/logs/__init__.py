# SPDX-License-Identifier: MIT
"""Logs: files -> ShiftLog of channels, each on its own time base, units checked, SI inside.

In reading order: `shiftlog` (the result), `raw` (what a reader delivers), `formats` (which reader),
the readers `csv` (with `cells`, `clock`, `names`), `mdf` (with `mdf_blocks`), `mat` (with
`mat_signals`), `parquet`, the folder `can` (bus logs) and `j1939` on top of it; `units`, `roles`,
`mapping` and `profile` (which column is what); `damage` and `validate` (one channel), `agreement`
and `align` (channels together), `held`; `read`, which joins them, `summary` for a look at a file,
and `write` for the way back.
"""
