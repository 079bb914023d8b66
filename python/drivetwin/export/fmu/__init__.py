# SPDX-License-Identifier: MIT
"""FMU export: the C model behind FMI 2.0 or 3.0, with sources, binaries and a worked experiment."""

from __future__ import annotations
