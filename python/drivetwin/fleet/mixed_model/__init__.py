# SPDX-License-Identifier: MIT
"""Mixed model of a fleet: shared values, units, ageing, outliers."""
