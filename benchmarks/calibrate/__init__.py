# SPDX-License-Identifier: MIT
"""Calibration of the stated shift, compared with other optimisers."""
