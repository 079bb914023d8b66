# SPDX-License-Identifier: MIT
"""Identified driveline model with its uncertainty."""
