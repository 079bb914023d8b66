# SPDX-License-Identifier: MIT
"""Dual clutch, networks of elements, batches and linearisation over the native core."""
