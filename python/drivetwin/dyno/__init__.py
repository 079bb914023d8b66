# SPDX-License-Identifier: MIT
"""The virtual dynamometer: logs with known truth from a driveline, its actuators and sensors."""
