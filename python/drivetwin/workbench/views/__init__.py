# SPDX-License-Identifier: MIT
"""What the workbench shows: one file for each view, each with its layout and its callbacks."""
