# SPDX-License-Identifier: MIT
"""Sensor tolerances, derived parameters, bands of friction curves."""
