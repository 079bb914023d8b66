# SPDX-License-Identifier: MIT
"""Least-squares optimisers over an `Objective`, without knowledge of the driveline."""
