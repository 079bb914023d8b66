# SPDX-License-Identifier: MIT
"""Bus logs: frames of candump, ASC, TRC, BLF and MDF 4 files, decoded by DBC databases.

In reading order: `formats/frames` (common table of frames), `candump`, `asc`, `trc`, `blf`,
`mdf_frames`, `database` (DBC and bits to numbers), `recording` (columns of a bus log), `open`.
"""
