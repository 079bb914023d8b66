# SPDX-License-Identifier: MIT
"""Synthetic recordings and problems that tests and benchmarks share."""
