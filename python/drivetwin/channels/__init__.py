# SPDX-License-Identifier: MIT
"""Log in memory: channels on their own time bases, roles, units, channel mapping."""
