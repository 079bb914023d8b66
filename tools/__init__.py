# SPDX-License-Identifier: MIT
"""Programs for those who work on drivetwin; no part of the package."""
