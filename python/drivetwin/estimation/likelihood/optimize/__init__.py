# SPDX-License-Identifier: MIT
"""Initial guesses, staged starts and multi-start of the likelihood fit."""
