# SPDX-License-Identifier: MIT
"""Sections of the report in reading order; each module converts results to blocks of one kind."""
