# SPDX-License-Identifier: MIT
"""Residual covariance and the linear response to input noise."""
