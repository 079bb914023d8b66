# SPDX-License-Identifier: MIT
"""Naming schemes of parameter files."""

from __future__ import annotations

from enum import StrEnum


class Names(StrEnum):
    """drivetwin's own ids, or what Simscape Driveline blocks call the same."""

    DRIVETWIN = "drivetwin"
    SIMSCAPE = "simscape"
