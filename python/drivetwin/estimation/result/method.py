# SPDX-License-Identifier: MIT
"""Method, status and shape of friction of an identification, by the names used in results."""

from __future__ import annotations

from enum import StrEnum


class ModelStatus(StrEnum):
    """Status of an identified model by its free-running simulation."""

    VALID = "valid"
    LIMITED = "valid with limits"
    NOT_VALID = "not valid"
    NOT_VALIDATED = "not validated"

    @property
    def is_confirmed(self) -> bool:
        """True if the simulation of the model follows the log."""
        return self in (ModelStatus.VALID, ModelStatus.LIMITED)


class Method(StrEnum):
    """Estimator family."""

    PAPER = "paper"
    LIKELIHOOD = "likelihood"


DEFAULT_METHOD = Method.LIKELIHOOD
"""Method used by default."""


class FrictionShape(StrEnum):
    """Prior knowledge of μ over slip."""

    FREE = "free"
    FALLING = "falling"
    RISING = "rising"
