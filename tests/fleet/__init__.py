# SPDX-License-Identifier: MIT
"""Tests of fleets."""
