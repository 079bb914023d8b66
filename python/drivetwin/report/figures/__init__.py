# SPDX-License-Identifier: MIT
"""Figures as functions: dataclasses in, figures out; one set for report, notebook, app."""
