# SPDX-License-Identifier: MIT
"""Tests of drivetwin.authoring."""
