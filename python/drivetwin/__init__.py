# SPDX-License-Identifier: MIT
"""drivetwin: from gear-shift logs to validated driveline models."""
