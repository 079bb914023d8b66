# SPDX-License-Identifier: MIT
"""Views of the workbench: one file for each view, with its layout and its callbacks."""
