# SPDX-License-Identifier: MIT
"""Plausibility of a vehicle card against physics and a log, before any identification."""
