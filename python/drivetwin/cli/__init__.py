# SPDX-License-Identifier: MIT
"""The command line; see `drivetwin --help`."""
