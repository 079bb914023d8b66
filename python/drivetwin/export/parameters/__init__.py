# SPDX-License-Identifier: MIT
"""Parameter files for calibration and simulation tools: one file per format, read and written."""
