# SPDX-License-Identifier: MIT
"""What the logs of a fleet say together: shared values, units, ageing, changes, outliers."""
