# SPDX-License-Identifier: MIT
"""Identification of a vehicle from speeds, gear and engine torque on the bus, by all shifts."""
