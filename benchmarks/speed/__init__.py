# SPDX-License-Identifier: MIT
"""Speed of the simulation of a shift beside other programs: `python -m benchmarks.speed`."""
