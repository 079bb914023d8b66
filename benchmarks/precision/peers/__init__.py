# SPDX-License-Identifier: MIT
"""The peers, one module each, with `NAME` and `list_entries(problem)`.

The list is empty for a problem that a peer cannot solve. A module that cannot be imported, or whose
C source cannot be compiled, is named as missing.
"""
