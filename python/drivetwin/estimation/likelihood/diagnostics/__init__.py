# SPDX-License-Identifier: MIT
"""Misspecification tests, residual tests, identifiability."""
