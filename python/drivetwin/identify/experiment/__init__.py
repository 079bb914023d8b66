# SPDX-License-Identifier: MIT
"""Ranking of further recordings by the parameter uncertainty that they would leave."""
