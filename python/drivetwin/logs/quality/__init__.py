# SPDX-License-Identifier: MIT
"""Checks of channels: outliers, stuck values, update raster, clock drift, alignment."""
