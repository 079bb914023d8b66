# SPDX-License-Identifier: MIT
"""Helpers outside the domain: atomic writes, progress, display units, TOML."""
