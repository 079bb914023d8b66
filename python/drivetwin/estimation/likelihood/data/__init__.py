# SPDX-License-Identifier: MIT
"""Shift records of the likelihood: samples, input smoothing, quantisation."""
