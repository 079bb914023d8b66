# SPDX-License-Identifier: MIT
"""Identification of any driveline from recordings of any manoeuvre."""
