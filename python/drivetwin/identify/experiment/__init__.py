# SPDX-License-Identifier: MIT
"""Which further recording would tell best what a log leaves open."""
