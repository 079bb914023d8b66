# SPDX-License-Identifier: MIT
"""Plants from logs of a gearbox control, against vehicles of an independent simulator."""
