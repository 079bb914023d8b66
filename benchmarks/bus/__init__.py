# SPDX-License-Identifier: MIT
"""Coverage of the intervals of `drivetwin identify` on bus logs of made drives."""
