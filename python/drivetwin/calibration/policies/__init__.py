# SPDX-License-Identifier: MIT
"""Policies of a shift: what a calibration may change, one policy a file."""
