# SPDX-License-Identifier: MIT
"""Error against CPU time, drivetwin beside its peers: `python -m benchmarks.precision`."""
