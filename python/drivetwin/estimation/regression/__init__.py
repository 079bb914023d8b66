# SPDX-License-Identifier: MIT
"""Errors-in-variables regression and modulating functions."""
