# SPDX-License-Identifier: MIT
"""How fast a shift is simulated beside other programs: `python -m benchmarks.speed`."""
