# SPDX-License-Identifier: MIT
"""Bus logs: frames of candump, ASC and BLF files, decoded by DBC databases signal by signal.

In reading order: `frames` (the table every format becomes), `candump`, `vector`, `database` (DBC
and bits to numbers), `recording` (columns of a bus log), `open`.
"""
