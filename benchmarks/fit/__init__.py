# SPDX-License-Identifier: MIT
"""Accuracy and cost of `Model.fit` on six drivelines: `python -m benchmarks.fit`."""
