# SPDX-License-Identifier: MIT
"""SAE J1939 on top of a bus log: parameter groups, transport protocol, codes, percent torque.

`driveline.dbc` describes the messages of engine and gearbox that concern a shift.
"""
