# SPDX-License-Identifier: MIT
"""Calibration of the user's own shift controller, written in C."""
