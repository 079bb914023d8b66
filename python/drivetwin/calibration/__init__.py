# SPDX-License-Identifier: MIT
"""Calibration of a shift: controller policy, scenarios, metrics, optimiser, certificate."""
