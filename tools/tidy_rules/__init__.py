# SPDX-License-Identifier: MIT
"""Rules of `tools.tidy`, one file per subject."""
