# SPDX-License-Identifier: MIT
"""Hydraulic actuator of a clutch: commanded pressure to clutch pressure, and its identification."""
