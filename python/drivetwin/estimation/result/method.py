# SPDX-License-Identifier: MIT
"""The estimator families, by the names used on the command line and in results."""

from __future__ import annotations

from enum import StrEnum


class Method(StrEnum):
    """Estimator family."""

    PAPER = "paper"
    INTEGRAL = "integral"
    LIKELIHOOD = "likelihood"


DEFAULT_METHOD = Method.LIKELIHOOD
"""Method used by default."""
