# SPDX-License-Identifier: MIT
"""The paper's method, unchanged, for comparison."""
