# SPDX-License-Identifier: MIT
"""Simulation of measured shifts by a twin, cross-validation, joint identification of logs."""
