# SPDX-License-Identifier: MIT
"""Preparation of logs for estimation: signals, segments, selection of shifts, noise."""
