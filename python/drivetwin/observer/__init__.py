# SPDX-License-Identifier: MIT
"""Estimation of unmeasured torques from speeds and engine torque with an identified twin."""
