# SPDX-License-Identifier: MIT
"""Figures as functions: dataclasses in, `plotly` figures out; one set for report, notebook, app."""
