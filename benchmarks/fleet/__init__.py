# SPDX-License-Identifier: MIT
"""Fleets with known truth: acceptance with thousands of logs, faults, scaling."""
