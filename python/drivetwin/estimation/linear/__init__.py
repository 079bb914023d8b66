# SPDX-License-Identifier: MIT
"""Weighted linear estimators of the integral method."""
