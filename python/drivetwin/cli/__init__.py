# SPDX-License-Identifier: MIT
"""The command line; see `drivetwin --help`."""

from __future__ import annotations

from drivetwin.cli.app import app, main

__all__ = ["app", "main"]
