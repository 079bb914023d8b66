# SPDX-License-Identifier: MIT
"""Stiff linear drivelines against implicit integrators, in one run."""
