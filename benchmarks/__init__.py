# SPDX-License-Identifier: MIT
"""Measurements: each writes or prints its figures; none is a test."""
