# SPDX-License-Identifier: MIT
"""What speeds, gear and engine torque of a bus say about a vehicle, from all shifts together."""
