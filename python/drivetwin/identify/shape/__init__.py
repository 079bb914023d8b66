# SPDX-License-Identifier: MIT
"""Friction beyond the Stribeck law: shape over slip, drag of open clutches, pressure, heat."""
