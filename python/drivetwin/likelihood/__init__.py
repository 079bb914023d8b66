# SPDX-License-Identifier: MIT
"""Likelihood of recordings of a network: terms, noise, search, covariance."""
