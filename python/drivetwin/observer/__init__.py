# SPDX-License-Identifier: MIT
"""Torques that no sensor shows, from speeds and engine torque with an identified twin."""
