# SPDX-License-Identifier: MIT
"""Gear shifts and their phases, found in a log."""
