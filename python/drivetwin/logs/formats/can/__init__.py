# SPDX-License-Identifier: MIT
"""Bus logs: frames of candump, ASC, TRC, BLF and MDF 4 files, decoded by DBC databases.

In reading order: `formats/frames` (common table of frames), `line_formats`, `line_format`, `blf`,
`mdf_frames`, `database` (DBC and bits to numbers), `recording` (columns of a bus log), `open`.
"""
