# SPDX-License-Identifier: MIT
"""Readers of log files: CSV, MDF, MAT, Parquet, bus recordings."""
